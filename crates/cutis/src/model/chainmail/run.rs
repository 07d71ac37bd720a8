//! A body that follows as a chain.

use cutis_chainmail::{Drag, LinkViolation, Order};
use cutis_solver::{SolverError, StepProfile};
use cutis_solver_cpu::CpuError;
use nalgebra::{Point3, Vector3};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::Error;
use crate::backend::Relaxer;
use crate::body::Body;
use crate::model::chainmail::chain::{ChainBody, ChainHandle};
use crate::model::{End, Motion};
use crate::report::ChainmailReport;
use crate::run::checkpoint::Checkpoint;
use crate::scene::LoadedScene;

/// Parts of a frame, as the cost report names them.
const CUTS: &str = "cuts";
const PROPAGATION: &str = "propagation";
const RELAXATION: &str = "relaxation";

/// Words of a checkpoint that the energy after the last drag takes.
const ENERGY_WORDS: usize = 2;

/// A chain, the body that it moves, and how far the frames have come.
pub(crate) struct Chained<'a> {
    chain: ChainBody,
    body: &'a Body,
    /// A step along each axis of the lattice, m.
    steps_m: [Vector3<f64>; 3],
    dt_s: f64,
    order: Order,
    pool: ThreadPool,
    /// Relaxation on a device.
    relaxer: Option<Relaxer>,
    /// Every element that a handle grabs.
    held: Vec<u32>,
    frame: u32,
    /// The last frame in which a handle moves.
    last_drag: u32,
    /// Cuts that are made.
    cuts_made: usize,
    /// Nothing relaxes any more.
    settled: bool,
    told: ChainmailReport,
}

impl<'a> Chained<'a> {
    /// `threads`: none for one queue on one thread.
    pub(crate) fn new(
        loaded: &LoadedScene,
        mut chain: ChainBody,
        body: &'a Body,
        threads: Option<usize>,
        relaxer: Option<Relaxer>,
    ) -> Result<Self, Error> {
        let count = threads.unwrap_or(1);
        let pool = ThreadPoolBuilder::new()
            .num_threads(count)
            .thread_name(|k| format!("cutis-chain-{k}"))
            .build()
            .map_err(|error| CpuError::ThreadPool { threads: count, reason: error.to_string() })?;
        if relaxer.is_none() && chain.relax_per_frame > 0 {
            // What is looked up once is no part of the first frame.
            pool.install(|| chain.chain.relax(0, &[]));
        }
        let affine = &body.mesh.lattice.grid().affine;
        let origin = affine.to_mm(Point3::origin());
        let step_m =
            |axis| (affine.to_mm(Point3::origin() + Vector3::<f64>::ith(axis, 1.0)) - origin) / 1000.0;
        let dt_s = loaded.scene.solver.dt_s;
        let frames = |handle: &ChainHandle| (handle.over_s / dt_s).ceil() as u32;
        Ok(Self {
            steps_m: [0, 1, 2].map(step_m),
            order: if threads.is_some() { Order::Slabs } else { Order::Fifo },
            held: chain.handles.iter().flat_map(|handle| handle.elements.iter().copied()).collect(),
            last_drag: chain.handles.iter().map(frames).max().unwrap_or(0).min(loaded.scene.run.frames),
            chain,
            body,
            dt_s,
            pool,
            relaxer,
            frame: 0,
            cuts_made: 0,
            settled: false,
            told: ChainmailReport::default(),
        })
    }

    /// Makes the cuts that are due at the beginning of a frame; whether there were any.
    fn cut(&mut self) -> bool {
        let time_s = f64::from(self.frame) * self.dt_s;
        let first = self.cuts_made;
        while let Some(cut) = self.chain.cuts.get(self.cuts_made).filter(|cut| cut.at_s <= time_s) {
            self.told.cut_links += self.chain.chain.cut_links(&cut.links);
            self.cuts_made += 1;
        }
        self.cuts_made > first
    }

    /// Where the handles are at the end of a frame.
    fn drags(&self, frame: u32) -> Vec<Drag> {
        let (grid, time_s) = (self.body.mesh.lattice.grid(), f64::from(frame) * self.dt_s);
        let mut drags = Vec::with_capacity(self.held.len());
        for handle in &self.chain.handles {
            let share = if time_s < handle.over_s { time_s / handle.over_s } else { 1.0 };
            drags.extend(handle.elements.iter().map(|&element| {
                let rest = grid.point(element as usize);
                Drag { element, to: [0, 1, 2].map(|axis| rest[axis] as f64 + share * handle.steps[axis]) }
            }));
        }
        drags
    }

    /// Carries the handles on, and whatever their links pull along.
    fn propagate(&mut self) -> Result<(), Error> {
        let drags = self.drags(self.frame);
        let Self { chain: ChainBody { chain, .. }, pool, order, .. } = self;
        pool.install(|| chain.drag(&drags, *order))?;
        Ok(())
    }

    fn energy(&self) -> f64 {
        self.pool.install(|| self.chain.chain.energy_mm2())
    }

    fn relax(&mut self) -> Result<(), Error> {
        let time_s = self.time_s();
        let Self { chain: ChainBody { chain, relax_per_frame, .. }, pool, relaxer, held, .. } = self;
        let done = match relaxer {
            None => pool.install(|| chain.relax(*relax_per_frame, held)),
            Some(relaxer) => relaxer.relax(chain, *relax_per_frame, held).map_err(|error| {
                Error::Solver(SolverError::Device { backend: "gpu", time_s, reason: error.to_string() })
            })?,
        };
        self.told.relax_sweeps += u64::from(done.sweeps);
        self.told.relax_moves += done.moves;
        self.settled = done.settled;
        Ok(())
    }

    /// Where a vertex is: exactly where it was, unless it moved.
    fn position(&self, vertex: u32) -> Point3<f32> {
        let rest = self.body.mesh.positions[vertex as usize];
        match self.chain.chain.displacement(self.chain.elements[vertex as usize]) {
            [0.0, 0.0, 0.0] => rest,
            by => {
                let moved = (0..3).fold(rest.cast::<f64>(), |at, axis| at + self.steps_m[axis] * by[axis]);
                moved.cast()
            }
        }
    }

    fn positions(&self) -> Vec<Point3<f32>> {
        (0..self.body.mesh.positions.len() as u32).map(|vertex| self.position(vertex)).collect()
    }

    /// Elements of the cut body that are not where they rest.
    fn moved(&self) -> usize {
        let (chain, elements) = (&self.chain.chain, self.chain.elements.iter().enumerate());
        let stays = |element: u32| chain.displacement(element) == [0.0; 3];
        elements.filter(|&(v, &element)| !self.body.is_removed(v as u32) && !stays(element)).count()
    }

    /// Why links are beyond their limits: `worst` and what holds one of its ends.
    fn reason(&self, links: usize, worst: &LinkViolation) -> String {
        let (lattice, chain) = (&self.body.mesh.lattice, &self.chain.chain);
        let ends = [worst.element, worst.next];
        let fixed = ends.into_iter().find(|&end| chain.is_fixed(end));
        let what = if fixed.is_some() { "fixed" } else { "held by a handle" };
        let end = fixed.or_else(|| ends.into_iter().find(|end| self.held.contains(end)));
        let grid = lattice.grid();
        let mm: [f64; 3] = lattice.mm(grid.point(end.unwrap_or(worst.element) as usize)).into();
        let excess = worst.excess * grid.affine.spacing_mm()[worst.axis];
        format!(
            "{links} links are beyond their limits: what rests at {mm:.1?} mm is {what} and cannot follow, by up to {excess:.2} mm; \
             shorten handle.move_mm, fix less, or let links give way further (chainmail.materials)"
        )
    }
}

impl Motion for Chained<'_> {
    fn restore(&mut self, saved: &Checkpoint) -> Result<(), Error> {
        let count = 3 * self.chain.elements.len();
        let (units, rest) = saved.words.split_at(count.min(saved.words.len()));
        let (energy, strained) = rest.split_at(ENERGY_WORDS.min(rest.len()));
        let units: Vec<(u32, [i32; 3])> = self
            .chain
            .elements
            .iter()
            .zip(units.chunks_exact(3))
            .map(|(&element, at)| (element, [0, 1, 2].map(|axis| at[axis].cast_signed())))
            .collect();
        self.chain.chain.restore(&units, strained)?;
        // What the frames before cut is cut again: a state of its own, which no drag has to follow.
        if let Some(last) = saved.frame.checked_sub(1) {
            self.frame = last;
            self.cut();
        }
        self.frame = saved.frame;
        self.told.energy_before =
            f64::from_bits(energy.iter().rev().fold(0, |bits, &word| bits << 32 | u64::from(word)));
        Ok(())
    }

    fn step(&mut self) -> Result<(), Error> {
        self.step_timed(&mut StepProfile::default())
    }

    fn step_timed(&mut self, profile: &mut StepProfile) -> Result<(), Error> {
        let mut changed = false;
        if !self.chain.cuts.is_empty() {
            changed = profile.time(CUTS, || self.cut());
        }
        self.frame += 1;
        if !self.held.is_empty() && (changed || self.frame <= self.last_drag) {
            profile.time(PROPAGATION, || self.propagate())?;
            changed = true;
            if self.frame == self.last_drag {
                self.told.energy_before = self.energy();
            }
        }
        self.settled &= !changed;
        if self.chain.relax_per_frame > 0 && !self.settled {
            profile.time(RELAXATION, || self.relax())?;
        }
        Ok(())
    }

    fn waits(&self) -> bool {
        true
    }

    fn time_s(&self) -> f64 {
        f64::from(self.frame) * self.dt_s
    }

    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, Error> {
        Ok(vertices.iter().map(|&vertex| self.position(vertex)).collect())
    }

    fn save(&mut self, frame: u32) -> Result<Checkpoint, Error> {
        let chain = &self.chain.chain;
        let units = self.chain.elements.iter().flat_map(|&element| chain.units(element));
        let energy = self.told.energy_before.to_bits();
        let energy: [u32; ENERGY_WORDS] = [energy as u32, (energy >> 32) as u32];
        let words =
            units.map(i32::cast_unsigned).chain(energy).chain(chain.strained().iter().copied()).collect();
        Ok(Checkpoint { frame, positions: self.positions(), words })
    }

    fn end(&mut self) -> Result<End, Error> {
        let violations = self.pool.install(|| self.chain.chain.violations());
        let told = ChainmailReport {
            moved: self.moved(),
            violated_links: violations.links,
            energy_after: self.energy(),
            settled: self.settled,
            ..self.told.clone()
        };
        let warnings = violations.worst.iter().map(|worst| self.reason(violations.links, worst));
        Ok(End {
            positions: self.positions(),
            residuals: Vec::new(),
            chainmail: Some(told),
            warnings: warnings.collect(),
        })
    }
}
