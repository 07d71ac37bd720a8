//! Reference solutions of a problem: the minimizers of implicit steps, a run with many more
//! substeps, and the equilibrium.

use std::collections::BTreeMap;

use cutis_newton::{Options, Problem as NewtonProblem};
use cutis_solver::{Settings, System};
use nalgebra::{Point3, Vector3};

use super::Failure;
use super::config::Backend;
use super::errors::{KindError, relative_rms, residuals, stiffness_under_load};
use super::problems::Problem;
use super::running::State;

/// Substeps of the fine run over the largest number of substeps of a configuration.
const FINER: u32 = 64;
/// Substeps and iterations of the run to rest. The search for the equilibrium starts at its end.
const TO_REST: [u32; 2] = [40, 2];

/// One implicit substep, positions in m.
pub struct ImplicitStep {
    /// Before the substep.
    pub start: Vec<Point3<f64>>,
    /// The minimizer of the substep.
    pub minimum: Vec<Point3<f64>>,
}

/// The reference solutions of one problem.
pub struct Reference {
    system: System<f64>,
    newton: NewtonProblem,
    rest: Vec<Point3<f64>>,
    free: Vec<bool>,
    settings: Settings,
    /// The moving body at the instants of the problem.
    pub states: Vec<State>,
    /// By instant and number of substeps.
    steps: BTreeMap<(usize, u32), ImplicitStep>,
    fine: Vec<Point3<f64>>,
    /// Substeps of a frame of the fine run.
    pub fine_substeps: u32,
    equilibrium: Vec<Point3<f64>>,
}

impl Reference {
    /// Solves the problem for configurations with these numbers of substeps. Calls `progress`
    /// before each part.
    ///
    /// # Errors
    /// A search does not converge, or a solver refuses the problem.
    pub fn new(problem: &Problem, substeps: &[u32], progress: &dyn Fn(&str)) -> Result<Self, Failure> {
        let most = substeps.iter().copied().max().unwrap_or(1);
        let fine_substeps = FINER * most;
        progress(&format!("run in f64 with {fine_substeps} substeps"));
        let mut run = Backend::CpuDouble
            .start(&problem.xpbd, Settings { substeps: fine_substeps, iterations: 1, ..problem.settings })?;
        let mut states = Vec::new();
        for frame in 1..=problem.compared_at {
            run.frame_ms()?;
            if problem.instants.contains(&frame) {
                states.push(run.state(frame)?);
            }
        }
        let fine = run.positions()?;

        progress("run to rest in f64");
        let ([substeps, iterations], settings) = (TO_REST, problem.settings);
        let mut run =
            Backend::CpuDouble.start(&problem.xpbd, Settings { substeps, iterations, ..settings })?;
        for _ in 0..problem.most_frames {
            run.frame_ms()?;
        }
        let system = problem.xpbd.to_f64();
        let newton = NewtonProblem::of(&system, settings.gravity_m_s2)?;
        progress("equilibrium by Newton's method");
        let found = newton.equilibrium(&run.positions()?, &Options::default())?;
        progress(&format!(
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
            newton,
            settings,
            states,
            fine,
            fine_substeps,
            equilibrium,
        })
    }

    /// Finds the minimizer of a substep at every instant.
    ///
    /// # Errors
    /// A search does not converge.
    pub fn minimize(&mut self, substeps: u32) -> Result<(), Failure> {
        for instant in 0..self.states.len() {
            let step = self.step_of(instant, substeps, 1.0)?;
            self.steps.insert((instant, substeps), step);
        }
        Ok(())
    }

    /// The substep from the state at `instant`. A factor `longer` other than 1 makes the step too
    /// long, for a control.
    ///
    /// # Errors
    /// The search does not converge.
    pub fn step_of(&self, instant: usize, substeps: u32, longer: f64) -> Result<ImplicitStep, Failure> {
        let state = &self.states[instant];
        let h = self.settings.dt_s / f64::from(substeps);
        let start: Vec<Point3<f64>> = state.positions.iter().map(|x| x.cast()).collect();
        let velocities: Vec<Vector3<f64>> = state.velocities.iter().map(|v| v.cast()).collect();
        let mut held = start.clone();
        self.move_handles(&mut held, f64::from(state.frame) * self.settings.dt_s + h);
        let predicted = self.newton.predicted(&held, &velocities, longer * h);
        let minimum = self.newton.step(&held, &predicted, longer * h, &Options::default())?.positions;
        Ok(ImplicitStep { start, minimum })
    }

    /// Moves the vertices of the handles to their positions at `time_s`.
    fn move_handles(&self, x: &mut [Point3<f64>], time_s: f64) {
        let origin = self.system.origin().coords;
        for handle in self.system.handles() {
            let path = handle.path(time_s);
            for (&vertex, start) in handle.vertices().iter().zip(handle.start()) {
                x[vertex as usize] = start + path + origin;
            }
        }
    }

    /// E1: error of the positions after one substep from the state at `instant`. NaN unless
    /// [`minimize`](Self::minimize) was called for this number of substeps.
    pub fn e1(&self, found: &[Point3<f64>], instant: usize, substeps: u32) -> f64 {
        let step = self.steps.get(&(instant, substeps));
        step.map_or(f64::NAN, |step| self.error(found, &step.minimum, &step.start))
    }

    /// E2: error of the trajectory at the frame of comparison.
    pub fn e2(&self, found: &[Point3<f64>]) -> f64 {
        self.error(found, &self.fine, &self.rest)
    }

    /// E3: error of the body at rest.
    pub fn e3(&self, found: &[Point3<f64>]) -> f64 {
        self.error(found, &self.equilibrium, &self.rest)
    }

    /// E4: residuals of the body at rest.
    pub fn e4(&self, found: &[Point3<f64>]) -> Vec<KindError> {
        residuals(&self.system, found, &self.equilibrium)
    }

    /// Motion between two states over the displacement of the present state.
    pub fn moved(&self, now: &[Point3<f64>], before: &[Point3<f64>]) -> f64 {
        self.error(before, now, &self.rest)
    }

    /// Effective stiffness over the stiffness of the material: against the handle if there is one,
    /// else against the load.
    pub fn stiffness(&self, found: &[Point3<f64>]) -> f64 {
        match self.system.handles().first() {
            None => stiffness_under_load(found, &self.equilibrium, &self.rest, &self.free),
            Some(handle) => {
                let way = handle.path(f64::INFINITY);
                let reaction = |x: &[Point3<f64>]| {
                    let forces = self.newton.forces(x);
                    handle.vertices().iter().map(|&v| forces[v as usize].dot(&way)).sum::<f64>()
                };
                reaction(found) / reaction(&self.equilibrium)
            }
        }
    }

    /// Positions of the equilibrium.
    pub fn equilibrium(&self) -> &[Point3<f64>] {
        &self.equilibrium
    }

    /// Positions at rest.
    pub fn rest(&self) -> &[Point3<f64>] {
        &self.rest
    }

    /// Number of vertices that can move.
    pub fn free(&self) -> usize {
        self.free.iter().filter(|free| **free).count()
    }

    /// [`relative_rms`] over the vertices that can move.
    pub fn error(&self, found: &[Point3<f64>], right: &[Point3<f64>], start: &[Point3<f64>]) -> f64 {
        relative_rms(found, right, start, &self.free)
    }
}
