//! The stepping loop of all CPU backends. It defines the order of the passes. An [`Execute`]
//! defines how a pass is distributed over threads.

use std::ops::Range;

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::descent::accepts;
use crate::passes::Integrator;
use crate::{
    Change, Clock, Columns, ConstraintColor, ConstraintSet, Descent, Formulation, Schedule, Settings,
    SolverError, Step, StepProfile, System, Vertex, VertexBlock, VertexColor, VertexPass, VertexStore,
};

/// If each thread moves more bytes of vertices than this, colors are projected tile by tile: the
/// vertices of a thread then do not fit the cache. Otherwise whole colors are faster, because the
/// vertices stay in the cache of the same processor. Results do not depend on it.
const CACHE: usize = 6 << 20;

/// Executes the passes of a substep on the host, with one thread or with several.
pub trait Execute<T: Scalar> {
    /// Returns the number of threads.
    fn workers(&self) -> usize {
        1
    }

    /// Runs `pass` on `block` as a whole, or on its parts in any order.
    fn vertices(&self, block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync));

    /// Projects the constraints of one color.
    fn project(&self, color: ConstraintColor<'_, T>);

    /// Moves the vertices of one color by vertex block descent.
    fn descend(&self, color: VertexColor<'_, T>);

    /// Runs serial work between the passes. `part` is its name in a
    /// [`StepProfile`](crate::StepProfile).
    fn serial(&self, _part: &'static str, work: &mut dyn FnMut()) {
        work();
    }

    /// Calls `find` for `0..count` or for parts of it, each of which starts with an even number.
    /// Returns the lowest result.
    fn find_first(
        &self,
        count: usize,
        find: &(dyn Fn(Range<usize>) -> Option<usize> + Sync),
    ) -> Option<usize>;
}

/// A system with its settings, its schedule and its clock.
pub struct Simulation<T: Scalar> {
    system: System<T>,
    /// The vertices during a step, if by column. Between steps those of the system count.
    columns: Option<Columns<T>>,
    settings: Settings,
    schedule: Schedule,
    integrator: Integrator<T>,
    method: Method<T>,
    multipliers: Vec<Vec<T>>,
    clock: Clock,
}

/// The method that solves a substep.
pub enum Method<T: Scalar> {
    /// Projects one constraint after the other (PBD, XPBD).
    Project(Step<T>),
    /// Moves one vertex after the other (vertex block descent).
    Descend(Box<Descent<T>>),
    /// Takes no steps, see [`Resting`](crate::Resting).
    Rest,
}

impl<T: Scalar> Method<T> {
    /// The schedule of a frame.
    fn schedule(&self, system: &System<T>, settings: &Settings) -> Schedule {
        match self {
            Self::Project(_) => Schedule::new(&system.kinds, settings),
            Self::Descend(descent) => Schedule::of_vertices(descent.groups(), settings),
            Self::Rest => Schedule::new::<T>(&[], settings),
        }
    }
}

/// Checks the settings, and that the stiffness of each kind fits them.
fn check<T: Scalar>(system: &System<T>, settings: &Settings) -> Result<(), SolverError> {
    settings.validate()?;
    for kind in &system.kinds {
        let (found, expected) = (kind.stiffness().formulation(), settings.formulation);
        if !accepts(found, expected) {
            return Err(SolverError::Formulation { kind: kind.name(), found, expected });
        }
    }
    Ok(())
}

/// The inverse square of a substep in 1/s².
fn inverse_h_squared<T: Scalar>(settings: &Settings) -> Result<T, SolverError> {
    let h = settings.substep_s();
    let inverse = T::constant(1.0 / (h * h));
    if T::constant(h) > T::zero() && inverse.is_finite() {
        return Ok(inverse);
    }
    let expected = "a substep whose inverse square is finite in the number type";
    Err(SolverError::Setting { key: "dt_s / substeps", value: h, expected })
}

impl<T: Scalar> Simulation<T> {
    /// Prepares `system` for stepping.
    ///
    /// Multipliers are stored only for XPBD with more than one iteration. With one iteration each
    /// multiplier starts at zero and is used once.
    ///
    /// # Errors
    /// Returns [`SolverError::Setting`] for a setting out of range, [`SolverError::Formulation`]
    /// for a kind whose stiffness is for another formulation, and the errors of [`Descent::new`].
    pub fn new(system: System<T>, settings: Settings) -> Result<Self, SolverError> {
        check(&system, &settings)?;
        let inverse_h_squared = inverse_h_squared(&settings)?;
        let method = match settings.formulation {
            Formulation::Pbd => Method::Project(Step::Pbd),
            Formulation::Xpbd => Method::Project(Step::Xpbd { inverse_h_squared }),
            Formulation::Vbd => Method::Descend(Box::new(Descent::new(&system, &settings)?)),
        };
        let length = |kind: &dyn ConstraintSet<T>| if settings.keeps_multipliers() { kind.len() } else { 0 };
        let multipliers = system.kinds.iter().map(|kind| vec![T::zero(); length(&**kind)]).collect();
        Ok(Self::with(system, settings, method, multipliers))
    }

    /// Holds `system` without steps. Nothing is prepared for them: no groups, no multipliers.
    ///
    /// # Errors
    /// As [`Simulation::new`], except for errors of the groups.
    pub(crate) fn resting(system: System<T>, settings: Settings) -> Result<Self, SolverError> {
        check(&system, &settings)?;
        inverse_h_squared::<T>(&settings)?;
        if settings.formulation == Formulation::Vbd {
            Descent::check(&system, &settings)?;
        }
        Ok(Self::with(system, settings, Method::Rest, Vec::new()))
    }

    fn with(system: System<T>, settings: Settings, method: Method<T>, multipliers: Vec<Vec<T>>) -> Self {
        Self {
            schedule: method.schedule(&system, &settings),
            integrator: Integrator::new(&settings),
            method,
            multipliers,
            system,
            columns: None,
            settings,
            clock: Clock::default(),
        }
    }

    /// Finds teams for vertex block descent with SIMD lanes, see [`Descent::find_teams`]. Other
    /// methods need none.
    pub fn with_teams(mut self) -> Self {
        if let Method::Descend(descent) = &mut self.method {
            descent.find_teams(&self.system);
        }
        self
    }

    /// Keeps the vertices by column during a step if most constraints are in rows, so that SIMD
    /// lanes read them faster. Projections take this form, and vertex block descent does not. The
    /// bits do not change.
    pub fn with_columns(mut self) -> Self {
        if matches!(self.method, Method::Project(_)) && self.system.column_bytes() > 0 {
            self.columns = Some(Columns::new(self.system.vertices.len()));
        }
        self
    }

    /// Returns the body in its present state.
    pub fn system(&self) -> &System<T> {
        &self.system
    }

    /// Returns the settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the schedule of a frame.
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    /// Returns the number of completed frames and substeps.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Returns the simulated time in seconds.
    pub fn time_s(&self) -> f64 {
        self.clock.time_s(&self.settings)
    }

    /// Returns the constants of a substep.
    pub fn integrator(&self) -> &Integrator<T> {
        &self.integrator
    }

    /// Returns the parameters of a projection, or `None` if constraints are not projected.
    pub fn projection_step(&self) -> Option<Step<T>> {
        match &self.method {
            Method::Project(step) => Some(*step),
            Method::Descend(_) | Method::Rest => None,
        }
    }

    /// Returns the method that solves a substep.
    pub fn method(&self) -> &Method<T> {
        &self.method
    }

    /// Sets the clock. For backends that keep the state on a device.
    pub fn set_clock(&mut self, clock: Clock) {
        self.clock = clock;
    }

    /// Sets the state in the solver's own coordinates. For backends that keep the state on a
    /// device.
    ///
    /// # Errors
    /// Returns [`SolverError::VertexLength`] unless both arrays have one element per vertex. The
    /// state is then unchanged.
    pub fn set_state(
        &mut self,
        vertices: &[Vertex<T>],
        velocities: impl ExactSizeIterator<Item = Vector3<T>>,
    ) -> Result<(), SolverError> {
        self.system.set_state(vertices, velocities)
    }

    /// Returns the memory of the multipliers in bytes: 0 unless XPBD runs more than one iteration.
    pub fn multiplier_bytes(&self) -> usize {
        self.multipliers.iter().map(|kind| size_of_val(kind.as_slice())).sum()
    }

    /// Returns the memory of the vertices by column in bytes, 0 without columns.
    pub fn column_bytes(&self) -> usize {
        self.columns.as_ref().map_or(0, Columns::bytes)
    }

    /// Returns the memory of the teams of vertex block descent in bytes, 0 without teams.
    pub fn team_bytes(&self) -> usize {
        match &self.method {
            Method::Project(_) | Method::Rest => 0,
            Method::Descend(descent) => descent.team_bytes(),
        }
    }

    /// Returns the memory of the incidences of vertex block descent in bytes, 0 for other methods.
    pub fn incidence_bytes(&self) -> usize {
        match &self.method {
            Method::Project(_) | Method::Rest => 0,
            Method::Descend(descent) => descent.bytes(),
        }
    }

    /// Runs `frames` frames without allocating memory. Separate calls for each frame give the same
    /// bits.
    ///
    /// # Errors
    /// Returns [`SolverError::NotFinite`] as soon as a position is not finite after a substep. The
    /// state is then that at the start of this substep, with all velocities zero, and can be
    /// stepped again. Returns [`SolverError::Resting`] for frames of a body that only rests.
    pub fn run(&mut self, frames: usize, execute: &impl Execute<T>) -> Result<(), SolverError> {
        if frames > 0 && matches!(self.method, Method::Rest) {
            return Err(SolverError::Resting);
        }
        let mut started = false;
        let end = self.clock.frame.saturating_add(frames as u64);
        while self.clock.frame < end {
            self.begin_substep(started, execute);
            if !self.system.handles.is_empty() {
                let time_s = self.time_s() + self.settings.substep_s();
                execute.serial(StepProfile::HANDLES, &mut || self.move_handles(time_s));
            }
            self.solve(execute);
            if let Some(vertex) = self.first_not_finite(execute) {
                self.run_pass(VertexPass::Restore, execute);
                return Err(SolverError::not_finite(vertex, self.clock, &self.settings));
            }
            started = true;
            self.clock.tick(&self.settings);
        }
        if started {
            self.run_pass(VertexPass::Finish, execute);
        }
        Ok(())
    }

    /// Continues from a saved state: positions in the caller's coordinates (m), velocities (m/s)
    /// and the number of completed frames.
    ///
    /// With the results of [`System::positions`] and [`System::velocities`] after `frame` frames,
    /// the run has the same bits as one without interruption if [`System::origin`] is zero.
    ///
    /// # Errors
    /// Returns an error for wrong lengths or values that are not finite. The state is then
    /// unchanged.
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

    /// Changes parts of the body between two frames. Velocities, clock and all other parts stay.
    ///
    /// # Errors
    /// Returns an error for a kind, a vertex or a value that does not exist or is out of range, and
    /// the errors of [`Descent::new`]. After an error of the second sort the simulation must not be
    /// stepped.
    pub fn change(&mut self, change: &Change<T>) -> Result<(), SolverError> {
        let moved: Vec<bool> = match &self.method {
            Method::Project(_) | Method::Rest => Vec::new(),
            Method::Descend(_) => {
                self.system.vertices.iter().map(|vertex| vertex.inverse_mass() > T::zero()).collect()
            }
        };
        self.system.change(change)?;
        if let Method::Descend(descent) = &mut self.method {
            descent.change(&self.system, change, &moved)?;
        }
        self.schedule = self.method.schedule(&self.system, &self.settings);
        for (number, kind) in &change.kinds {
            if let Some(multipliers) = self.multipliers.get_mut(*number)
                && self.settings.keeps_multipliers()
            {
                *multipliers = vec![T::zero(); kind.len()];
            }
        }
        Ok(())
    }

    /// Predicts positions. If another substep came before, updates the velocities first. Vertex
    /// block descent reads the velocities from memory, so that it cannot combine the two passes.
    fn begin_substep(&mut self, after_another: bool, execute: &impl Execute<T>) {
        match (after_another, &self.method) {
            (true, Method::Project(_)) => self.run_pass(VertexPass::FinishAndPredict, execute),
            (true, _) => {
                self.run_pass(VertexPass::Finish, execute);
                self.run_pass(VertexPass::Predict, execute);
            }
            (false, _) => self.run_pass(VertexPass::Predict, execute),
        }
    }

    fn run_pass(&mut self, pass: VertexPass, execute: &impl Execute<T>) {
        let integrator = self.integrator;
        let mut block = self.system.block();
        block.columns = self.columns.as_mut().map(Columns::block);
        execute.vertices(block, &|block| integrator.run(pass, block));
    }

    fn move_handles(&mut self, time_s: f64) {
        self.system.move_handles(time_s);
        let Some(columns) = &mut self.columns else { return };
        for &vertex in self.system.handles.iter().flat_map(|handle| handle.vertices()) {
            columns.set(vertex, self.system.vertices[vertex as usize]);
        }
    }

    fn first_not_finite(&self, execute: &impl Execute<T>) -> Option<usize> {
        let (columns, vertices) = (&self.columns, &self.system.vertices);
        execute.find_first(vertices.len(), &|part| match columns {
            Some(columns) => columns.first_not_finite(part.start, part.end),
            None => part.clone().find(|&vertex| !vertices[vertex].is_finite()),
        })
    }

    fn solve(&mut self, execute: &impl Execute<T>) {
        if self.settings.keeps_multipliers() {
            let multipliers = &mut self.multipliers;
            let clear = &mut || multipliers.iter_mut().for_each(|kind| kind.fill(T::zero()));
            execute.serial(StepProfile::MULTIPLIERS, clear);
        }
        for iteration in 0..self.schedule.iterations {
            match &self.method {
                Method::Project(step) => {
                    let (vertices, kinds) = self.system.projection_parts();
                    let share = size_of_val(vertices) / execute.workers().max(1);
                    for (kind, multipliers) in kinds.iter().zip(&mut self.multipliers) {
                        let (set, step) = (&**kind, *step);
                        let tiles = if share > CACHE { set.tiles() } else { 1 };
                        let parts = (0..tiles).flat_map(|n| (0..set.colors()).map(move |color| (n, color)));
                        for (n, color) in parts {
                            let tile = (tiles > 1).then_some(n);
                            let vertices = match &mut self.columns {
                                Some(columns) => VertexStore::Columns(columns),
                                None => VertexStore::Vertices(vertices),
                            };
                            let color = ConstraintColor { set, color, tile, vertices, step, multipliers };
                            if !color.range().is_empty() {
                                execute.project(color);
                            }
                        }
                    }
                }
                Method::Descend(descent) => {
                    for &pass in self.schedule.color_passes_of(iteration) {
                        execute.descend(VertexColor { system: &mut self.system, descent, pass });
                    }
                }
                Method::Rest => {}
            }
        }
    }
}
