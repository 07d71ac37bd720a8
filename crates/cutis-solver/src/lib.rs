//! Position-based dynamics: the system, the schedule and the scalar reference solver.
//!
//! A [`System`] holds vertices and one batch of constraints per kind, grouped by color. A
//! [`Schedule`] defines the work of a frame and its order. A [`Solver`] executes the schedule:
//! [`SolverReference`] in this crate, `SolverCpu` with several threads in `cutis-solver-cpu`, and
//! `SolverGpu` in `cutis-solver-gpu`. The reference solver processes one constraint after the other
//! in safe scalar code. In `f64` it is the reference for the accuracy of all backends. Both CPU
//! solvers run the same [`Simulation`] and the same [`project`] function, so that their results are
//! equal bit for bit.
//!
//! # Formulations
//! - [`Formulation::Pbd`] (Müller et al. 2007): `Δx_i = −s·w_i·∇_iC·C / Σ w|∇C|²` with a stiffness
//!   `s` in `[0, 1]` per iteration.
//! - [`Formulation::Xpbd`] (Macklin et al. 2016): `Δλ = (−C − α̃λ)/(Σ w|∇C|² + α̃)` and
//!   `Δx_i = w_i ∇_iC Δλ`, with `α̃ = α/h²` and `λ = 0` at the start of every substep.
//! - [`Formulation::Vbd`] (Chen et al. 2024): vertex block descent with the same energies `½C²/α`.
//!   The energy of the implicit step decreases vertex by vertex. See [`VertexForce`] for the force
//!   on a vertex, and `descent.rs` for the differences from the source.
//!
//! US patent 11,270,041 B2 is said to cover the accumulation of λ over iterations. This is not
//! legal advice. `Pbd` and `Vbd` have no λ, and `Xpbd` with one iteration per substep neither
//! stores nor accumulates one. Each of the three is a complete method.
//!
//! # Example
//! A mass on a spring of compliance 0.01 m/N, released at 1.1 times its rest length:
//! ```
//! use cutis_solver::{Formulation, Settings, Solver, SolverReference, Stiffness, SystemBuilder};
//! use cutis_constraints::Distance;
//! use nalgebra::Point3;
//!
//! let positions = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.1, 0.0, 0.0)];
//! let spring = [[0, 1]];
//! let groups = cutis_coloring::greedy(&spring, 2)?;
//! let system = SystemBuilder::<f64>::new(&positions, &[0.0, 1.0])?
//!     .add::<Distance, 2>(&spring, &[[1.0]], Stiffness::compliance(0.01), &groups)?
//!     .build();
//! let formulation = Formulation::Xpbd;
//! let settings = Settings { formulation, dt_s: 0.01, substeps: 10, ..Settings::default() };
//! let mut solver = SolverReference::new(system, settings)?;
//! solver.step(5)?;
//! assert!(solver.positions()?[1].x < 1.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Unsafe code
//! Only `colored.rs` contains unsafe code. Its types [`Colored`] and [`ColoredVertices`] let
//! several threads move the vertices of one color. The rest of this crate and the backends are safe
//! code.

mod batch;
mod builder;
mod change;
mod clock;
mod color;
mod colored;
mod columns;
mod descent;
mod error;
mod handle;
mod kernel;
mod loads;
mod measures;
mod passes;
mod reference;
mod resting;
mod schedule;
mod set;
mod settings;
mod shares;
mod simulation;
mod solver;
mod step_profile;
mod stiffness;
mod system;
mod teams;
mod vertex;

pub use builder::SystemBuilder;
pub use change::Change;
pub use clock::Clock;
pub use color::{ConstraintColor, VertexColor, VertexStore};
pub use colored::{Colored, ColoredVertices};
pub use columns::Columns;
pub use descent::{Descent, DescentStep, VertexForce};
pub use error::SolverError;
pub use handle::{Handle, KinematicHandle};
pub use kernel::{Pbd, Projection, Rule, Xpbd, project};
pub use loads::add_forces;
pub use measures::{Energy, MemoryPart, Momentum, Residual};
pub use passes::{Integrator, VertexBlock, VertexPass};
pub use reference::{Serial, SolverReference};
pub use resting::Resting;
pub use schedule::{ColorPass, Schedule, Sweep};
pub use set::{ConstraintSet, Kind, Step};
pub use settings::{Formulation, Settings};
pub use simulation::{Execute, Method, Simulation};
pub use solver::Solver;
pub use step_profile::{StepProfile, TimePart, Timed};
pub use stiffness::{Stiffness, Values};
pub use system::System;
pub use vertex::Vertex;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
