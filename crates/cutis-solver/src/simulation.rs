//! The stepping loop, written once: what runs in which order is here, how a pass is spread over threads is not.

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::descent::suits;
use crate::passes::Integrator;
use crate::{
    Clock, ColoredVertices, ConstraintSet, Descent, Formulation, Motion, Schedule, Settings, SolverError,
    Step, StepProfile, Sweep, System, Vertex, VertexBlock,
};

/// How the passes of a substep are executed on the host: one after the other, or by several threads.
pub trait Execute<T: Scalar> {
    /// Runs `pass` on `block`, or on its parts in any order.
    fn vertices(&self, block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync));

    /// Projects the constraints of one sweep. `multipliers` has one number per constraint of the set, or none.
    fn sweep(
        &self,
        sweep: Sweep,
        set: &dyn ConstraintSet<T>,
        vertices: &mut [Vertex<T>],
        step: Step<T>,
        multipliers: &mut [T],
    );

    /// Moves the vertices of one color.
    fn color_pass(&self, color: ColoredVertices<'_, T>);

    /// Runs what one thread does between the passes; `part` is its name in a [`StepProfile`](crate::StepProfile).
    fn alone(&self, _part: &'static str, work: &mut dyn FnMut()) {
        work();
    }

    /// The first vertex with a coordinate that is not finite.
    fn first_not_finite(&self, vertices: &[Vertex<T>]) -> Option<usize>;
}

/// A system, its settings and its clock.
pub struct Simulation<T: Scalar> {
    system: System<T>,
    settings: Settings,
    schedule: Schedule,
    integrator: Integrator<T>,
    method: Method<T>,
    multipliers: Vec<Vec<T>>,
    clock: Clock,
}

/// How a substep is solved.
pub enum Method<T: Scalar> {
    /// Constraint by constraint.
    Project(Step<T>),
    /// Vertex by vertex.
    Descend(Box<Descent<T>>),
}

impl<T: Scalar> Simulation<T> {
    /// Checks the settings and that every kind has a stiffness of their formulation.
    ///
    /// Multipliers are stored only for XPBD with more than one iteration: with one, each starts and ends at zero.
    pub fn new(system: System<T>, settings: Settings) -> Result<Self, SolverError> {
        settings.validate()?;
        for kind in &system.kinds {
            let (found, expected) = (kind.stiffness().formulation(), settings.formulation);
            if !suits(found, expected) {
                return Err(SolverError::Formulation { kind: kind.name(), found, expected });
            }
        }
        let length = |kind: &dyn ConstraintSet<T>| if settings.keeps_multipliers() { kind.len() } else { 0 };
        let multipliers = system.kinds.iter().map(|kind| vec![T::zero(); length(&**kind)]).collect();
        let h = settings.substep_s();
        let inverse_h_squared = T::constant(1.0 / (h * h));
        if !(T::constant(h) > T::zero() && inverse_h_squared.is_finite()) {
            let expected = "a substep whose inverse square the number type can hold";
            return Err(SolverError::Setting { key: "dt_s / substeps", value: h, expected });
        }
        let method = match settings.formulation {
            Formulation::Pbd => Method::Project(Step::Pbd),
            Formulation::Xpbd => Method::Project(Step::Xpbd { inverse_h_squared }),
            Formulation::Vbd => Method::Descend(Box::new(Descent::new(&system, &settings)?)),
        };
        Ok(Self {
            schedule: match &method {
                Method::Project(_) => Schedule::new(&system.kinds, &settings),
                Method::Descend(descent) => Schedule::of_vertices(descent.groups(), &settings),
            },
            integrator: Integrator::new(&settings),
            method,
            multipliers,
            system,
            settings,
            clock: Clock::default(),
        })
    }

    /// The body in its present state.
    pub fn system(&self) -> &System<T> {
        &self.system
    }

    /// The settings it was built with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What a frame executes.
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    /// Frames and substeps done.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Simulated time in seconds.
    pub fn time_s(&self) -> f64 {
        self.clock.time_s(&self.settings)
    }

    /// The numbers of a substep.
    pub fn integrator(&self) -> &Integrator<T> {
        &self.integrator
    }

    /// What a substep asks of every projection; nothing in vertex block descent.
    pub fn projection_step(&self) -> Option<Step<T>> {
        match &self.method {
            Method::Project(step) => Some(*step),
            Method::Descend(_) => None,
        }
    }

    /// How a substep is solved.
    pub fn method(&self) -> &Method<T> {
        &self.method
    }

    /// Says how far a backend has come that keeps the state elsewhere.
    pub fn set_clock(&mut self, clock: Clock) {
        self.clock = clock;
    }

    /// Takes over a state that a backend has kept elsewhere, in the solver's own coordinates.
    ///
    /// # Errors
    /// [`SolverError::VertexLength`] unless there is one of each per vertex; the state is then unchanged.
    pub fn set_state(
        &mut self,
        vertices: &[Vertex<T>],
        velocities: impl ExactSizeIterator<Item = Vector3<T>>,
    ) -> Result<(), SolverError> {
        self.system.set_state(vertices, velocities)
    }

    /// Bytes of the stored multipliers; 0 unless XPBD runs more than one iteration.
    pub fn multiplier_bytes(&self) -> usize {
        self.multipliers.iter().map(|kind| size_of_val(kind.as_slice())).sum()
    }

    /// Bytes that vertex block descent stores about which constraints each vertex is in; 0 elsewhere.
    pub fn incidence_bytes(&self) -> usize {
        match &self.method {
            Method::Project(_) => 0,
            Method::Descend(descent) => descent.bytes(),
        }
    }

    /// Runs `frames` frames. Running them one by one gives the same bits. Nothing is allocated.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`] as soon as a position is not finite after a substep. The state is then that of the
    /// start of this substep, with all velocities zero, and may be stepped on.
    pub fn run(&mut self, frames: usize, execute: &impl Execute<T>) -> Result<(), SolverError> {
        let mut begun = false;
        let end = self.clock.frame.saturating_add(frames as u64);
        while self.clock.frame < end {
            self.begin_substep(begun, execute);
            if !self.system.handles.is_empty() {
                let time_s = self.time_s() + self.settings.substep_s();
                execute.alone(StepProfile::HANDLES, &mut || self.system.carry_handles(time_s));
            }
            self.solve(execute);
            if let Some(vertex) = execute.first_not_finite(&self.system.vertices) {
                self.move_vertices(Motion::Restore, execute);
                return Err(SolverError::not_finite(vertex, self.clock, &self.settings));
            }
            begun = true;
            self.clock.tick(&self.settings);
        }
        if begun {
            self.move_vertices(Motion::Finish, execute);
        }
        Ok(())
    }

    /// Goes on from a saved state: positions in the caller's coordinates, velocities, frames done so far.
    ///
    /// What [`System::positions`] and [`System::velocities`] gave after `frame` frames leads to the same bits as a run
    /// without interruption, as long as [`System::origin`] is zero.
    ///
    /// # Errors
    /// Wrong lengths or values that are not finite; the state is then unchanged.
    pub fn restore(
        &mut self,
        positions: &[Point3<T>],
        velocities: &[Vector3<T>],
        frame: u64,
    ) -> Result<(), SolverError> {
        self.system.restore(positions, velocities)?;
        self.clock = Clock { frame, substep: 0 };
        Ok(())
    }

    /// Predicts, after the velocities of the substep before if there was one. Vertex block descent needs them stored.
    fn begin_substep(&mut self, after_another: bool, execute: &impl Execute<T>) {
        match (after_another, &self.method) {
            (true, Method::Project(_)) => self.move_vertices(Motion::FinishAndPredict, execute),
            (true, Method::Descend(_)) => {
                self.move_vertices(Motion::Finish, execute);
                self.move_vertices(Motion::Predict, execute);
            }
            (false, _) => self.move_vertices(Motion::Predict, execute),
        }
    }

    fn move_vertices(&mut self, motion: Motion, execute: &impl Execute<T>) {
        let integrator = self.integrator;
        execute.vertices(self.system.block(), &|block| integrator.run(motion, block));
    }

    fn solve(&mut self, execute: &impl Execute<T>) {
        if self.settings.keeps_multipliers() {
            let multipliers = &mut self.multipliers;
            let clear = &mut || multipliers.iter_mut().for_each(|kind| kind.fill(T::zero()));
            execute.alone(StepProfile::MULTIPLIERS, clear);
        }
        for iteration in 0..self.schedule.iterations {
            match &self.method {
                Method::Project(step) => {
                    for &sweep in &self.schedule.sweeps {
                        let (vertices, kinds) = self.system.projection_parts();
                        let multipliers = &mut self.multipliers[sweep.kind];
                        execute.sweep(sweep, &*kinds[sweep.kind], vertices, *step, multipliers);
                    }
                }
                Method::Descend(descent) => {
                    for &pass in self.schedule.color_passes_of(iteration) {
                        execute.color_pass(ColoredVertices::new(&mut self.system, descent, pass));
                    }
                }
            }
        }
    }
}
