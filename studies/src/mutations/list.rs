//! Mutations of constraints, GPU passes and resampling: typical programming faults, each an edit in
//! one place.

/// One fault.
pub struct Mutation {
    /// Description of the fault.
    pub fault: &'static str,
    /// The file, from the root of the checkout.
    pub file: &'static str,
    /// Text that occurs exactly once in the file.
    pub from: &'static str,
    /// Replacement.
    pub to: &'static str,
    /// The tests that must notice it.
    pub suite: Suite,
}

/// A suite of tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suite {
    /// The battery of the constraint types.
    Conformance,
    /// The CPU and GPU backends against the reference.
    Solver,
    /// Resampling on a GPU against its CPU twin and against `f64`.
    Resample,
    /// Problems with known answers, on the CPU and on a GPU.
    Problems,
    /// The quick part of the stability suite, on the CPU and on a GPU.
    Stability,
    /// ChainMail, on the CPU and on a GPU.
    ChainMail,
    /// Pictures, meshes, tables and reports against known landmarks.
    Outputs,
}

impl Suite {
    /// All suites.
    pub const ALL: [Self; 7] = [
        Self::Conformance,
        Self::Solver,
        Self::Resample,
        Self::Problems,
        Self::Stability,
        Self::ChainMail,
        Self::Outputs,
    ];

    /// Name on the command line and in the page.
    pub fn name(self) -> &'static str {
        match self {
            Self::Conformance => "conformance",
            Self::Solver => "solver",
            Self::Resample => "resample",
            Self::Problems => "problems",
            Self::Stability => "stability",
            Self::ChainMail => "chainmail",
            Self::Outputs => "outputs",
        }
    }

    /// Arguments of `cargo test`.
    pub fn arguments(self) -> &'static [&'static str] {
        match self {
            Self::Conformance => &["-p", "cutis-conformance", "--test", "all", "builtin"],
            Self::Solver => &["-p", "cutis-solver-gpu", "-p", "cutis-solver-cpu", "--test", "all"],
            Self::Resample => &["-p", "cutis-resample", "--features", "gpu", "--test", "all", "gpu::"],
            Self::Problems => &["-p", "cutis-tests", "--test", "all", "problems::"],
            Self::Stability => &["-p", "cutis-tests", "--test", "all", "stability::"],
            Self::ChainMail => &["-p", "cutis-chainmail", "--features", "gpu", "--tests"],
            Self::Outputs => &[
                "-p",
                "cutis-tests",
                "-p",
                "cutis-cli",
                "--test",
                "all",
                "--test",
                "cli",
                "--",
                "outputs::",
                "looks::",
            ],
        }
    }
}

/// A mutation.
pub const fn mutation(
    suite: Suite,
    fault: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
) -> Mutation {
    Mutation { fault, file, from, to, suite }
}

use Suite::{Conformance, Problems, Resample, Solver};

/// The mutations, grouped by location.
pub const MUTATIONS: &[Mutation] = &[
    // Constraints in WGSL.
    mutation(
        Conformance,
        "distance, WGSL: both gradients point the same way",
        "shaders/wgsl/constraints/distance.wgsl",
        "(direction, -direction)",
        "(direction, direction)",
    ),
    mutation(
        Conformance,
        "distance, WGSL: sign of the rest length",
        "shaders/wgsl/constraints/distance.wgsl",
        "length - p.rest_length",
        "length + p.rest_length",
    ),
    mutation(
        Conformance,
        "distance, WGSL: no guard for coincident points",
        "shaders/wgsl/constraints/distance.wgsl",
        "select(0.0, 1.0 / select(1.0, length, apart), apart)",
        "1.0 / length",
    ),
    mutation(
        Conformance,
        "volume, WGSL: the 1/6 is missing",
        "shaders/wgsl/constraints/volume.wgsl",
        "let sixth = 1.0 / 6.0;",
        "let sixth = 1.0;",
    ),
    mutation(
        Conformance,
        "volume, WGSL: two gradients swapped",
        "shaders/wgsl/constraints/volume.wgsl",
        "(grad1, grad2, grad3, grad4)",
        "(grad1, grad2, grad4, grad3)",
    ),
    mutation(
        Conformance,
        "volume, WGSL: sign of the first gradient",
        "shaders/wgsl/constraints/volume.wgsl",
        "let grad1 = -(",
        "let grad1 = (",
    ),
    mutation(
        Conformance,
        "skin tension, WGSL: fields of the parameters swapped",
        "shaders/wgsl/constraints/skin_tension.wgsl",
        "    rest_area: f32,\n    amplification: f32,",
        "    amplification: f32,\n    rest_area: f32,",
    ),
    mutation(
        Conformance,
        "skin tension, WGSL: the slope of the amplification is left out",
        "shaders/wgsl/constraints/skin_tension.wgsl",
        "1.5 * q - 0.5 / q",
        "q",
    ),
    mutation(
        Conformance,
        "skin tension, WGSL: wrong sign at the third vertex, as printed in the paper",
        "shaders/wgsl/constraints/triangle.wgsl",
        "let grad3 = cross(half_normal, e2)",
        "let grad3 = cross(e2, half_normal)",
    ),
    mutation(
        Conformance,
        "skin tension, WGSL: the half of the area is missing",
        "shaders/wgsl/constraints/triangle.wgsl",
        "Area(n_length * 0.5,",
        "Area(n_length,",
    ),
    mutation(
        Conformance,
        "skin tension, WGSL: compressed skin is amplified too",
        "shaders/wgsl/constraints/triangle.wgsl",
        "c > 0.0 && rest_area > 0.0",
        "rest_area > 0.0",
    ),
    mutation(
        Conformance,
        "paper form, WGSL: the clamp takes the larger amplification",
        "shaders/wgsl/constraints/skin_tension_paper.wgsl",
        "amplified < p.max_amplification",
        "amplified > p.max_amplification",
    ),
    mutation(
        Conformance,
        "skin strip, WGSL: the slope of the stiffening is left out",
        "shaders/wgsl/constraints/skin_strip.wgsl",
        "1.0 + (0.5 * growth) * ratio",
        "1.0",
    ),
    mutation(
        Conformance,
        "skin strip at rest, WGSL: a slack strip has the wrong sign",
        "shaders/wgsl/constraints/skin_strip_at_rest.wgsl",
        "select(e, -1.0, slack)",
        "select(e, 1.0, slack)",
    ),
    // Constraints in Rust.
    mutation(
        Conformance,
        "distance, Rust: both gradients point the same way",
        "crates/cutis-constraints/src/distance.rs",
        "[d, -d]",
        "[d, d]",
    ),
    mutation(
        Conformance,
        "volume, Rust: the 1/6 is missing",
        "crates/cutis-constraints/src/volume.rs",
        "T::constant(1.0 / 6.0)",
        "T::constant(1.0)",
    ),
    mutation(
        Conformance,
        "skin tension, Rust: another factor in the amplification",
        "crates/cutis-constraints/src/skin_tension.rs",
        "T::constant(2.0 / 3.0)",
        "T::constant(1.0)",
    ),
    mutation(
        Conformance,
        "paper form, Rust: the clamp takes the larger amplification",
        "crates/cutis-constraints/src/skin_tension_paper.rs",
        "amplified.simd_lt(most)",
        "amplified.simd_gt(most)",
    ),
    mutation(
        Conformance,
        "skin strips, Rust: sign of the third weight",
        "crates/cutis-constraints/src/strip.rs",
        "of_image * -(b1 + b2)",
        "of_image * (b1 + b2)",
    ),
    mutation(
        Conformance,
        "turn of a skin strip, Rust: the 2 below the root is missing",
        "crates/cutis-constraints/src/skin_strip_turn.rs",
        "(two * stretch * eta)",
        "(stretch * eta)",
    ),
    // Projection.
    mutation(
        Solver,
        "XPBD, WGSL: the multiplier so far is left out",
        "shaders/wgsl/solver/rule_xpbd.wgsl",
        "-c - compliance * multiplier",
        "-c",
    ),
    mutation(
        Solver,
        "XPBD, WGSL: the compliance is missing below",
        "shaders/wgsl/solver/rule_xpbd.wgsl",
        "weighted_square + compliance",
        "weighted_square",
    ),
    mutation(
        Solver,
        "XPBD, WGSL: multipliers are forgotten between iterations",
        "shaders/wgsl/solver/multiplier_next.wgsl",
        "return multipliers[k];",
        "return 0.0;",
    ),
    mutation(
        Solver,
        "projection, WGSL: corrections without the inverse mass",
        "shaders/wgsl/solver/project.wgsl",
        "(w[i] * change)",
        "change",
    ),
    mutation(
        Solver,
        "projection, WGSL: the last constraint of a chunk is skipped",
        "shaders/wgsl/solver/project.wgsl",
        "if (k >= arrayLength(&tuples))",
        "if (k + 1u >= arrayLength(&tuples))",
    ),
    mutation(
        Solver,
        "projection, WGSL: every constraint has the stiffness of the first",
        "shaders/wgsl/solver/stiffness_each.wgsl",
        "return stiffness[k];",
        "return stiffness[0];",
    ),
    mutation(
        Solver,
        "vertex block descent, WGSL: every constraint has the stiffness of the first",
        "shaders/wgsl/solver/vertex_force.wgsl",
        "let stiffness = shape[k].x;",
        "let stiffness = shape[0].x;",
    ),
    mutation(
        Solver,
        "projection, Rust, one at a time: every color has the stiffness of the first",
        "crates/cutis-solver/src/batch/project.rs",
        "stiffness.at(start + k)",
        "stiffness.at(k)",
    ),
    mutation(
        Solver,
        "projection, Rust, in lanes: every lane has the stiffness of the first",
        "crates/cutis-solver/src/batch/project.rs",
        "L::from_slice(&each[first..])",
        "L::splat(each[first])",
    ),
    mutation(
        Solver,
        "vertex block descent, Rust, in lanes: every lane has the stiffness of the first",
        "crates/cutis-solver/src/batch/vertex_force.rs",
        "values[constraint[lane]]",
        "values[constraint[0]]",
    ),
    mutation(
        Solver,
        "XPBD, Rust: sign of the multiplier so far",
        "crates/cutis-solver/src/kernel.rs",
        "-c - compliance * multiplier",
        "-c + compliance * multiplier",
    ),
    mutation(
        Problems,
        "schedule: the last color of each kind is skipped, on every backend",
        "crates/cutis-solver/src/schedule.rs",
        "0..set.colors()",
        "0..set.colors().saturating_sub(1)",
    ),
    // Passes over vertices.
    mutation(
        Solver,
        "prediction, WGSL: no gravity",
        "shaders/wgsl/solver/vertices.wgsl",
        "(velocity + settings.gravity_h)",
        "velocity",
    ),
    mutation(
        Solver,
        "prediction, WGSL: fixed vertices fall",
        "shaders/wgsl/solver/vertices.wgsl",
        "if (vertex.w > 0.0)",
        "if (vertex.w >= 0.0)",
    ),
    mutation(
        Solver,
        "finiteness, WGSL: a body that exploded goes on",
        "shaders/wgsl/solver/vertices.wgsl",
        "let finite = atomicLoad(&status.vertex) == NONE;",
        "let finite = true;",
    ),
    mutation(
        Solver,
        "handles, WGSL: the path of the first substep in all of them",
        "shaders/wgsl/solver/kinematic.wgsl",
        "paths[substep * frame.handles + owners[k]]",
        "paths[owners[k]]",
    ),
    mutation(
        Solver,
        "residual, WGSL: half of each workgroup is left out",
        "shaders/wgsl/solver/residual.wgsl",
        "var half = 32u",
        "var half = 16u",
    ),
    // The host's side of the GPU solver.
    mutation(
        Solver,
        "chunks: one constraint is lost where a color is split",
        "crates/cutis-solver-gpu/src/kind.rs",
        "end.min(first + most);",
        "end.min(first + most - 1);",
    ),
    mutation(
        Solver,
        "sweeps: a color in place of another",
        "crates/cutis-solver-gpu/src/kind.rs",
        "&self.colors[sweep.color]",
        "&self.colors[0]",
    ),
    mutation(
        Solver,
        "handles: where they are at the start of a substep, not at its end",
        "crates/cutis-solver-gpu/src/handles.rs",
        "clock.time_s(settings) + settings.substep_s()",
        "clock.time_s(settings)",
    ),
    mutation(
        Solver,
        "settings: the substep and its inverse change places",
        "crates/cutis-solver-gpu/src/body.rs",
        "numbers.h, numbers.velocity_factor,",
        "numbers.velocity_factor, numbers.h,",
    ),
    // Resampling.
    mutation(
        Resample,
        "resampling, WGSL: rounding downwards instead of to the nearest",
        "shaders/wgsl/resample/gather.wgsl",
        "floor(between(y0, y1, f.z) + 0.5)",
        "floor(between(y0, y1, f.z))",
    ),
    mutation(
        Resample,
        "resampling, WGSL: two barycentric coordinates swapped",
        "shaders/wgsl/resample/gather.wgsl",
        "ab * share.y + ac * share.z",
        "ab * share.z + ac * share.y",
    ),
    mutation(
        Resample,
        "resampling, WGSL: a tet that only comes near wins over one that holds the center",
        "shaders/wgsl/resample/claim.wgsl",
        "select(key | NEAR, key,",
        "select(key, key | NEAR,",
    ),
];
