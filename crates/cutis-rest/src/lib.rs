//! States of rest of soft bodies, without the motion to them.
//!
//! A body at rest is at a minimum of `U(x) = Σ ½C²/α − Σ (m g + load)·x`. Local sweeps, such as
//! those of PBD and vertex block descent, carry a force by one element per color and iteration. So
//! their number of iterations grows with the resolution. [`Body::settle`] finds the minimum by
//! Newton's method. Conjugate gradients solve its equations, with a multigrid cycle as
//! preconditioner. The number of cycles grows slowly with the resolution.
//!
//! The energies are those of a [`System`](cutis_solver::System). All types of constraints count,
//! through their values and gradients. The result has the same bits for any number of threads.
//!
//! # Method
//! - **Equations.** `H d = −∇U` with `H = Σ (∇C∇Cᵀ + C∇²C)/α`. Far from rest, the second
//!   derivatives `∇²C` count only for stretched constraints of types whose value is curved in a
//!   single vertex, such as lengths: the others could make `H` indefinite. Near rest all of them
//!   count. They come from differences of the gradients.
//! - **Preconditioner.** Smoothed aggregation (Vaněk, Mandel and Brezina, Computing 56, 1996): see
//!   `multigrid.rs`. It is built from `H` alone, so it knows every cut. Matrix and cycles have
//!   single precision, energies and forces double precision: see `matrix.rs`. The memory is slow.
//!   So only the blocks above the diagonal are stored (see `symmetric.rs`), and products that
//!   follow on each other go through the matrix together (see `fronts.rs`).
//! - **Steps.** Each step lowers `U`, but a full one may raise it once: see `advance.rs`. Where no
//!   step lowers it, a shift is added to the diagonal, and no step is longer than a reach that
//!   grows: see `trial.rs`. The equations are solved to 5 % in the first step, then to 15 %, and to
//!   10 % near rest.
//!
//! # On a GPU
//! With the feature `gpu`, `Body::on_gpu` gives a body a device that solves the equations of its
//! searches. Forces, matrices and levels come from the CPU, so that third-party types of
//! constraints work as they are. See `RestGpu`.
#![forbid(unsafe_code)]

mod advance;
mod aggregates;
mod blocks;
mod body;
mod compression;
mod conjugate;
mod constraints;
mod curvature;
mod elements;
mod energy;
mod error;
mod fill;
mod follow;
mod fronts;
mod galerkin;
#[cfg(feature = "gpu")]
mod gpu;
mod host;
mod local;
mod matrix;
mod multigrid;
mod options;
mod order;
mod patch;
mod place;
mod prolongation;
mod settle;
mod smoother;
#[cfg(test)]
mod springs;
mod sweep;
mod symmetric;
mod transfer;
mod trial;
mod vectors;

pub use body::Body;
pub use error::RestError;
#[cfg(feature = "gpu")]
pub use gpu::RestGpu;
pub use options::{Options, Rest, Step};
pub use settle::Search;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
