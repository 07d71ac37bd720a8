//! What a problem's configurations are compared with: the minimizers of implicit steps, a run with many more substeps, and the
//! equilibrium.

use std::collections::BTreeMap;

use cutis_newton::{Options, Problem};
use cutis_solver::{Settings, System};
use nalgebra::{Point3, Vector3};

use super::Failure;
use super::cases::Case;
use super::config::Backend;
use super::errors::{KindError, relative_rms, residuals, stiffness_under_load};
use super::running::State;

/// The fine run has so many times the substeps of the configuration with the most.
const FINER: u32 = 64;
/// Substeps and iterations of the run to rest from which the search for the equilibrium starts: it has not far to go then.
const TO_REST: [u32; 2] = [40, 2];

/// One implicit substep.
pub struct Implicit {
    /// Where the body is, m.
    pub start: Vec<Point3<f64>>,
    /// Where it would go if nothing held it together, m; what a handle carries is where the handle puts it.
    pub predicted: Vec<Point3<f64>>,
    /// Where it goes, m.
    pub minimum: Vec<Point3<f64>>,
}

/// The right answers of one problem.
pub struct Yardstick {
    system: System<f64>,
    problem: Problem,
    rest: Vec<Point3<f64>>,
    free: Vec<bool>,
    settings: Settings,
    /// The body in motion, at the problem's instants.
    pub states: Vec<State>,
    /// By instant and substeps: where the substep starts, and its minimizer.
    steps: BTreeMap<(usize, u32), [Vec<Point3<f64>>; 2]>,
    fine: Vec<Point3<f64>>,
    /// Substeps of a frame of the fine run.
    pub fine_substeps: u32,
    equilibrium: Vec<Point3<f64>>,
}

impl Yardstick {
    /// Computes everything for configurations with these numbers of substeps. `tell` is told what is being done.
    ///
    /// # Errors
    /// A search that does not converge, or what a solver refuses.
    pub fn new(case: &Case, substeps: &[u32], tell: &dyn Fn(&str)) -> Result<Self, Failure> {
        let most = substeps.iter().copied().max().unwrap_or(1);
        let fine_substeps = FINER * most;
        tell(&format!("run in f64 with {fine_substeps} substeps"));
        let mut run = Backend::CpuDouble
            .start(&case.xpbd, Settings { substeps: fine_substeps, iterations: 1, ..case.settings })?;
        let mut states = Vec::new();
        for frame in 1..=case.compared_at {
            run.frame_ms()?;
            if case.instants.contains(&frame) {
                states.push(run.state(frame)?);
            }
        }
        let fine = run.positions()?;

        tell("run to rest in f64");
        let ([substeps, iterations], settings) = (TO_REST, case.settings);
        let mut run = Backend::CpuDouble.start(&case.xpbd, Settings { substeps, iterations, ..settings })?;
        for _ in 0..case.most_frames {
            run.frame_ms()?;
        }
        let system = case.xpbd.to_f64();
        let problem = Problem::of(&system, settings.gravity_m_s2)?;
        tell("equilibrium by Newton's method");
        let found = problem.equilibrium(&run.positions()?, &Options::default())?;
        tell(&format!(
            "equilibrium {} after {} iterations",
            if found.definite { "stable" } else { "not stable" },
            found.iterations
        ));
        let equilibrium = found.positions;
        Ok(Self {
            rest: system.positions(),
            free: system.vertices().iter().map(|vertex| vertex.inverse_mass() > 0.0).collect(),
            steps: BTreeMap::new(),
            system,
            problem,
            settings,
            states,
            fine,
            fine_substeps,
            equilibrium,
        })
    }

    /// Finds the minimizers of a substep at every instant.
    ///
    /// # Errors
    /// A search that does not converge.
    pub fn minimize(&mut self, substeps: u32) -> Result<(), Failure> {
        for instant in 0..self.states.len() {
            let Implicit { start, minimum, .. } = self.step_of(instant, substeps, 1.0)?;
            self.steps.insert((instant, substeps), [start, minimum]);
        }
        Ok(())
    }

    /// A substep from the state at `instant`, with a step that is `longer` times as long as it should be:
    /// 1, or another number for a control.
    ///
    /// # Errors
    /// A search that does not converge.
    pub fn step_of(&self, instant: usize, substeps: u32, longer: f64) -> Result<Implicit, Failure> {
        let state = &self.states[instant];
        let h = self.settings.dt_s / f64::from(substeps);
        let start: Vec<Point3<f64>> = state.positions.iter().map(|x| x.cast()).collect();
        let velocities: Vec<Vector3<f64>> = state.velocities.iter().map(|v| v.cast()).collect();
        let mut held = start.clone();
        self.carry(&mut held, f64::from(state.frame) * self.settings.dt_s + h);
        let predicted = self.problem.predicted(&held, &velocities, longer * h);
        let minimum = self.problem.step(&held, &predicted, longer * h, &Options::default())?.positions;
        Ok(Implicit { start, predicted, minimum })
    }

    /// Puts the handles' vertices where they are at `time_s`.
    fn carry(&self, x: &mut [Point3<f64>], time_s: f64) {
        let origin = self.system.origin().coords;
        for handle in self.system.handles() {
            let path = handle.path(time_s);
            for (&vertex, rest) in handle.vertices().iter().zip(handle.rest()) {
                x[vertex as usize] = rest + path + origin;
            }
        }
    }

    /// E1: error of the positions after one substep from the state at `instant`; NaN unless [`minimize`](Self::minimize) was
    /// called for this number of substeps.
    pub fn e1(&self, found: &[Point3<f64>], instant: usize, substeps: u32) -> f64 {
        let step = self.steps.get(&(instant, substeps));
        step.map_or(f64::NAN, |[start, minimum]| self.error(found, minimum, start))
    }

    /// E2: error of the trajectory at the frame of comparison.
    pub fn e2(&self, found: &[Point3<f64>]) -> f64 {
        self.error(found, &self.fine, &self.rest)
    }

    /// E3: error of the settled body.
    pub fn e3(&self, found: &[Point3<f64>]) -> f64 {
        self.error(found, &self.equilibrium, &self.rest)
    }

    /// E4: residuals of the settled body.
    pub fn e4(&self, found: &[Point3<f64>]) -> Vec<KindError> {
        residuals(&self.system, found, &self.equilibrium)
    }

    /// How far the body moved between two states, relative to how far the present one lies from rest.
    pub fn moved(&self, now: &[Point3<f64>], before: &[Point3<f64>]) -> f64 {
        self.error(before, now, &self.rest)
    }

    /// Effective over material stiffness of the settled body: against the handle if there is one, else against the load.
    pub fn stiffness(&self, found: &[Point3<f64>]) -> f64 {
        match self.system.handles().first() {
            None => stiffness_under_load(found, &self.equilibrium, &self.rest, &self.free),
            Some(handle) => {
                let way = handle.path(f64::INFINITY);
                let reaction = |x: &[Point3<f64>]| {
                    let forces = self.problem.forces(x);
                    handle.vertices().iter().map(|&v| forces[v as usize].dot(&way)).sum::<f64>()
                };
                reaction(found) / reaction(&self.equilibrium)
            }
        }
    }

    /// The body in `f64`, at rest.
    pub fn system(&self) -> &System<f64> {
        &self.system
    }

    /// Positions of the equilibrium.
    pub fn equilibrium(&self) -> &[Point3<f64>] {
        &self.equilibrium
    }

    /// Positions at rest.
    pub fn rest(&self) -> &[Point3<f64>] {
        &self.rest
    }

    /// Vertices that move.
    pub fn free(&self) -> usize {
        self.free.iter().filter(|free| **free).count()
    }

    /// [`relative_rms`] of the vertices that move.
    pub fn error(&self, found: &[Point3<f64>], right: &[Point3<f64>], start: &[Point3<f64>]) -> f64 {
        relative_rms(found, right, start, &self.free)
    }
}
