//! The passes of the solver: joined for a constraint, a formulation and a way of storing.
//!
//! A constraint brings `struct Params` (scalars only) and `fn eval(x: array<vec3f, N>, p: Params) -> Eval`. What a joined
//! source declares beside it, and a constraint therefore may not: `N`, `Eval`, `hidden_zero`, `inverse_reach_squared` (which it may
//! set), `exact` and `exact3` (both of which it may call), `Settings`, `is_finite`,
//! `quotient_or_zero`, `multiplier_change`, `multiplier_of`, `keep_multiplier`, `stiffness_of`, `vertices`, `settings`,
//! `VertexForce`, `Share`, `forces`, `shape`, `places`, `shares`, `tuples`, `params`, `stiffness`, `multipliers`, `points`, `found`, `inverse_rest_size`, `partial`, `sums` and the
//! entry points.

use crate::link;

const EVAL: &str = include_str!("../wgsl/solver/eval.wgsl");
const FINITE: &str = include_str!("../wgsl/solver/finite.wgsl");
const QUOTIENT: &str = include_str!("../wgsl/solver/quotient.wgsl");
const SETTINGS: &str = include_str!("../wgsl/solver/settings.wgsl");

/// How a value becomes a correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// A share of the error per projection.
    Pbd,
    /// A compliance.
    Xpbd,
}

/// Where the stiffness of a constraint lies: binding 2 of group 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stiffness {
    /// One number for the kind, a uniform.
    Uniform,
    /// A number for each constraint, a storage buffer.
    Each,
}

/// What becomes of the multipliers: binding 3 of group 1, where there are any.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplier {
    /// There is one iteration: none are kept.
    None,
    /// The first of several iterations: they begin at zero.
    First,
    /// A later iteration.
    Next,
}

/// The name of the entry point of [`project`].
pub const PROJECT: &str = "project";
/// The name of the entry point of [`vertex_force`].
pub const VERTEX_FORCE: &str = "vertex_force";
/// The name of the entry point of [`descend`].
pub const DESCEND: &str = "descend";
/// The name of the entry point of [`residual`].
pub const RESIDUAL: &str = "residual";
/// The name of the entry point of [`evaluate`].
pub const EVALUATE: &str = "evaluate";
/// The name of the entry point of [`kinematic`].
pub const KINEMATIC: &str = "kinematic";
/// The name of the entry point of [`gather`].
pub const GATHER: &str = "gather";

/// What a constraint over `arity` vertices stands below.
fn head(arity: usize) -> String {
    format!("const N: u32 = {arity}u;\n{EVAL}")
}

/// Projection of one chunk of a color.
pub fn project(
    arity: usize,
    constraint: &str,
    rule: Rule,
    stiffness: Stiffness,
    multiplier: Multiplier,
) -> String {
    let rule = match rule {
        Rule::Pbd => include_str!("../wgsl/solver/rule_pbd.wgsl"),
        Rule::Xpbd => include_str!("../wgsl/solver/rule_xpbd.wgsl"),
    };
    let stiffness = match stiffness {
        Stiffness::Uniform => include_str!("../wgsl/solver/stiffness_uniform.wgsl"),
        Stiffness::Each => include_str!("../wgsl/solver/stiffness_each.wgsl"),
    };
    let multiplier = match multiplier {
        Multiplier::None => include_str!("../wgsl/solver/multiplier_none.wgsl"),
        Multiplier::First => include_str!("../wgsl/solver/multiplier_first.wgsl"),
        Multiplier::Next => include_str!("../wgsl/solver/multiplier_next.wgsl"),
    };
    let project = include_str!("../wgsl/solver/project.wgsl");
    link(&[&head(arity), constraint, SETTINGS, FINITE, QUOTIENT, rule, stiffness, multiplier, project])
}

/// What the constraints of a kind do to the vertices of a chunk.
pub fn vertex_force(arity: usize, constraint: &str) -> String {
    link(&[&head(arity), constraint, include_str!("../wgsl/solver/vertex_force.wgsl")])
}

/// The steps of the vertices of a chunk of one color.
pub fn descend() -> String {
    link(&[FINITE, include_str!("../wgsl/solver/descend.wgsl")])
}

/// Sum of squares and largest value over rest size, per workgroup.
pub fn residual(arity: usize, constraint: &str) -> String {
    link(&[&head(arity), constraint, include_str!("../wgsl/solver/residual.wgsl")])
}

/// Value and gradients on their own.
pub fn evaluate(arity: usize, constraint: &str) -> String {
    link(&[&head(arity), constraint, include_str!("../wgsl/solver/evaluate.wgsl")])
}

/// The passes over vertices: `predict`, `predict_next`, `finish_and_predict`, `finish`, `check`, `restore`.
pub fn vertices() -> String {
    link(&[SETTINGS, FINITE, include_str!("../wgsl/solver/vertices.wgsl")])
}

/// Kinematic vertices along their paths.
pub fn kinematic() -> String {
    include_str!("../wgsl/solver/kinematic.wgsl").to_owned()
}

/// Positions of chosen vertices, side by side.
pub fn gather() -> String {
    include_str!("../wgsl/solver/gather.wgsl").to_owned()
}
