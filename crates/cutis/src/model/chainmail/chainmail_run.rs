//! A simulation by ChainMail: cuts, propagation of drags, relaxation.

use cutis_chainmail::{Drag, LinkViolation, Order, UNITS_PER_STEP};
use cutis_solver::{SolverError, StepProfile};
use cutis_solver_cpu::CpuError;
use nalgebra::{Point3, Vector3};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::device::Relaxer;
use super::wound::ChainWound;
use super::{ChainHandle, ChainmailModel};
use crate::Error;
use crate::body::Body;
use crate::model::{ModelInput, Simulation, SimulationEnd};
use crate::output::report::ChainmailReport;
use crate::run::checkpoint::Checkpoint;

/// Names of the parts of a frame in the cost report.
const CUTS: &str = "cuts";
const PROPAGATION: &str = "propagation";
const RELAXATION: &str = "relaxation";

/// Number of checkpoint words that hold the energy after the last drag.
const ENERGY_WORDS: usize = 2;

/// A chain, the body that it moves, and the state of its frames.
pub(super) struct ChainmailRun<'a> {
    model: ChainmailModel,
    body: &'a Body,
    /// A lattice step along each axis, m.
    steps_m: [Vector3<f64>; 3],
    dt_s: f64,
    order: Order,
    pool: ThreadPool,
    /// Relaxation on a GPU. `None` if the host relaxes the chain.
    relaxer: Option<Relaxer>,
    /// All elements that handles have grabbed.
    held: Vec<u32>,
    /// For each handle that has grabbed its elements, their positions then in units of the chain.
    starts: Vec<Option<Vec<[i32; 3]>>>,
    frame: u32,
    /// The last frame in which a handle moves.
    last_drag: u32,
    /// Number of cuts with a width that have been made.
    cuts_made: usize,
    /// The cuts of no width; none if the scene has none.
    wound: Option<ChainWound<'a>>,
    /// True if relaxation has ended.
    settled: bool,
    report: ChainmailReport,
}

impl<'a> ChainmailRun<'a> {
    /// Prepares the frames. Without `threads`, drags propagate by one queue on one thread.
    pub(super) fn new(
        input: &ModelInput<'a>,
        mut model: ChainmailModel,
        threads: Option<usize>,
        relaxer: Option<Relaxer>,
    ) -> Result<Self, Error> {
        let (body, dt_s) = (input.body, input.scene.solver.dt_s);
        let count = threads.unwrap_or(1);
        let pool = ThreadPoolBuilder::new()
            .num_threads(count)
            .thread_name(|k| format!("cutis-chain-{k}"))
            .build()
            .map_err(|error| CpuError::ThreadPool { threads: count, reason: error.to_string() })?;
        if relaxer.is_none() && model.relax_per_frame > 0 {
            // Builds look-up tables now, so that the first frame takes as long as the others.
            pool.install(|| model.chain.relax(0, &[]));
        }
        let affine = &body.mesh.lattice.grid().affine;
        let origin = affine.to_mm(Point3::origin());
        let step_m =
            |axis| (affine.to_mm(Point3::origin() + Vector3::<f64>::ith(axis, 1.0)) - origin) / 1000.0;
        let end = |handle: &ChainHandle| handle.frame.saturating_add((handle.over_s / dt_s).ceil() as u32);
        Ok(Self {
            steps_m: [0, 1, 2].map(step_m),
            order: if threads.is_some() { Order::Slabs } else { Order::Fifo },
            held: Vec::new(),
            starts: vec![None; model.handles.len()],
            last_drag: model.handles.iter().map(end).max().unwrap_or(0).min(input.scene.run.frames),
            model,
            body,
            dt_s,
            pool,
            relaxer,
            frame: 0,
            cuts_made: 0,
            wound: body.growing.as_ref().map(|cuts| ChainWound::new(cuts, &body.mesh)),
            settled: false,
            report: ChainmailReport::default(),
        })
    }

    /// Makes the cuts that are due at the beginning of a frame. Returns whether there were any that
    /// may have cut a link.
    fn cut(&mut self) -> bool {
        let time_s = f64::from(self.frame) * self.dt_s;
        let first = self.cuts_made;
        while let Some(cut) = self.model.cuts.get(self.cuts_made).filter(|cut| cut.at_s <= time_s) {
            self.report.cut_links += self.model.chain.cut_links(&cut.links);
            self.cuts_made += 1;
        }
        let edges = self.wound.as_mut().map_or_else(Vec::new, |wound| wound.cut_to(time_s));
        let element = |vertex: u32| self.model.elements[vertex as usize];
        let links: Vec<[u32; 2]> = edges.iter().map(|edge| edge.ends.map(element)).collect();
        self.report.cut_links += self.model.chain.cut_links(&links);
        self.cuts_made > first || !links.is_empty()
    }

    /// Lets the handles grab their elements that drag them from the present frame on.
    fn grab(&mut self) {
        let Self { model: ChainmailModel { chain, handles, .. }, starts, held, frame, .. } = self;
        for (handle, start) in handles.iter().zip(starts) {
            if start.is_none() && handle.frame <= *frame {
                *start = Some(handle.elements.iter().map(|&element| chain.units(element)).collect());
                held.extend(&handle.elements);
            }
        }
    }

    /// Targets of the grabbed elements at the end of a frame.
    fn drags(&self, frame: u32) -> Vec<Drag> {
        let mut drags = Vec::with_capacity(self.held.len());
        for (handle, start) in self.model.handles.iter().zip(&self.starts) {
            let Some(start) = start else { continue };
            let time_s = f64::from(frame - handle.frame) * self.dt_s;
            let share = if time_s < handle.over_s { time_s / handle.over_s } else { 1.0 };
            drags.extend(handle.elements.iter().zip(start).map(|(&element, start)| {
                let along = |axis: usize| {
                    f64::from(start[axis]) / f64::from(UNITS_PER_STEP) + share * handle.steps[axis]
                };
                Drag { element, to: [0, 1, 2].map(along) }
            }));
        }
        drags
    }

    /// Moves the handles, and the elements that links pull along.
    fn propagate(&mut self) -> Result<(), Error> {
        let drags = self.drags(self.frame);
        let Self { model, pool, order, .. } = self;
        pool.install(|| model.chain.drag(&drags, *order))?;
        Ok(())
    }

    fn energy(&self) -> f64 {
        self.pool.install(|| self.model.chain.energy_mm2())
    }

    fn relax(&mut self) -> Result<(), Error> {
        let time_s = self.time_s();
        let Self { model: ChainmailModel { chain, relax_per_frame, .. }, pool, relaxer, held, .. } = self;
        let done = match relaxer {
            None => pool.install(|| chain.relax(*relax_per_frame, held)),
            Some(relaxer) => relaxer.relax(chain, *relax_per_frame, held).map_err(|error| {
                Error::Solver(SolverError::Device { backend: "gpu", time_s, reason: error.to_string() })
            })?,
        };
        self.report.relax_sweeps += u64::from(done.sweeps);
        self.report.relax_moves += done.moves;
        self.settled = done.settled;
        Ok(())
    }

    /// Displacement of a vertex in lattice steps. A vertex that is not virtual has that of its
    /// element.
    fn displacement(&self, vertex: u32) -> [f64; 3] {
        let of = |vertex: u32| self.model.chain.displacement(self.model.elements[vertex as usize]);
        let of_node = |wound: &ChainWound<'_>| wound.displacement(vertex, |vertex| of(vertex).into());
        self.wound.as_ref().and_then(of_node).map_or_else(|| of(vertex), Into::into)
    }

    /// Position of a vertex, local meters: exactly the rest position if it has not moved.
    fn position(&self, vertex: u32) -> Point3<f32> {
        let rest = self.body.mesh.positions[vertex as usize];
        match self.displacement(vertex) {
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

    /// Number of elements of the cut body that have left their rest positions.
    fn moved(&self) -> usize {
        let real = self.body.mesh.real_vertices();
        let (chain, elements) = (&self.model.chain, self.model.elements[..real].iter().enumerate());
        let at_rest = |element: u32| chain.displacement(element) == [0.0; 3];
        elements.filter(|&(v, &element)| !self.body.is_removed(v as u32) && !at_rest(element)).count()
    }

    /// Warning about `links` links beyond their limits, with the place that holds an end of the
    /// `worst` one.
    fn reason(&self, links: usize, worst: &LinkViolation) -> String {
        let (lattice, chain) = (&self.body.mesh.lattice, &self.model.chain);
        let ends = [worst.element, worst.next];
        let fixed = ends.into_iter().find(|&end| chain.is_fixed(end));
        let what = if fixed.is_some() { "fixed" } else { "held by a handle" };
        let end = fixed.or_else(|| ends.into_iter().find(|end| self.held.contains(end)));
        let grid = lattice.grid();
        let mm: [f64; 3] = lattice.mm(grid.point(end.unwrap_or(worst.element) as usize)).into();
        let excess = worst.excess * grid.affine.spacing_mm()[worst.axis];
        format!(
            "{links} links are beyond their limits: the vertex at {mm:.1?} mm is {what} and cannot follow, by \
             up to {excess:.2} mm; shorten handle.move_mm, fix less, or allow longer links \
             (chainmail.materials)"
        )
    }
}

impl Simulation for ChainmailRun<'_> {
    fn restore(&mut self, saved: &Checkpoint) -> Result<(), Error> {
        let count = 3 * self.model.elements.len();
        let (units, rest) = saved.words.split_at(count.min(saved.words.len()));
        let (energy, rest) = rest.split_at(ENERGY_WORDS.min(rest.len()));
        let grabbed: usize = self.model.handles.iter().map(|handle| handle.elements.len()).sum();
        let (mut starts, strained) = rest.split_at((3 * grabbed).min(rest.len()));
        let units: Vec<(u32, [i32; 3])> = self
            .model
            .elements
            .iter()
            .zip(units.chunks_exact(3))
            .map(|(&element, at)| (element, [0, 1, 2].map(|axis| at[axis].cast_signed())))
            .collect();
        self.model.chain.restore(&units, strained)?;
        // The checkpoint does not hold the cuts of earlier frames, so they are made again.
        if let Some(last) = saved.frame.checked_sub(1) {
            self.frame = last;
            self.cut();
        }
        for (handle, start) in self.model.handles.iter().zip(&mut self.starts) {
            let (own, others) = starts.split_at((3 * handle.elements.len()).min(starts.len()));
            starts = others;
            if handle.frame < saved.frame {
                *start = Some(own.chunks_exact(3).map(|at| [0, 1, 2].map(|n| at[n].cast_signed())).collect());
                self.held.extend(&handle.elements);
            }
        }
        self.frame = saved.frame;
        self.report.energy_before =
            f64::from_bits(energy.iter().rev().fold(0, |bits, &word| bits << 32 | u64::from(word)));
        Ok(())
    }

    fn step(&mut self) -> Result<(), Error> {
        self.step_timed(&mut StepProfile::default())
    }

    fn step_timed(&mut self, profile: &mut StepProfile) -> Result<(), Error> {
        let mut changed = false;
        if !self.model.cuts.is_empty() || self.wound.is_some() {
            changed = profile.time(CUTS, || self.cut());
        }
        self.grab();
        self.frame += 1;
        if !self.held.is_empty() && (changed || self.frame <= self.last_drag) {
            profile.time(PROPAGATION, || self.propagate())?;
            changed = true;
            if self.frame == self.last_drag {
                self.report.energy_before = self.energy();
            }
        }
        self.settled &= !changed;
        if self.model.relax_per_frame > 0 && !self.settled {
            profile.time(RELAXATION, || self.relax())?;
        }
        Ok(())
    }

    fn parts_are_sequential(&self) -> bool {
        true
    }

    fn time_s(&self) -> f64 {
        f64::from(self.frame) * self.dt_s
    }

    fn positions_of(&mut self, vertices: &[u32]) -> Result<Vec<Point3<f32>>, Error> {
        Ok(vertices.iter().map(|&vertex| self.position(vertex)).collect())
    }

    fn save(&mut self, frame: u32) -> Result<Checkpoint, Error> {
        let chain = &self.model.chain;
        let units = self.model.elements.iter().flat_map(|&element| chain.units(element));
        let energy = self.report.energy_before.to_bits();
        let energy: [u32; ENERGY_WORDS] = [energy as u32, (energy >> 32) as u32];
        let starts = self.model.handles.iter().zip(&self.starts).flat_map(|(handle, start)| {
            let start = |n: usize| start.as_ref().map_or([0; 3], |start| start[n]);
            (0..handle.elements.len()).flat_map(start).map(i32::cast_unsigned).collect::<Vec<u32>>()
        });
        let words = units.map(i32::cast_unsigned).chain(energy).chain(starts);
        let words = words.chain(chain.strained().iter().copied()).collect();
        Ok(Checkpoint::of(frame, self.positions(), words))
    }

    fn end(&mut self) -> Result<SimulationEnd, Error> {
        let violations = self.pool.install(|| self.model.chain.violations());
        let report = ChainmailReport {
            moved: self.moved(),
            violated_links: violations.links,
            energy_after: self.energy(),
            settled: self.settled,
            ..self.report.clone()
        };
        let warnings = violations.worst.iter().map(|worst| self.reason(violations.links, worst));
        Ok(SimulationEnd {
            positions: self.positions(),
            residuals: Vec::new(),
            chainmail: Some(report),
            warnings: warnings.collect(),
        })
    }
}
