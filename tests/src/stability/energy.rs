//! The energy of a body, and what it may be.
//!
//! A constraint stiffer than a substep can resolve acts as one that takes back its error within a substep: its compliance counts
//! as at least `h²·Σ w|∇C|²` at its rest shape. So PBD and a compliance of 0 have a finite energy too: the kinetic energy that
//! taking back their error in one substep makes. Vertex block descent steps implicitly; there a compliance counts as it is. All sums are in `f64`, by
//! [`evaluate`](cutis_solver::ConstraintSet::evaluate), from the stored parameters.
//!
//! Every projection rounds positions, and a position that is off by half a unit in its last place is a velocity that is off by
//! that over the substep: a random walk that heats a body, the more the shorter the substep. What this can make counts as put
//! in, and is told.

use cutis_constraints::Scalar;
use cutis_solver::{Formulation, Settings, Stiffness, System};
use nalgebra::{Point3, Vector3};

use crate::worst::larger;

/// The total energy may be so many times what was put in where a substep resolves the stiffness: it does not grow.
pub const RESOLVED: f64 = 1.05;
/// The same where it does not. The constraints of a vertex then move it one after the other, all within a substep; if they agree in
/// direction, the kinetic energy is the square of a sum where the budget has the sum of squares.
pub const UNRESOLVED: f64 = 10.0;

/// Relative error of a rest size that is rounding, in units of the machine epsilon of the number type.
const ROUNDING: f64 = 64.0;

/// Kinetic and elastic energy, and the potential of gravity, in J.
#[derive(Clone, Copy, Debug)]
pub struct Energy {
    /// `Σ ½m|v|²`.
    pub kinetic: f64,
    /// `Σ ½C²/α`, with what a compliance counts as.
    pub elastic: f64,
    /// `−Σ m g·x`.
    pub gravity: f64,
}

/// Measures the energy of one body.
pub struct Meter {
    gravity: Vector3<f64>,
    /// Per kind, per constraint: what the compliance counts as; infinite for one that does nothing.
    compliances: Vec<Vec<f64>>,
    /// What rounding of positions may make in one substep, in J.
    pub heat: f64,
    /// What rounding of a rest shape makes.
    pub rounding: f64,
}

impl Meter {
    /// For `system` with its rest positions in meters.
    pub fn new<T: Scalar>(system: &System<T>, rest: &[Point3<f64>], settings: &Settings) -> Self {
        let h = settings.substep_s();
        let strain = ROUNDING * T::default_epsilon().to_f64();
        let mut rounding = 0.0;
        let mut compliances = Vec::new();
        for set in system.kinds() {
            let mut of_kind = Vec::with_capacity(set.len());
            for (k, tuple) in set.indices().chunks_exact(set.arity()).enumerate() {
                let x: Vec<Point3<f64>> = tuple.iter().map(|&v| rest[v as usize]).collect();
                let mut grad = vec![Vector3::zeros(); tuple.len()];
                set.evaluate(k, &x, &mut grad);
                let inverse_mass = |v: u32| system.vertices()[v as usize].inverse_mass().to_f64();
                let weighted: f64 =
                    tuple.iter().zip(&grad).map(|(&v, grad)| inverse_mass(v) * grad.norm_squared()).sum();
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
        Self { gravity: Vector3::from(settings.gravity_m_s2), compliances, heat, rounding }
    }

    /// Elastic energy with every vertex at `x`.
    pub fn elastic<T: Scalar>(&self, system: &System<T>, x: &[Point3<f64>]) -> f64 {
        let mut sum = 0.0;
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

    /// The energy now.
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

/// A coordinate is rounded once in prediction and once per projection of its vertex, each time by a number whose variance is that
/// of half a unit in the last place; the velocities that this makes add up as in a random walk, and a factor of 4 is left for how
/// errors of neighbors agree.
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

/// In `f64`, relative to the system's origin.
pub fn positions<T: Scalar>(system: &System<T>) -> Vec<Point3<f64>> {
    system.vertices().iter().map(|vertex| vertex.position().map(T::to_f64)).collect()
}

/// Energies over time, and the work of handles.
#[derive(Default)]
pub struct History {
    entries: Vec<(Energy, f64)>,
}

impl History {
    /// Adds what was measured, with the work of handles up to then.
    pub fn add(&mut self, energy: Energy, work: f64) {
        self.entries.push((energy, work));
    }

    /// What there was to be had: the energy at the start, the work of handles, and gravity's from the lowest height reached.
    fn budget(&self, work: f64) -> f64 {
        let Some((start, _)) = self.entries.first() else { return 0.0 };
        start.kinetic + start.elastic + start.gravity - self.lowest() + work
    }

    /// An energy over what was there to be had in the end.
    pub fn share(&self, energy: f64) -> f64 {
        let budget = self.entries.last().map_or(0.0, |(_, work)| self.budget(*work));
        if energy == 0.0 { 0.0 } else { energy / budget }
    }

    fn lowest(&self) -> f64 {
        self.entries.iter().map(|(energy, _)| energy.gravity).fold(f64::INFINITY, f64::min)
    }

    /// Largest total energy over what was there to be had until then; `rounding` counts as had.
    pub fn worst_ratio(&self, rounding: f64) -> f64 {
        let ratio = |(energy, work): &(Energy, f64)| {
            let total = energy.kinetic + energy.elastic + energy.gravity - self.lowest();
            let budget = self.budget(*work) + rounding;
            // Where nothing can move and no element counts, there is none of either.
            if total == 0.0 && budget == 0.0 { 0.0 } else { total / budget }
        };
        self.entries.iter().map(ratio).fold(0.0, larger)
    }

    /// The first entry from which on the kinetic energy stays below `share` of what was there to be had.
    pub fn rests_from(&self, share: f64, rounding: f64) -> Option<usize> {
        let moves = |(energy, work): &(Energy, f64)| energy.kinetic > share * (self.budget(*work) + rounding);
        after_last(self.entries.iter().map(moves))
    }
}

/// The first place after which `bad` holds nowhere; none if it holds at the last.
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
    fn an_energy_that_is_not_a_number_is_the_worst() {
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
