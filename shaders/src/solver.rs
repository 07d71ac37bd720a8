//! The passes of the solver, joined for a constraint, a formulation and a storage layout.
//!
//! A constraint declares `struct Params` (scalars only) and
//! `fn eval(x: array<vec3f, N>, p: Params) -> Eval`. It may call `exact` and `exact3`, and set
//! `inverse_reach_squared`, `unit_gradients`, `along` and `along_length`. It must not declare the
//! names of a joined source: these four, `N`, `Eval`, `hidden_zero`, `exact`, `exact3`,
//! `Settings`, `is_finite`, `quotient_or_zero`, `multiplier_fraction`, `multiplier_of`,
//! `keep_multiplier`, `stiffness_of`, `vertices`, `settings`, `VertexForce`, `VertexEntries`,
//! `forces`, `shape`, `entries`, `ranges`, `tuples`, `params`, `stiffness`, `multipliers`,
//! `points`, `found`, `inverse_rest_size`, `workgroup_sums`, `sums` and the entry points.

use crate::link;

const EVAL: &str = include_str!("../wgsl/solver/eval.wgsl");
const FINITE: &str = include_str!("../wgsl/solver/finite.wgsl");
const QUOTIENT: &str = include_str!("../wgsl/solver/quotient.wgsl");
const SETTINGS: &str = include_str!("../wgsl/solver/settings.wgsl");

/// The formula that turns a value into a correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// PBD: a fraction of the error per projection.
    Pbd,
    /// XPBD: a compliance.
    Xpbd,
}

/// Storage of the stiffness, at binding 2 of group 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stiffness {
    /// One value for the kind, in a uniform buffer.
    Uniform,
    /// One value per constraint, in a storage buffer.
    Each,
}

/// Treatment of the multipliers, at binding 3 of group 1 if they are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplier {
    /// A single iteration, which stores no multipliers.
    None,
    /// The first of several iterations, which starts at zero.
    First,
    /// A later iteration.
    Next,
}

/// Constant forces on the vertices, at binding 6 of group 0 if they are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loads {
    /// No forces.
    None,
    /// One vector per vertex, in N.
    Each,
}

impl Loads {
    fn source(self) -> &'static str {
        match self {
            Self::None => include_str!("../wgsl/solver/load_none.wgsl"),
            Self::Each => include_str!("../wgsl/solver/load_each.wgsl"),
        }
    }
}

/// Name of the entry point of [`project`].
pub const PROJECT: &str = "project";
/// Name of the entry point of [`vertex_force`].
pub const VERTEX_FORCE: &str = "vertex_force";
/// Name of the entry point of [`descend`].
pub const DESCEND: &str = "descend";
/// Name of the entry point of [`residual`].
pub const RESIDUAL: &str = "residual";
/// Name of the entry point of [`evaluate`].
pub const EVALUATE: &str = "evaluate";
/// Name of the entry point of [`kinematic`].
pub const KINEMATIC: &str = "kinematic";
/// Name of the entry point of [`gather`].
pub const GATHER: &str = "gather";

/// Returns the declarations that a constraint over `arity` vertices needs.
fn head(arity: usize) -> String {
    format!("const N: u32 = {arity}u;\n{EVAL}")
}

/// Returns the source that projects one chunk of a color.
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

/// Returns the source that computes the forces of a kind on the vertices of a chunk.
pub fn vertex_force(arity: usize, constraint: &str) -> String {
    link(&[&head(arity), constraint, include_str!("../wgsl/solver/vertex_force.wgsl")])
}

/// Returns the source that moves the vertices of a chunk of one color.
pub fn descend(loads: Loads) -> String {
    link(&[FINITE, loads.source(), include_str!("../wgsl/solver/descend.wgsl")])
}

/// Returns the source that computes, per workgroup, the sum of squares and the largest value over
/// the rest size.
pub fn residual(arity: usize, constraint: &str) -> String {
    link(&[&head(arity), constraint, include_str!("../wgsl/solver/residual.wgsl")])
}

/// Returns the source that computes values and gradients, for tests.
pub fn evaluate(arity: usize, constraint: &str) -> String {
    link(&[&head(arity), constraint, include_str!("../wgsl/solver/evaluate.wgsl")])
}

/// Returns the source of the passes over vertices, with the entry points `predict`, `predict_next`,
/// `finish_and_predict`, `finish`, `check`, `restore`.
pub fn vertices(loads: Loads) -> String {
    link(&[SETTINGS, FINITE, loads.source(), include_str!("../wgsl/solver/vertices.wgsl")])
}

/// Returns the source that moves kinematic vertices along their paths.
pub fn kinematic() -> String {
    include_str!("../wgsl/solver/kinematic.wgsl").to_owned()
}

/// Returns the source that collects the positions of some vertices.
pub fn gather() -> String {
    include_str!("../wgsl/solver/gather.wgsl").to_owned()
}
