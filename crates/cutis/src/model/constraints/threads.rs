//! The threads of sutures: when they pull, how long they are, and the force in them.

use std::collections::HashMap;

use cutis_coloring::Groups;
use cutis_constraints::Thread;
use cutis_mesh::{Stitch, TetMesh};
use cutis_solver::{Formulation, Kind, Stiffness, SystemBuilder, Values};
use nalgebra::Point3;

use super::coloring;
use crate::Error;
use crate::model::ModelInput;
use crate::scene::SutureSection;

/// Length of a thread that does not pull, m.
const SLACK: f32 = 1e3;

/// Returns the present positions of vertices.
type PositionsOf<'a> = dyn FnMut(&[u32]) -> Result<Vec<Point3<f32>>, Error> + 'a;

/// The threads of all sutures.
pub(crate) struct Threads {
    /// Builds constraints; none after an error.
    builder: Option<SystemBuilder<f32>>,
    groups: Groups,
    stiffness: Stiffness<f32>,
    vertices: Vec<[u32; 6]>,
    /// Number of the kind in the system.
    pub(crate) kind: usize,
    threads: Vec<ThreadState>,
}

/// One thread.
struct ThreadState {
    suture: usize,
    stitch: Stitch,
    /// Distance of its ends when it began to pull, m.
    start: Option<f32>,
    /// Present length, m.
    length: f32,
}

impl Threads {
    /// The threads of a body; none if the scene has no sutures.
    ///
    /// # Errors
    /// The errors of the solver.
    pub(crate) fn new(input: &ModelInput<'_>, kind: usize) -> Result<Option<Self>, Error> {
        let (body, scene) = (input.body, input.scene);
        let numbered = body.stitches.iter().enumerate();
        let all =
            numbered.flat_map(|(suture, stitches)| stitches.iter().map(move |stitch| (suture, *stitch)));
        let threads: Vec<ThreadState> =
            all.map(|(suture, stitch)| ThreadState { suture, stitch, start: None, length: SLACK }).collect();
        if threads.is_empty() {
            return Ok(None);
        }
        let vertices: Vec<[u32; 6]> = threads.iter().map(|thread| thread.stitch.vertices()).collect();
        let count = body.mesh.positions.len();
        let compliance = |thread: &ThreadState| 1.0 / scene.suture[thread.suture].thread_n_per_m as f32;
        let stiffness = match scene.solver.formulation {
            Formulation::Pbd => Stiffness::pbd(1.0),
            Formulation::Xpbd | Formulation::Vbd => {
                Stiffness::Compliance(Values::Each(threads.iter().map(compliance).collect()))
            }
        };
        let groups = coloring::of_mesh(&vertices, count)?;
        let builder = Some(SystemBuilder::in_place(&body.mesh.positions, &vec![0.0_f32; count])?);
        Ok(Some(Self { builder, groups, stiffness, vertices, kind, threads }))
    }

    /// The constraints with the present lengths.
    ///
    /// # Errors
    /// The errors of the solver.
    pub(crate) fn constraints(&mut self, input: &ModelInput<'_>) -> Result<Kind<f32>, Error> {
        let positions = &input.body.mesh.positions;
        let builder = match self.builder.take() {
            Some(builder) => builder,
            None => SystemBuilder::in_place(positions, &vec![0.0_f32; positions.len()])?,
        };
        let params: Vec<[f32; 5]> = self.threads.iter().map(ThreadState::params).collect();
        let stiffness = self.stiffness.clone();
        let mut builder = builder.add::<Thread, 6>(&self.vertices, &params, stiffness, &self.groups)?;
        let kind = builder.take_kinds().remove(0);
        self.builder = Some(builder);
        Ok(kind)
    }

    /// Sets the lengths at a time in s. Returns whether one changed. `positions_of` returns the
    /// present positions of vertices, for threads that begin to pull.
    ///
    /// # Errors
    /// The errors of `positions_of`.
    pub(crate) fn tighten(
        &mut self,
        sutures: &[SutureSection],
        time_s: f64,
        positions_of: &mut PositionsOf<'_>,
    ) -> Result<bool, Error> {
        let mut changed = false;
        for (thread, vertices) in self.threads.iter_mut().zip(&self.vertices) {
            let suture = &sutures[thread.suture];
            let pulls = time_s >= suture.at_s && suture.release_s.is_none_or(|release| time_s < release);
            let length = if pulls {
                if thread.start.is_none() {
                    thread.start = Some(thread.distance(&positions_of(vertices)?));
                }
                let part = ((time_s - suture.at_s) / suture.tighten_s).min(1.0);
                let part = if part.is_finite() { part as f32 } else { 1.0 };
                thread.length_at(part, suture.tighten_to as f32)
            } else {
                SLACK
            };
            changed |= length != thread.length;
            thread.length = length;
        }
        Ok(changed)
    }

    /// Force in each thread in N, at these positions of [`Threads::vertices`].
    pub(crate) fn forces(&self, positions: &[Point3<f32>]) -> Vec<f64> {
        let Stiffness::Compliance(compliance) = &self.stiffness else { return Vec::new() };
        let force = |(n, (thread, x)): (usize, (&ThreadState, &[Point3<f32>]))| {
            f64::from((thread.distance(x) - thread.length).max(0.0)) / f64::from(compliance.at(n))
        };
        self.threads.iter().zip(positions.chunks_exact(6)).enumerate().map(force).collect()
    }

    /// The number of the suture of each thread.
    pub(crate) fn sutures(&self) -> impl Iterator<Item = usize> + '_ {
        self.threads.iter().map(|thread| thread.suture)
    }

    /// The number of threads.
    pub(crate) fn count(&self) -> usize {
        self.threads.len()
    }

    /// The vertices of all threads, six for each.
    pub(crate) fn vertices(&self) -> &[u32] {
        self.vertices.as_flattened()
    }

    /// Distances at which the threads began to pull, for a checkpoint.
    pub(crate) fn starts(&self) -> impl Iterator<Item = u32> + '_ {
        self.threads.iter().map(|thread| thread.start.unwrap_or(f32::NAN).to_bits())
    }

    /// Restores the distances of a checkpoint.
    pub(crate) fn restore(&mut self, starts: &[u32]) {
        for (thread, &start) in self.threads.iter_mut().zip(starts) {
            thread.start = Some(f32::from_bits(start)).filter(|start| !start.is_nan());
        }
    }
}

impl ThreadState {
    fn params(&self) -> [f32; 5] {
        let [[a, b], [c, d]] = self.stitch.weights.map(|end| end.map(|weight| weight as f32));
        [a, b, c, d, self.length]
    }

    fn distance(&self, x: &[Point3<f32>]) -> f32 {
        Thread::distance(&std::array::from_fn(|n| x[n]), &self.params())
    }

    /// Length after a part of the tightening, from 0 to 1. In the end it is `to` times the distance
    /// of the ends when the wound is closed.
    fn length_at(&self, part: f32, to: f32) -> f32 {
        let end = self.stitch.closed as f32 * to;
        let start = self.start.unwrap_or(end).max(end);
        start + (end - start) * part
    }
}

/// Gives the vertices at the right ends of stitches colors of their own: a thread joins vertices
/// that have one color in the lattice.
pub(crate) fn separate(colors: &mut [u16], mesh: &TetMesh, stitches: &[&Stitch]) {
    let first = colors.iter().max().map_or(0, |most| most + 1);
    let mut moved: Vec<u32> = Vec::new();
    let neighbors = |a: u32, b: u32| {
        let (p, q) = (mesh.point(a), mesh.point(b));
        p.iter().zip(q).all(|(p, q)| p.abs_diff(q) <= 1)
    };
    let mut joined: HashMap<u32, Vec<u32>> = HashMap::new();
    for vertices in stitches.iter().map(|stitch| stitch.vertices()) {
        vertices.iter().for_each(|&vertex| joined.entry(vertex).or_default().extend(vertices));
    }
    let stitched = |a: u32, b: u32| joined.get(&a).is_some_and(|others| others.contains(&b));
    for vertex in stitches.iter().flat_map(|stitch| stitch.triangles[1]) {
        if moved.contains(&vertex) {
            continue;
        }
        let meets = |other: &&u32| neighbors(vertex, **other) || stitched(vertex, **other);
        let taken: Vec<u16> = moved.iter().filter(meets).map(|&other| colors[other as usize]).collect();
        let free = (first..).find(|color| !taken.contains(color));
        colors[vertex as usize] = free.expect("there are more colors than vertices in the threads");
        moved.push(vertex);
    }
}
