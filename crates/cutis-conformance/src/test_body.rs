//! Bodies made of the samples, to run them through solvers.

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Constraint, Params, Scalar};
use cutis_solver::{
    Formulation, Settings, Solver, SolverError, SolverReference, Stiffness, System, SystemBuilder, Values,
};
use nalgebra::Point3;

use crate::alteration::{Altered, WrongGradient, WrongValue};
use crate::measure::{Deviation, excess, tolerance};
use crate::random::Random;
use crate::{Case, ConformanceError, Report};

/// Duration of a frame in s.
const DT: f64 = 1.0 / 60.0;
/// Damping rate times substep. Without damping, an element that swings through itself would amplify
/// the smallest difference.
const DAMPING: f64 = 2.0;

/// The solver settings of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    pub(crate) name: &'static str,
    formulation: Formulation,
    substeps: u32,
    iterations: u32,
}

impl Plan {
    /// One projection, and several with multipliers or velocities between them.
    const ALL: [Self; 5] = [
        Self { name: "one PBD projection", formulation: Formulation::Pbd, substeps: 1, iterations: 1 },
        Self { name: "PBD", formulation: Formulation::Pbd, substeps: 3, iterations: 2 },
        Self { name: "one XPBD projection", formulation: Formulation::Xpbd, substeps: 1, iterations: 1 },
        Self { name: "XPBD with multipliers", formulation: Formulation::Xpbd, substeps: 3, iterations: 2 },
        Self { name: "vertex block descent", formulation: Formulation::Vbd, substeps: 3, iterations: 2 },
    ];

    /// Returns the plans that a constraint can run with.
    pub(crate) fn of(pbd_only: bool) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |plan| !pbd_only || plan.formulation == Formulation::Pbd)
    }

    pub(crate) fn settings(&self) -> Settings {
        let Self { formulation, substeps, iterations, .. } = *self;
        let damping_per_s = DAMPING * f64::from(substeps) / DT;
        Settings { formulation, dt_s: DT, substeps, iterations, damping_per_s, ..Settings::default() }
    }
}

/// Constraints over vertices. `f32` represents all numbers exactly.
pub(crate) struct TestBody<const N: usize> {
    pub(crate) name: String,
    pub(crate) scale: f64,
    positions: Vec<Point3<f64>>,
    inverse_masses: Vec<f64>,
    tuples: Vec<[u32; N]>,
    params: Vec<Vec<f64>>,
    groups: Groups,
    /// Whether each constraint has its own stiffness.
    each: bool,
}

impl<const N: usize> TestBody<N> {
    /// Returns the samples of one scale without common vertices: one color, which is larger than a
    /// workgroup.
    pub(crate) fn soup(cases: &[Case<N>], scale: f64) -> Result<Self, ConformanceError> {
        let name = format!("separate elements at {scale} m");
        Self::new(name, cases, scale, |_, x| x, |k, i| k * N + i, true)
    }

    /// Returns the samples of one scale, each joined to the previous one by a vertex: two colors.
    pub(crate) fn chain(cases: &[Case<N>], scale: f64) -> Result<Self, ConformanceError> {
        let mut end = Point3::origin();
        let place = move |k: usize, x: [Point3<f64>; N]| {
            let moved = if k == 0 { x } else { x.map(|p| p - x[0].coords + end.coords) };
            let moved = moved.map(|p| p.map(|v| f64::from(v as f32)));
            end = moved[N - 1];
            moved
        };
        Self::new(format!("a chain at {scale} m"), cases, scale, place, |k, i| k * (N - 1) + i, false)
    }

    fn new(
        name: String,
        cases: &[Case<N>],
        scale: f64,
        mut place: impl FnMut(usize, [Point3<f64>; N]) -> [Point3<f64>; N],
        vertex: impl Fn(usize, usize) -> usize,
        each: bool,
    ) -> Result<Self, ConformanceError> {
        let (mut positions, mut tuples, mut params) = (Vec::new(), Vec::new(), Vec::new());
        for (k, case) in cases.iter().filter(|case| case.scale == scale).enumerate() {
            let x = place(k, case.x);
            for i in 0..N {
                if vertex(k, i) == positions.len() {
                    positions.push(x[i]);
                }
            }
            tuples.push(std::array::from_fn(|i| vertex(k, i) as u32));
            params.push(case.params.clone());
        }
        let mut random = Random::new(4);
        let inverse_mass = |vertex: usize| {
            let value = random.between(0.5, 2.0);
            if vertex % 7 == 6 { 0.0 } else { f64::from(value as f32) }
        };
        let inverse_masses = (0..positions.len()).map(inverse_mass).collect();
        let groups = greedy(&tuples, positions.len())?;
        Ok(Self { name, scale, positions, inverse_masses, tuples, params, groups, each })
    }

    /// Returns the body with constraints of type `C`, whose stiffness is of the order of the
    /// vertices' inertia.
    pub(crate) fn system<C: Constraint<N>, T: Scalar>(&self, plan: Plan) -> Result<System<T>, SolverError> {
        let params: Vec<C::Params<T>> =
            self.params.iter().map(|p| Params::from_fn(|k| T::constant(p[k]))).collect();
        let single = |values: Vec<f64>| -> Values<T> {
            let mut values = values.into_iter().map(|value| T::constant(f64::from(value as f32)));
            if self.each {
                Values::Each(values.collect())
            } else {
                Values::Uniform(values.next().unwrap_or(T::one()))
            }
        };
        let mut random = Random::new(5);
        let stiffness = match plan.formulation {
            Formulation::Pbd => {
                Stiffness::Pbd(single(self.tuples.iter().map(|_| random.between(0.2, 1.0)).collect()))
            }
            Formulation::Xpbd | Formulation::Vbd => {
                let h = plan.settings().substep_s();
                // A collapsed element would be rigid, which vertex block descent does not support.
                let descends = plan.formulation == Formulation::Vbd;
                let compliance = |k: usize| {
                    let square = self.weighted_square::<C>(k);
                    random.between(0.1, 2.0) * h * h * if descends && square == 0.0 { 1.0 } else { square }
                };
                Stiffness::Compliance(single((0..self.tuples.len()).map(compliance).collect()))
            }
        };
        let builder = SystemBuilder::<T>::new(&self.positions, &self.inverse_masses)?;
        Ok(builder.add::<C, N>(&self.tuples, &params, stiffness, &self.groups)?.build())
    }

    /// Returns `Σ w|∇C|²` of constraint `k`, with masses of 1 kg.
    fn weighted_square<C: Constraint<N>>(&self, k: usize) -> f64 {
        let x = self.tuples[k].map(|vertex| self.positions[vertex as usize]);
        let case = Case { scale: self.scale, x, params: self.params[k].clone() };
        case.eval::<C, f64>().grad.iter().map(|g| g.norm_squared()).sum()
    }

    /// Returns the positions after one frame of the reference solver.
    pub(crate) fn reference<C: Constraint<N>, T: Scalar>(
        &self,
        plan: Plan,
    ) -> Result<Vec<Point3<f64>>, SolverError> {
        let system = self.system::<C, T>(plan)?;
        after_a_frame(&mut SolverReference::new(system, plan.settings())?)
    }

    /// Returns the distances between the vertices of two runs, relative to the scale.
    pub(crate) fn deviation(&self, a: &[Point3<f64>], b: &[Point3<f64>]) -> Deviation {
        Deviation::of(a.iter().zip(b).map(|(a, b)| (a - b).norm() / self.scale))
    }

    /// Returns the allowed deviation from `exact` where the CPU in `f32` ends at `single`. The
    /// smallest assumed error is an ulp of the largest coordinate.
    pub(crate) fn tolerance(&self, single: &[Point3<f64>], exact: &[Point3<f64>]) -> Deviation {
        let coordinates = self.positions.iter().flat_map(|p| p.coords.iter());
        let extent = coordinates.fold(0.0, |most, x| f64::max(most, x.abs())) / self.scale;
        tolerance(self.deviation(single, exact), f64::from(f32::EPSILON) * extent)
    }

    /// Adds negative controls: `found` must differ from the result of a constraint whose value or
    /// gradient is off by 1e-3.
    pub(crate) fn controls<C: Constraint<N>>(
        &self,
        report: &mut Report,
        plan: Plan,
        found: &[Point3<f64>],
        tolerance: Deviation,
    ) -> Result<(), SolverError> {
        for (wrong, result) in [
            ("value", self.reference::<Altered<C, WrongValue>, f64>(plan)?),
            ("gradient", self.reference::<Altered<C, WrongGradient>, f64>(plan)?),
        ] {
            let seen = excess(self.deviation(found, &result), tolerance);
            report.control(format!("{}, {}: {wrong} off by 1e-3", plan.name, self.name), seen, 1.0);
        }
        Ok(())
    }
}

/// Returns the positions after one frame.
pub(crate) fn after_a_frame<T: Scalar>(solver: &mut dyn Solver<T>) -> Result<Vec<Point3<f64>>, SolverError> {
    solver.step(1)?;
    Ok(solver.positions()?.iter().map(|p| p.map(T::to_f64)).collect())
}

/// Returns the number of coordinates that differ between two runs.
pub(crate) fn differing(a: &[Point3<f64>], b: &[Point3<f64>]) -> usize {
    let coordinates = |x: &[Point3<f64>]| x.iter().flat_map(|p| [p.x, p.y, p.z]).collect::<Vec<_>>();
    coordinates(a).iter().zip(coordinates(b)).filter(|&(a, b)| *a != b).count()
        + 3 * a.len().abs_diff(b.len())
}
