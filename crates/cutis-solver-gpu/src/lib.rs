//! GPU backend: the simulation of `cutis-solver`, executed as WGSL.
//!
//! [`SolverGpu`] runs the schedule of the CPU backends: the same passes in the same order with the
//! same operations. On a software device its results have the bits of
//! [`SolverReference<f32>`](cutis_solver::SolverReference). A hardware device may fuse a
//! multiplication with an addition, and then differs by rounding.
//!
//! - **The state stays on the device.** A frame is one submission, or several for a very long
//!   frame. A call of `step` reads back twelve bytes, which show whether all positions are finite.
//!   Everything else is read on request: [`positions_of`](cutis_solver::Solver::positions_of) reads
//!   only the requested vertices, and [`residuals`](cutis_solver::Solver::residuals) reads two
//!   numbers per 64 constraints. [`SolverGpu::vertices`] gives other kernels access to the
//!   positions without a readback.
//! - **Chunks.** The constraints of a color are stored in parts that fit WebGPU's baseline limits
//!   on bindings, buffers and workgroups. Constraints of a color share no vertex, so the result
//!   does not depend on the split.
//! - **Any mesh can be colored on the device**: [`color`] divides constraints into groups as
//!   [`cutis_coloring::greedy`] does, in another order.
//! - **Only parts in use have pipelines and buffers.** Unused kinds of constraints, handles,
//!   multipliers and measurements have neither.
//!
//! ```
//! use cutis_constraints::Distance;
//! use cutis_gpu::{Gpu, GpuOptions};
//! use cutis_solver::{Settings, Solver, Stiffness, SystemBuilder};
//! use cutis_solver_gpu::SolverGpu;
//! use nalgebra::Point3;
//!
//! let positions = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.1, 0.0, 0.0)];
//! let spring = [[0, 1]];
//! let groups = cutis_coloring::greedy(&spring, 2)?;
//! let system = SystemBuilder::<f32>::new(&positions, &[0.0, 1.0])?
//!     .add::<Distance, 2>(&spring, &[[1.0]], Stiffness::compliance(0.01), &groups)?
//!     .build();
//! match Gpu::open(&GpuOptions::default()) {
//!     Ok(gpu) => {
//!         let mut solver = SolverGpu::new(&gpu, system, Settings::default())?;
//!         solver.step(5)?;
//!         assert!(solver.positions()?[1].x < 1.1);
//!     }
//!     Err(error) => println!("no GPU: {error}"),
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod body;
mod coloring;
mod descent;
mod error;
mod gather;
mod handles;
mod kind;
mod memory;
mod recorder;
mod residual;
mod solver;

pub use coloring::{GpuColoringError, color};
pub use error::GpuSolverError;
pub use memory::device_bytes;
pub use solver::SolverGpu;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
