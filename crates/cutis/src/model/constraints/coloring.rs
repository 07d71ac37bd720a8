//! How constraints get their colors.
//!
//! The edges and tetrahedra of the lattice have colors in closed form. Other constraints, such as
//! those of the skin, are colored greedily, on the CPU also if a GPU solves:
//!
//! - Colors decide the order of the sweeps, and so the bits of a run. With one coloring for all
//!   backends a run has the same bits on the CPU and on software adapters, and a timing never
//!   decides.
//! - A GPU would have to compile kernels, to upload the constraints, and to wait for the host
//!   between rounds. No hardware GPU was available to measure it. `cargo bench -p cutis-solver-gpu
//!   --bench coloring` compares both on the GPUs of a machine.
//! - The coloring on a GPU needs a few colors more. Each is a dispatch in every iteration of a run.

use cutis_coloring::{ColoringError, Groups, greedy};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the constraints of a kind, or the vertices in vertex block descent, get their colors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Coloring {
    /// From their places in the lattice.
    ClosedForm,
    /// Greedy coloring on the CPU, on every backend.
    GreedyCpu,
}

/// Colors constraints over any mesh, as [`Coloring::GreedyCpu`].
///
/// # Errors
/// [`ColoringError`] for a constraint that names a vertex twice, or one that does not exist.
pub(super) fn of_mesh<const N: usize>(
    constraints: &[[u32; N]],
    vertex_count: usize,
) -> Result<Groups, ColoringError> {
    greedy(constraints, vertex_count)
}
