//! Vertex block descent: the forces on a vertex and the step that it takes.
//!
//! An implicit time step of length `h` ends at the minimum of
//! `Σ m/(2h²)|x − x̃|² + Σ C²/(2α)`, with `x̃ = x_n + h·v + h²·g`. Vertex block descent moves one
//! vertex after the other (one color of them at a time). Each vertex goes to the minimum of a
//! quadratic model of this sum as a function of its own position. Source: Chen, Liu, Yang, Yuksel,
//! *Vertex Block Descent*, ACM Trans. Graph. 43 (2024), eq. 5–9. This implementation differs in
//! four points:
//!
//! - **Curvature from `C` and `∇C` alone.** The model's matrix is
//!   `m/h² + Σ (∇C∇Cᵀ + κ·1)/α` with `κ = |∇C|²·C⁺/(C⁺ + R)`, where `C⁺ = max(C, 0)` and `R` is the
//!   rest size. For a distance, `C⁺ + R` is the length, and `κ = C/length` is the true curvature
//!   across the edge. The same holds for an area. A volume has no curvature in a single vertex. A
//!   compressed constraint has negative curvature, which the model omits. So the matrix is positive
//!   definite for every shape, and it bounds the true matrix for distances, areas and volumes. For
//!   amplified skin, where `U'' ∝ 1 + 2βC/A0` along `∇A`, the model has at least three quarters of
//!   the true curvature, so that a step lowers the energy for `ω ≤ 1.5`.
//! - **The start is `x_n + h·v`, without gravity.** At the start of a step, a body in static
//!   equilibrium has no net force on any vertex and does not move. So a body at rest is in
//!   equilibrium for any number of iterations and substeps.
//! - **Symmetric sweep.** An iteration is two passes over the colors. The first half of a substep's
//!   passes visits the colors in ascending order, and the second half in descending order. For
//!   linear forces with `A = M/h² + K`, let `W` be the operator that the first half applies to an
//!   error. Both halves together apply `S = W*W`, where `W*` is the adjoint of `W` in the inner
//!   product of `A`. So the eigenvalues of `(I − S)(I − A⁻¹M/h²)` are between 0 and 1. Let
//!   `Q = I − (I − S)(I − A⁻¹M/h²)`. The eigenvalues `λ` of `x_{n+1} = Q(2x_n − x_{n−1})` satisfy
//!   `|λ|² = q ≤ 1` for an eigenvalue `q` of `Q`. So no motion grows, for any stiffness, step
//!   length, `ω` and number of iterations. With ascending passes only, `Q` is not symmetric, and
//!   motions do grow. A change of direction in every iteration is equally stable but needs more
//!   iterations, because two successive passes in opposite directions repeat much of the same work.
//! - **Over-relaxation.** A step may be `ω` times as long, `0 < ω < 2`, as in successive
//!   over-relaxation.

use cutis_coloring::{ColoringError, Groups, Incidence, Tuples, greedy_vertices};
use cutis_constraints::{Lanes, Real, Scalar};
use nalgebra::{Point3, Vector3};

use crate::teams::Teams;
use crate::{Formulation, Kind, Settings, SolverError, System, Vertex};

/// Force on a vertex in N and the matrix of its quadratic model in N/m, summed over constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexForce<T> {
    /// The force `−Σ C·∇C/α`.
    pub force: Vector3<T>,
    /// Matrix entries xx, yy, zz.
    pub diagonal: Vector3<T>,
    /// Matrix entries xy, xz, yz.
    pub mixed: Vector3<T>,
}

impl<T: Real> VertexForce<T> {
    /// Returns zero force and a zero matrix.
    pub fn none() -> Self {
        Self { force: Vector3::zeros(), diagonal: Vector3::zeros(), mixed: Vector3::zeros() }
    }

    /// Adds a constraint with the value `c`, the gradient `g` at this vertex, a compliance and a
    /// rest size.
    #[inline(always)]
    pub fn add(&mut self, c: T, g: &Vector3<T>, compliance: T, rest_size: T) {
        self.add_stiff(c, g, T::one() / compliance, rest_size);
    }

    /// Adds a constraint with a stiffness of 1 / compliance.
    #[inline(always)]
    pub(crate) fn add_stiff(&mut self, c: T, g: &Vector3<T>, stiffness: T, rest_size: T) {
        let zero = T::zero();
        let stiff_gradient = g * stiffness;
        let stretch = c.simd_max(zero);
        let size = stretch + rest_size.simd_abs();
        let fraction = (stretch / size).select(size.simd_gt(zero), zero);
        let curvature = stiffness * (g.dot(g) * fraction);
        self.force -= stiff_gradient * c;
        self.diagonal += stiff_gradient.component_mul(g) + Vector3::repeat(curvature);
        let [x, y] = [stiff_gradient.x, stiff_gradient.y];
        self.mixed += Vector3::new(x * g.y, x * g.z, y * g.z);
    }
}

/// Constants of a substep in the solver's number type.
#[derive(Clone, Copy, Debug)]
pub struct DescentStep<T> {
    /// Length `h` of a substep in s.
    pub h: T,
    /// Gravity times `h²`, in m.
    pub gravity_h_squared: Vector3<T>,
    /// `1/h²` in 1/s².
    pub inverse_h_squared: T,
    /// Over-relaxation `ω`.
    pub relaxation: T,
}

impl<T: Scalar> DescentStep<T> {
    pub(crate) fn new(settings: &Settings) -> Self {
        let h = settings.substep_s();
        Self {
            h: T::constant(h),
            gravity_h_squared: Vector3::from(settings.gravity_m_s2.map(|g| T::constant(g * h * h))),
            inverse_h_squared: T::constant(1.0 / (h * h)),
            relaxation: T::constant(settings.relaxation),
        }
    }

    /// Returns the vertex after its step.
    #[inline]
    pub(crate) fn moved(
        &self,
        vertex: Vertex<T>,
        previous: &Point3<T>,
        velocity: &Vector3<T>,
        force: &VertexForce<T>,
        load: Vector3<T>,
    ) -> Vertex<T> {
        let (x, inverse_mass) = (vertex.position(), vertex.inverse_mass());
        Vertex::new(self.step(x, inverse_mass, previous, velocity, force, load), inverse_mass)
    }

    /// The constants in all lanes.
    #[inline(always)]
    pub(crate) fn splat<L: Lanes<T>>(&self) -> DescentStep<L> {
        let [x, y, z] = self.gravity_h_squared.into();
        DescentStep {
            h: L::splat(self.h),
            gravity_h_squared: Vector3::new(L::splat(x), L::splat(y), L::splat(z)),
            inverse_h_squared: L::splat(self.inverse_h_squared),
            relaxation: L::splat(self.relaxation),
        }
    }
}

impl<R: Real> DescentStep<R> {
    /// Returns the position after a step, `x + ω·H⁻¹·f` by LDLᵀ.
    ///
    /// In exact arithmetic each pivot of `H` is at least the inertia `m/h²`. The code keeps this
    /// bound under rounding. If constraints are so stiff that the inertia is lost in the rounding
    /// of `H`, the code uses `4ε·tr H` in its place. In this case the components of `f` across the
    /// constraints consist of rounding errors and would move the vertex far away. A larger `H`
    /// shortens the step across the constraints and leaves the step along them unchanged.
    #[inline(always)]
    pub(crate) fn step(
        &self,
        x: Point3<R>,
        inverse_mass: R,
        previous: &Point3<R>,
        velocity: &Vector3<R>,
        force: &VertexForce<R>,
        load: Vector3<R>,
    ) -> Point3<R> {
        let inertia = self.inverse_h_squared / inverse_mass;
        let target = previous + velocity * self.h + self.gravity_h_squared;
        let f = (force.force + load) + (target - x) * inertia;
        let d = force.diagonal;
        let noise = R::constant(4.0) * R::simd_default_epsilon();
        let least = ((d.x + d.y + d.z) * noise).simd_max(inertia);
        let a = d + Vector3::repeat(least);
        let b = force.mixed;
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
        // The product is zero for a finite number and NaN for any other.
        let finite = |s: R| s.select((s * R::zero()).simd_eq(R::zero()), R::zero());
        let step = Vector3::new(z1, z2, z3) * self.relaxation;
        x + Vector3::new(finite(step.x), finite(step.y), finite(step.z))
    }
}

/// Refuses a gravity with which a vertex falls so far in a substep that lengths overflow. Steps
/// that are not finite are left out, so the body would stand still.
fn check_gravity<T: Scalar>(settings: &Settings) -> Result<(), SolverError> {
    let h = settings.substep_s();
    let overflows = |g: &f64| {
        let fall = T::constant(g * h * h);
        !(fall * fall).is_finite()
    };
    let expected = "a gravity whose fall in a substep has a finite square in the number type";
    match settings.gravity_m_s2.into_iter().find(overflows) {
        Some(value) => Err(SolverError::Setting { key: "gravity_m_s2", value, expected }),
        None => Ok(()),
    }
}

/// Data for vertex block descent: the color groups of the vertices and the constraints at each
/// vertex.
#[derive(Clone, Debug)]
pub struct Descent<T: Scalar> {
    groups: Groups,
    incidences: Vec<Incidence>,
    teams: Teams<T>,
    step: DescentStep<T>,
}

impl<T: Scalar> Descent<T> {
    /// Prepares vertex block descent for `system`, with the system's vertex groups if it has any,
    /// else with greedy ones.
    ///
    /// # Errors
    /// Returns [`SolverError::Setting`] for a gravity that is too large for the number type,
    /// [`SolverError::Formulation`] for a PBD stiffness, [`SolverError::Stiffness`] for a
    /// compliance of zero, and [`SolverError::Groups`] if two vertices of a group share a
    /// constraint.
    pub fn new(system: &System<T>, settings: &Settings) -> Result<Self, SolverError> {
        Self::check(system, settings)?;
        let incidences = Self::incidences_of(system)?;
        let groups = groups_of(system, &tuples_of(system.kinds()), &incidences)?;
        Ok(Self { groups, incidences, teams: Teams::default(), step: DescentStep::new(settings) })
    }

    /// Checks that vertex block descent can solve `system`.
    ///
    /// # Errors
    /// The errors of [`Descent::new`], except those of the groups.
    pub fn check(system: &System<T>, settings: &Settings) -> Result<(), SolverError> {
        check_gravity::<T>(settings)?;
        system.kinds().iter().try_for_each(check_compliances)
    }

    /// Returns the constraints at each vertex, for each kind.
    pub(crate) fn incidences_of(system: &System<T>) -> Result<Vec<Incidence>, SolverError> {
        let count = system.vertices().len();
        let tuples = tuples_of(system.kinds());
        let incidences = tuples.iter().map(|&kind| Incidence::new(kind, count)).collect::<Result<_, _>>();
        incidences.map_err(groups_error)
    }

    /// Replaces the constraints at each vertex of one kind. The groups must be set afterwards.
    /// Vertices that have or had a constraint are no longer in teams.
    pub(crate) fn set_incidence(&mut self, kind: usize, incidence: Incidence) {
        for incidence in [&self.incidences[kind], &incidence] {
            let vertices = (0..incidence.starts().len() as u32 - 1).filter(|&v| !incidence.of(v).is_empty());
            self.teams.dissolve(vertices);
        }
        self.incidences[kind] = incidence;
    }

    /// Finds vertices of one color whose constraints have the same form, which are moved together
    /// with SIMD lanes, and copies the parameters of these constraints. Results do not change.
    pub fn find_teams(&mut self, system: &System<T>) {
        let vertices = system.vertices().len();
        self.teams = Teams::find(vertices, &self.groups, system.kinds(), &self.incidences);
    }

    /// Returns the teams of vertices.
    pub(crate) fn teams(&self) -> &Teams<T> {
        &self.teams
    }

    /// Replaces the groups by verified ones.
    pub(crate) fn set_groups(&mut self, groups: Groups) {
        self.teams.regroup(&groups);
        self.groups = groups;
    }

    /// Colors the vertices again.
    pub(crate) fn color_again(&mut self, system: &System<T>) -> Result<(), SolverError> {
        self.set_groups(groups_of(system, &tuples_of(system.kinds()), &self.incidences)?);
        Ok(())
    }

    /// Returns the moving vertices by color. Two vertices of one color never share a constraint.
    pub fn groups(&self) -> &Groups {
        &self.groups
    }

    /// Returns, for each kind, the constraints at each vertex.
    pub fn incidences(&self) -> &[Incidence] {
        &self.incidences
    }

    /// Returns the constants of a substep.
    pub fn step(&self) -> &DescentStep<T> {
        &self.step
    }

    /// Returns the memory of the groups and incidences in bytes.
    pub fn bytes(&self) -> usize {
        let groups = size_of_val(self.groups.order.as_slice()) + size_of_val(self.groups.offsets.as_slice());
        groups + self.incidences.iter().map(Incidence::bytes).sum::<usize>()
    }

    /// Returns the memory of the teams in bytes, 0 if there are none.
    pub fn team_bytes(&self) -> usize {
        self.teams.bytes()
    }
}

/// Returns the verified vertex groups of the system, or greedy ones, without the vertices that do
/// not move.
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

pub(crate) fn groups_error(error: ColoringError) -> SolverError {
    SolverError::Groups { kind: "vertices", reason: error.to_string() }
}

fn tuples_of<T: Scalar>(kinds: &[Kind<T>]) -> Vec<Tuples<'_>> {
    kinds.iter().map(|kind| Tuples { vertices: kind.indices(), arity: kind.arity() }).collect()
}

pub(crate) fn check_compliances<T: Scalar>(kind: &Kind<T>) -> Result<(), SolverError> {
    use crate::Values;
    let (found, expected) = (kind.stiffness().formulation(), Formulation::Vbd);
    if !accepts(found, expected) {
        return Err(SolverError::Formulation { kind: kind.name(), found, expected });
    }
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
            expected: "a compliance above 0 with a finite inverse, since vertex block descent has no rigid constraints",
        }),
    }
}

/// True if a kind with a stiffness for `found` can be solved with the formulation `expected`.
pub(crate) fn accepts(found: Formulation, expected: Formulation) -> bool {
    found == expected || (found == Formulation::Xpbd && expected == Formulation::Vbd)
}
