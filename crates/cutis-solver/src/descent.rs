//! Vertex block descent: what acts on a vertex, and the step that it takes.
//!
//! An implicit step of length `h` ends where `Σ m/(2h²)|x − x̃|² + Σ C²/(2α)` is least, with `x̃ = x_n + h·v + h²·g`. The
//! vertices go there one after the other (a color of them at a time): each to where the sum, as a function of this vertex
//! alone, is least in a quadratic model. Source: Chen, Liu, Yang, Yuksel, *Vertex Block Descent*, ACM Trans. Graph. 43 (2024),
//! eq. 5–9. Different here:
//!
//! - **Curvature from `C` and `∇C` alone.** The model's matrix is `m/h² + Σ (∇C∇Cᵀ + κ·1)/α` with `κ = |∇C|²·C⁺/(C⁺ + R)`, `C⁺` the
//!   stretch and `R` the rest size. For a distance `C⁺ + R` is the length, and `κ = C/length` the true curvature across
//!   the edge; for an area likewise; a volume has none in a single vertex. What is compressed has a negative curvature, which is
//!   left out. So the matrix is positive definite whatever the shape, and bounds the true one for distances, areas and volumes. Of amplified
//!   skin, `U'' ∝ 1 + 2βC/A0` along `∇A`, it has at least three quarters: a step lowers the energy for `ω ≤ 1.5`.
//! - **The start is `x_n + h·v`, without gravity.** A body in static equilibrium then has no force left on any vertex at the
//!   start, and stays: what comes to rest is in equilibrium for any number of iterations and substeps.
//! - **There and back**: an iteration is two passes over the colors. In the first half of a substep's passes they take their turns
//!   in order, in the second half in the opposite order. Where forces are linear, with `A = M/h² + K`, what the first half leaves of an
//!   error is some `W`, and both leave `S = W*W`, with `W*` the adjoint of `W` in the product of `A`; so `(I − S)(I − A⁻¹M/h²)` has its eigenvalues between 0 and 1, and those of
//!   `x_{n+1} = Q(2x_n − x_{n−1})`, with `Q` what is left to 1, satisfy `|λ|² = q ≤ 1`: no motion grows, for any stiffness, step, `ω` and
//!   number of iterations. One way only, `Q` is not symmetric, and motions do grow. Turning round in every iteration would be as
//!   stable, but takes more of them (`cargo xtask accuracy --trials`): two passes that meet undo little that the other left.
//! - **Over-relaxation**: a step may be `ω` times as long, `0 < ω < 2`, as in successive over-relaxation.

use cutis_coloring::{ColoringError, Groups, Incidence, Tuples, greedy_vertices};
use cutis_constraints::{Real, Scalar};
use nalgebra::{Point3, Vector3};

use crate::{Formulation, Kind, Settings, SolverError, System, Vertex};

/// Force on a vertex, in N, and the matrix of its quadratic model, in N/m, summed over constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexForce<T> {
    /// `−Σ C·∇C/α`.
    pub force: Vector3<T>,
    /// The entries xx, yy, zz.
    pub diagonal: Vector3<T>,
    /// The entries xy, xz, yz.
    pub mixed: Vector3<T>,
}

impl<T: Real> VertexForce<T> {
    /// Nothing acts.
    pub fn none() -> Self {
        Self { force: Vector3::zeros(), diagonal: Vector3::zeros(), mixed: Vector3::zeros() }
    }

    /// Adds a constraint with the value `c`, the gradient `g` at this vertex, a compliance and a rest size.
    #[inline(always)]
    pub fn add(&mut self, c: T, g: &Vector3<T>, compliance: T, rest_size: T) {
        let zero = T::zero();
        let stiffness = T::one() / compliance;
        let kg = g * stiffness;
        let stretch = c.simd_max(zero);
        let size = stretch + rest_size.simd_abs();
        let share = (stretch / size).select(size.simd_gt(zero), zero);
        let curvature = stiffness * (g.dot(g) * share);
        self.force -= kg * c;
        self.diagonal += kg.component_mul(g) + Vector3::repeat(curvature);
        self.mixed += Vector3::new(kg.x * g.y, kg.x * g.z, kg.y * g.z);
    }
}

/// The numbers of a substep in the solver's own type.
#[derive(Clone, Copy, Debug)]
pub struct DescentStep<T> {
    /// Length of a substep, `h`, in s.
    pub h: T,
    /// `h²·g` in m.
    pub fall: Vector3<T>,
    /// `1/h²` in 1/s².
    pub inverse_h_squared: T,
    /// `ω`.
    pub relaxation: T,
}

impl<T: Scalar> DescentStep<T> {
    pub(crate) fn new(settings: &Settings) -> Self {
        let h = settings.substep_s();
        Self {
            h: T::constant(h),
            fall: Vector3::from(settings.gravity_m_s2.map(|g| T::constant(g * h * h))),
            inverse_h_squared: T::constant(1.0 / (h * h)),
            relaxation: T::constant(settings.relaxation),
        }
    }

    /// The vertex after its step: `x + ω·H⁻¹·f` by LDLᵀ. In exact arithmetic each pivot of `H` is at least the inertia `m/h²`, and rounding
    /// does not take it below. Where constraints are so stiff that the inertia is lost in the rounding of `H` itself, `H` counts it as
    /// `4ε·tr H`: what is left of `f` across the constraints is rounding too, and would throw the vertex. A larger `H` shortens the
    /// step; along the constraints it stays what it is.
    #[inline]
    pub(crate) fn moved(
        &self,
        vertex: Vertex<T>,
        previous: &Point3<T>,
        velocity: &Vector3<T>,
        vertex_force: &VertexForce<T>,
    ) -> Vertex<T> {
        let x = vertex.position();
        let inertia = self.inverse_h_squared / vertex.inverse_mass();
        let target = previous + velocity * self.h + self.fall;
        let f = vertex_force.force + (target - x) * inertia;
        let d = vertex_force.diagonal;
        let noise = T::constant(4.0) * T::simd_default_epsilon();
        let least = ((d.x + d.y + d.z) * noise).simd_max(inertia);
        let a = d + Vector3::repeat(least);
        let b = vertex_force.mixed;
        let l21 = b.x / a.x;
        let l31 = b.y / a.x;
        let d2 = (a.y - l21 * b.x).simd_max(least);
        let e = b.z - l21 * b.y;
        let l32 = e / d2;
        let d3 = (a.z - l31 * b.y - l32 * e).simd_max(least);
        let y2 = f.y - l21 * f.x;
        let y3 = f.z - l31 * f.x - l32 * y2;
        let z3 = y3 / d3;
        let z2 = y2 / d2 - l32 * z3;
        let z1 = f.x / a.x - l21 * z2 - l31 * z3;
        let step = Vector3::new(z1, z2, z3) * self.relaxation;
        // The product is zero for a finite number and NaN for any other.
        let finite = step.map(|s| if s * T::zero() == T::zero() { s } else { T::zero() });
        Vertex::new(x + finite, vertex.inverse_mass())
    }
}

/// What vertex block descent needs of a system beside its constraints: in which groups its vertices move, and which constraints
/// each is in.
#[derive(Clone, Debug)]
pub struct Descent<T: Scalar> {
    groups: Groups,
    incidences: Vec<Incidence>,
    step: DescentStep<T>,
}

impl<T: Scalar> Descent<T> {
    /// For `system`, with its groups of vertices, or greedy ones if it was given none.
    ///
    /// # Errors
    /// A kind with a constraint that has no compliance to divide by, or groups that do not fit.
    pub fn new(system: &System<T>, settings: &Settings) -> Result<Self, SolverError> {
        for kind in system.kinds() {
            check_compliances(kind)?;
        }
        let tuples = tuples_of(system.kinds());
        let count = system.vertices().len();
        let incidences =
            tuples.iter().map(|&kind| Incidence::new(kind, count)).collect::<Result<Vec<_>, _>>();
        let incidences = incidences.map_err(groups_error)?;
        let groups = groups_of(system, &tuples, &incidences)?;
        Ok(Self { groups, incidences, step: DescentStep::new(settings) })
    }

    /// The vertices that move, color after color: no two of a color are in one constraint.
    pub fn groups(&self) -> &Groups {
        &self.groups
    }

    /// For each kind, where its constraints name each vertex.
    pub fn incidences(&self) -> &[Incidence] {
        &self.incidences
    }

    /// The numbers of a substep.
    pub fn step(&self) -> &DescentStep<T> {
        &self.step
    }

    /// Bytes stored.
    pub fn bytes(&self) -> usize {
        let groups = size_of_val(self.groups.order.as_slice()) + size_of_val(self.groups.offsets.as_slice());
        groups + self.incidences.iter().map(Incidence::bytes).sum::<usize>()
    }
}

/// Those that the system was given, or greedy ones, without the vertices that do not move; checked.
fn groups_of<T: Scalar>(
    system: &System<T>,
    tuples: &[Tuples<'_>],
    incidences: &[Incidence],
) -> Result<Groups, SolverError> {
    let moves: Vec<bool> = system.vertices().iter().map(|v| v.inverse_mass() > T::zero()).collect();
    let groups = match &system.vertex_groups {
        Some(groups) => groups.restricted_to(&moves),
        None => greedy_vertices(tuples, incidences, &moves).map_err(groups_error)?,
    };
    groups.verify_vertices(tuples, &moves).map_err(groups_error)?;
    Ok(groups)
}

fn groups_error(error: ColoringError) -> SolverError {
    SolverError::Groups { kind: "vertices", reason: error.to_string() }
}

fn tuples_of<T: Scalar>(kinds: &[Kind<T>]) -> Vec<Tuples<'_>> {
    kinds.iter().map(|kind| Tuples { vertices: kind.indices(), arity: kind.arity() }).collect()
}

fn check_compliances<T: Scalar>(kind: &Kind<T>) -> Result<(), SolverError> {
    use crate::Values;
    let values = kind.stiffness().values();
    let bad = |value: &T| !(*value > T::zero() && (T::one() / *value).is_finite());
    let found = match values {
        Values::Uniform(value) => bad(value).then_some((None, *value)),
        Values::Each(values) => values.iter().position(bad).map(|k| (Some(k), values[k])),
    };
    match found {
        None => Ok(()),
        Some((constraint, value)) => Err(SolverError::Stiffness {
            kind: kind.name(),
            constraint,
            value: value.to_f64(),
            expected: "a compliance above 0, whose inverse the number type can hold: vertex block descent has no rigid constraints",
        }),
    }
}

/// Whether a kind with a stiffness of `found` can be solved by `asked`.
pub(crate) fn suits(found: Formulation, asked: Formulation) -> bool {
    found == asked || (found == Formulation::Xpbd && asked == Formulation::Vbd)
}
