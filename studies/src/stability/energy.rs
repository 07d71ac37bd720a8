//! The energy of a body, and its upper bound.
//!
//! A constraint that is too stiff for the substep acts as if it removed its error within one
//! substep. Its compliance counts as at least `h²·Σ w|∇C|²` at the rest shape. PBD and a compliance
//! of 0 therefore have a finite energy: the kinetic energy of removing the error in one substep.
//! Vertex block descent steps implicitly, so there a compliance counts as it is. All sums are in
//! `f64`, by [`evaluate`](cutis_solver::ConstraintSet::evaluate), from the stored parameters.
//!
//! A load that keeps a body at rest has a potential. The body then has no energy in its rest shape,
//! and more in any other.
//!
//! Every projection rounds positions. An error of half a unit in the last place of a position
//! changes the velocity by this error divided by the substep. These errors are a random walk that
//! heats a body, and more so with shorter substeps. The energy that rounding can add counts as
//! available, and its share is reported.

use cutis_constraints::Scalar;
use cutis_solver::{Formulation, Settings, Stiffness, System};
use nalgebra::{Point3, Rotation3, Vector3};

use crate::kit::larger;

/// Largest total energy over the available energy if a substep resolves the stiffness. The energy
/// then does not grow.
pub const RESOLVED: f64 = 1.05;
/// The same if a substep does not resolve the stiffness. The constraints of a vertex then move it
/// one after the other within a substep. If they agree in direction, the kinetic energy is the
/// square of a sum, and the budget is the sum of squares.
pub const UNRESOLVED: f64 = 10.0;

/// Relative rounding error of a rest size, in units of the machine epsilon of the number type.
const ROUNDING: f64 = 64.0;
/// Angle in rad by which a rest shape is turned where a constraint has no gradient at rest.
const TURN: f64 = 0.01;

/// Kinetic and elastic energy, and the potential of gravity, in J.
#[derive(Clone, Copy, Debug)]
pub struct Energy {
    /// `Σ ½m|v|²`.
    pub kinetic: f64,
    /// `Σ ½C²/α`, with the effective compliance, and the potential of the loads.
    pub elastic: f64,
    /// `−Σ m g·x`.
    pub gravity: f64,
}

/// Measures the energy of one body.
pub struct Meter {
    gravity: Vector3<f64>,
    /// Effective compliance of each constraint of each kind. Infinite for a constraint without
    /// effect.
    compliances: Vec<Vec<f64>>,
    /// The rest shape in m.
    rest: Vec<Point3<f64>>,
    /// Elastic energy of the rest shape of a body with loads, in J. Zero without loads.
    at_rest: f64,
    /// Energy that rounding of positions may add in one substep, in J.
    pub heat: f64,
    /// Energy that rounding of the rest shape may add, in J.
    pub rounding: f64,
}

impl Meter {
    /// The meter of `system`, with its rest positions in meters.
    pub fn new<T: Scalar>(system: &System<T>, rest: &[Point3<f64>], settings: &Settings) -> Self {
        let h = settings.substep_s();
        let strain = ROUNDING * T::default_epsilon().to_f64();
        let mut rounding = 0.0;
        let mut compliances = Vec::new();
        // The turn of a strip has no gradient at rest, and the same one at every other angle.
        let turn = Rotation3::from_euler_angles(TURN, TURN, TURN);
        for set in system.kinds() {
            let mut of_kind = Vec::with_capacity(set.len());
            for (k, tuple) in set.indices().chunks_exact(set.arity()).enumerate() {
                let mut grad = vec![Vector3::zeros(); tuple.len()];
                let inverse_mass = |v: u32| system.vertices()[v as usize].inverse_mass().to_f64();
                let mut weighted = |shape: &dyn Fn(Point3<f64>) -> Point3<f64>| -> f64 {
                    let x: Vec<Point3<f64>> = tuple.iter().map(|&v| shape(rest[v as usize])).collect();
                    set.evaluate(k, &x, &mut grad);
                    tuple.iter().zip(&grad).map(|(&v, grad)| inverse_mass(v) * grad.norm_squared()).sum()
                };
                let weighted = match weighted(&|x| x) {
                    0.0 => weighted(&|x| turn * x),
                    weighted => weighted,
                };
                let resolved = h * h * weighted;
                let compliance = match set.stiffness() {
                    _ if weighted == 0.0 => f64::INFINITY,
                    Stiffness::Pbd(share) => resolved / share.at(k).to_f64(),
                    Stiffness::Compliance(compliance) if settings.formulation == Formulation::Vbd => {
                        compliance.at(k).to_f64()
                    }
                    Stiffness::Compliance(compliance) => compliance.at(k).to_f64().max(resolved),
                };
                rounding += 0.5 * (strain * set.rest_size(k).to_f64()).powi(2) / compliance;
                of_kind.push(compliance);
            }
            compliances.push(of_kind);
        }
        let heat = heat(system, settings);
        let gravity = Vector3::from(settings.gravity_m_s2);
        let mut meter = Self { gravity, compliances, rest: rest.to_vec(), at_rest: 0.0, heat, rounding };
        if !system.loads().is_empty() {
            meter.at_rest = meter.elastic(system, rest);
        }
        meter
    }

    /// Elastic energy and potential of the loads with every vertex at `x`. A body with loads has
    /// none in its rest shape.
    pub fn elastic<T: Scalar>(&self, system: &System<T>, x: &[Point3<f64>]) -> f64 {
        let mut sum = -self.at_rest - self.work_of_loads(system, x);
        for (set, compliances) in system.kinds().iter().zip(&self.compliances) {
            let mut grad = vec![Vector3::zeros(); set.arity()];
            for (k, tuple) in set.indices().chunks_exact(set.arity()).enumerate() {
                let corners: Vec<Point3<f64>> = tuple.iter().map(|&v| x[v as usize]).collect();
                let c = set.evaluate(k, &corners, &mut grad);
                sum += 0.5 * c * c / compliances[k];
            }
        }
        sum
    }

    /// Work of the loads from the rest shape to `x`, without the mean motion. The sum of the loads
    /// is zero but for rounding.
    fn work_of_loads<T: Scalar>(&self, system: &System<T>, x: &[Point3<f64>]) -> f64 {
        let moved = || x.iter().zip(&self.rest).map(|(x, rest)| x - rest);
        let mean = moved().sum::<Vector3<f64>>() / x.len() as f64;
        system.loads().iter().zip(moved()).map(|(load, moved)| load.map(T::to_f64).dot(&(moved - mean))).sum()
    }

    /// The largest value over rest size of any kind of constraint. In a body with loads it is the
    /// difference to the value at rest, over the rest size and the value at rest.
    pub fn error<T: Scalar>(&self, system: &System<T>) -> f64 {
        if system.loads().is_empty() {
            return system.residuals().iter().map(|residual| residual.max).fold(0.0, f64::max);
        }
        let x = positions(system);
        let mut worst = 0.0f64;
        for set in system.kinds() {
            let mut grad = vec![Vector3::zeros(); set.arity()];
            for (k, tuple) in set.indices().chunks_exact(set.arity()).enumerate() {
                let mut value = |x: &[Point3<f64>]| {
                    let corners: Vec<Point3<f64>> = tuple.iter().map(|&v| x[v as usize]).collect();
                    set.evaluate(k, &corners, &mut grad)
                };
                let [now, at_rest] = [value(&x), value(&self.rest)];
                worst = larger(worst, (now - at_rest).abs() / (set.rest_size(k).to_f64() + at_rest.abs()));
            }
        }
        worst
    }

    /// The present energy.
    pub fn measure<T: Scalar>(&self, system: &System<T>) -> Energy {
        let x = positions(system);
        let (mut kinetic, mut gravity) = (0.0, 0.0);
        for ((vertex, velocity), x) in system.vertices().iter().zip(system.velocities()).zip(&x) {
            let inverse_mass = vertex.inverse_mass().to_f64();
            if inverse_mass > 0.0 {
                kinetic += 0.5 / inverse_mass * velocity.map(T::to_f64).norm_squared();
                gravity -= self.gravity.dot(&x.coords) / inverse_mass;
            }
        }
        Energy { kinetic, elastic: self.elastic(system, &x), gravity }
    }
}

/// Energy that rounding may add in one substep. A coordinate is rounded once in prediction and once
/// per projection of its vertex, each time by up to half a unit in the last place. The resulting
/// velocities add up as in a random walk. A factor of 4 allows for correlated errors of neighbors.
fn heat<T: Scalar>(system: &System<T>, settings: &Settings) -> f64 {
    let mut roundings = vec![1.0; system.vertices().len()];
    for set in system.kinds() {
        for &vertex in set.indices() {
            roundings[vertex as usize] += f64::from(settings.iterations);
        }
    }
    let of_vertex = |(vertex, &roundings): (&cutis_solver::Vertex<T>, &f64)| {
        let inverse_mass = vertex.inverse_mass().to_f64();
        let unit = T::default_epsilon().to_f64() * vertex.position().coords.map(T::to_f64).amax();
        let velocity_squared = 3.0 * roundings * (unit / settings.substep_s()).powi(2) / 12.0;
        if inverse_mass > 0.0 { 4.0 * 0.5 * velocity_squared / inverse_mass } else { 0.0 }
    };
    system.vertices().iter().zip(&roundings).map(of_vertex).sum()
}

/// Positions in `f64`, relative to the origin of the system.
pub fn positions<T: Scalar>(system: &System<T>) -> Vec<Point3<f64>> {
    system.vertices().iter().map(|vertex| vertex.position().map(T::to_f64)).collect()
}

/// Energies over time, and the work of handles.
#[derive(Default)]
pub struct History {
    entries: Vec<(Energy, f64)>,
}

impl History {
    /// Adds a sample, with the work of the handles until then.
    pub fn add(&mut self, energy: Energy, work: f64) {
        self.entries.push((energy, work));
    }

    /// Available energy: the energy at the start, the work of the handles, and the work of gravity
    /// down to the lowest height.
    fn budget(&self, work: f64) -> f64 {
        let Some((start, _)) = self.entries.first() else { return 0.0 };
        start.kinetic + start.elastic + start.gravity - self.lowest() + work
    }

    /// An energy over the available energy until the end.
    pub fn share(&self, energy: f64) -> f64 {
        let budget = self.entries.last().map_or(0.0, |(_, work)| self.budget(*work));
        if energy == 0.0 { 0.0 } else { energy / budget }
    }

    fn lowest(&self) -> f64 {
        self.entries.iter().map(|(energy, _)| energy.gravity).fold(f64::INFINITY, f64::min)
    }

    /// Largest total energy over the available energy until then. `rounding` counts as available.
    pub fn worst_ratio(&self, rounding: f64) -> f64 {
        let ratio = |(energy, work): &(Energy, f64)| {
            let total = energy.kinetic + energy.elastic + energy.gravity - self.lowest();
            let budget = self.budget(*work) + rounding;
            // Both are zero if nothing can move and no element has an effect.
            if total == 0.0 && budget == 0.0 { 0.0 } else { total / budget }
        };
        self.entries.iter().map(ratio).fold(0.0, larger)
    }

    /// Index of the first sample from which the kinetic energy stays below `share` of the available
    /// energy.
    pub fn rests_from(&self, share: f64, rounding: f64) -> Option<usize> {
        let moves = |(energy, work): &(Energy, f64)| energy.kinetic > share * (self.budget(*work) + rounding);
        after_last(self.entries.iter().map(moves))
    }
}

/// Index of the first entry after the last `true`. `None` if the last entry is `true`.
pub fn after_last(bad: impl DoubleEndedIterator<Item = bool> + ExactSizeIterator) -> Option<usize> {
    let length = bad.len();
    match bad.rev().position(|bad| bad) {
        None => Some(0),
        Some(0) => None,
        Some(from_end) => Some(length - from_end),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_energy_of_nan_is_the_worst() {
        let still = Energy { kinetic: 0.0, elastic: 1.0, gravity: 0.0 };
        let mut history = History::default();
        history.add(still, 0.0);
        history.add(Energy { kinetic: 1.0, ..still }, 0.0);
        assert_eq!(history.worst_ratio(0.0), 2.0);
        history.add(Energy { kinetic: f64::NAN, ..still }, 0.0);
        history.add(still, 0.0);
        assert!(history.worst_ratio(0.0).is_nan());
    }
}
