//! Several threads move the vertices of one color.
//!
//! Soundness for constraints: (1) A batch checks when it is built that each index is below the
//! number of vertices, and `Groups::verify` checks that no two constraints of one color share a
//! vertex. The fields of a batch are private and never change. (2) [`Colored`] borrows the vertices
//! mutably for its whole lifetime, so that no other code reads or moves them. (3) The chunks are
//! ranges of one color that do not overlap, and [`Shares`] hand out each chunk once. So two threads
//! never access the same vertex or the same multiplier. (4) A batch finds the rows of its
//! runs by comparison of the checked indices, and reads adjacent vertices only where each of them
//! is a vertex of a constraint of the chunk. [`Columns`](crate::Columns) have a place for each
//! vertex.
//!
//! Soundness for vertices: (1) A `Descent` and the system that it was built from are owned by one
//! `Simulation`. Its incidences are those of the system's kinds. `Groups::verify_vertices` checks
//! that no two vertices of a color are in one constraint, and that each vertex occurs once. The
//! teams of a color and its other vertices are the vertices of the group, each once: see
//! `Teams::regroup`. The neighbors of a team are vertices of its constraints.
//! (2) [`ColoredVertices`] borrows the system mutably for its whole lifetime. (3) Each chunk is
//! handed out once. The thread that takes it moves the vertices of the chunk and reads the vertices
//! that share a constraint with them. No other thread moves those meanwhile.
#![allow(unsafe_code)]

mod shared;

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use cutis_constraints::{LaneTask, Lanes, Scalar, SimdLevel};
use nalgebra::{Point3, Vector3};

use crate::batch::{ConstraintChunk, Load, ROW, RUNS, Store, TeamForces, VertexChunk};
use crate::loads::load_of;
use crate::shares::{Shares, chunk};
use crate::teams::{MOST_NEIGHBORS, Neighborhood, TEAM, TEAM_CHUNK};
use crate::{ConstraintColor, ConstraintSet, Descent, Kind, Step, System, Vertex, VertexColor, VertexForce};

pub(crate) use shared::{SharedStore, SharedVertices};

/// Number of constraints of a chunk. Results do not depend on it. Under Miri chunks are small, so
/// that a tiny body has several.
const CHUNK: usize = if cfg!(miri) { 8 } else { 1024 };

/// Number of vertices of a chunk that are in no team. Results do not depend on it.
const VERTEX_CHUNK: usize = if cfg!(miri) { 4 } else { 128 };

/// One color of one kind, shared between the threads that project it.
///
/// ```
/// # use cutis_solver::{Colored, ConstraintColor, Stiffness, Step, SystemBuilder};
/// # use cutis_constraints::Distance;
/// # use nalgebra::Point3;
/// # let positions = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.1, 0.0, 0.0)];
/// # let spring = [[0, 1]];
/// # let groups = cutis_coloring::greedy(&spring, 2)?;
/// # let mut system = SystemBuilder::<f64>::new(&positions, &[0.0, 1.0])?
/// #     .add::<Distance, 2>(&spring, &[[1.0]], Stiffness::pbd(1.0), &groups)?.build();
/// let (vertices, kinds) = system.projection_parts();
/// let (set, step) = (&*kinds[0], Step::Pbd);
/// let vertices = vertices.into();
/// let color = ConstraintColor { set, color: 0, tile: None, vertices, step, multipliers: &mut [] };
/// let color = Colored::new(color, cutis_constraints::SimdLevel::best(), 2);
/// let color = &color;
/// std::thread::scope(|scope| {
///     for worker in 0..2 {
///         scope.spawn(move || while color.project_next_chunk(worker) {});
///     }
/// });
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Colored<'a, T: Scalar> {
    set: &'a dyn ConstraintSet<T>,
    level: SimdLevel,
    step: Step<T>,
    shares: Shares<RUNS>,
    vertices: SharedStore<'a, T>,
    multipliers: *mut T,
    keeps_multipliers: bool,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: threads that share a `Colored` can only take distinct chunks, which access distinct
// vertices and multipliers (see the top of the file). `T` is plain data that any thread may use.
unsafe impl<T: Scalar> Sync for Colored<'_, T> {}

impl<'a, T: Scalar> Colored<'a, T> {
    /// Largest number of constraints of a chunk.
    pub const CHUNK: usize = CHUNK;

    /// Prepares a color for `workers` threads, with the SIMD lanes of `level`.
    ///
    /// # Panics
    /// Panics if the set was built for more vertices than given, or if there are multipliers but
    /// not one per constraint of the set.
    pub fn new(color: ConstraintColor<'a, T>, level: SimdLevel, workers: usize) -> Self {
        let range = color.range();
        let ConstraintColor { set, vertices, step, multipliers, .. } = color;
        assert!(set.vertex_count() <= vertices.len(), "the set refers to vertices that do not exist");
        let keeps_multipliers = !multipliers.is_empty();
        assert!(
            !keeps_multipliers || multipliers.len() == set.len(),
            "expected one multiplier per constraint, or none"
        );
        Self {
            set,
            level,
            step,
            // A share has the same part of the body in each run, and starts with a whole row.
            shares: Shares::new(set.runs(range), workers, CHUNK, ROW),
            vertices: SharedStore::new(vertices),
            multipliers: multipliers.as_mut_ptr(),
            keeps_multipliers,
            borrow: PhantomData,
        }
    }

    /// Takes a free chunk and projects it. Returns `false` if no chunk is left.
    pub fn project_next_chunk(&self, worker: usize) -> bool {
        let Some(range) = self.shares.next(worker) else { return false };
        let multipliers: &mut [T] = if self.keeps_multipliers {
            // SAFETY: the range lies within the set, and there is one multiplier per constraint of
            // the set. The shares hand the range out once, so that no other slice overlaps it.
            unsafe { std::slice::from_raw_parts_mut(self.multipliers.add(range.start), range.len()) }
        } else {
            &mut []
        };
        let chunk = ConstraintChunk { range, vertices: self.vertices.clone(), step: self.step, multipliers };
        self.set.project_shared(self.level, chunk);
        true
    }

    /// Returns the number of chunks, which is an upper bound of the threads that can help.
    pub fn chunks(&self) -> usize {
        self.shares.chunks()
    }
}

/// One color of vertices, shared between the threads that move them.
pub struct ColoredVertices<'a, T: Scalar> {
    kinds: &'a [Kind<T>],
    level: SimdLevel,
    descent: &'a Descent<T>,
    teams: Range<usize>,
    /// The vertices that are in no team.
    others: &'a [u32],
    next: AtomicUsize,
    previous: &'a [Point3<T>],
    velocities: &'a [Vector3<T>],
    loads: &'a [Vector3<T>],
    vertices: *mut Vertex<T>,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: threads that share it can only take distinct chunks (see the top of the file).
unsafe impl<T: Scalar> Sync for ColoredVertices<'_, T> {}

impl<'a, T: Scalar> ColoredVertices<'a, T> {
    /// Prepares a color for several threads, with the SIMD lanes of `level`.
    pub fn new(color: VertexColor<'a, T>, level: SimdLevel) -> Self {
        let VertexColor { system, descent, pass } = color;
        let System { vertices, previous, velocities, loads, kinds, .. } = system;
        let all = &descent.groups().order[pass.start..pass.end];
        Self {
            kinds,
            level,
            descent,
            teams: descent.teams().range(pass.color),
            others: descent.teams().others(pass.color).unwrap_or(all),
            next: AtomicUsize::new(0),
            previous,
            velocities,
            loads,
            vertices: vertices.as_mut_ptr(),
            borrow: PhantomData,
        }
    }

    /// Takes the next free chunk and moves its vertices. Returns `false` if no chunk is left.
    pub fn move_next_chunk(&self) -> bool {
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let first = self.teams.len().div_ceil(TEAM_CHUNK);
        if let Some(teams) = chunk(number, &self.teams, TEAM_CHUNK) {
            teams.for_each(|team| self.move_team(team));
        } else if let Some(range) = chunk(number - first, &(0..self.others.len()), VERTEX_CHUNK) {
            self.move_others(&self.others[range]);
        } else {
            return false;
        }
        true
    }

    /// Moves the vertices of a team, if it is not dissolved.
    fn move_team(&self, team: usize) {
        let teams = self.descent.teams();
        let Some((count, neighbors)) = teams.neighbors(team) else { return };
        let mut around = [[[T::zero(); TEAM]; 3]; MOST_NEIGHBORS];
        T::in_lanes(self.level, Gather { neighbors, vertices: self.shared(), around: &mut around });
        let mut forces = TeamForces::none();
        for (number, kind) in self.kinds.iter().enumerate() {
            kind.team_forces(self.level, &teams.constraints(number, team, &around), &mut forces);
        }
        let team = &neighbors[0][..count];
        T::in_lanes(self.level, MoveTeam { color: self, team, around: &around[0], forces: &forces });
    }

    /// Moves vertices that are in no team.
    fn move_others(&self, indices: &[u32]) {
        let mut forces = [VertexForce::none(); VERTEX_CHUNK];
        let forces = &mut forces[..indices.len()];
        for (kind, incidence) in self.kinds.iter().zip(self.descent.incidences()) {
            let chunk = VertexChunk { incidence, indices, vertices: self.shared(), forces };
            kind.vertex_forces_shared(self.level, chunk);
        }
        for (&index, force) in indices.iter().zip(forces) {
            self.move_vertex(index, force);
        }
    }

    fn move_vertex(&self, index: u32, force: &VertexForce<T>) {
        let i = index as usize;
        let (previous, velocity) = (&self.previous[i], &self.velocities[i]);
        let mut vertices = self.shared();
        let (vertex, load) = (vertices.load(index), load_of(self.loads, i));
        vertices.store(index, self.descent.step().moved(vertex, previous, velocity, force, load));
    }

    fn shared(&self) -> SharedVertices<'_, T> {
        SharedVertices::new(self.vertices)
    }

    /// Returns the number of chunks, which is an upper bound of the threads that can help.
    pub fn chunks(&self) -> usize {
        self.teams.len().div_ceil(TEAM_CHUNK) + self.others.len().div_ceil(VERTEX_CHUNK)
    }
}

/// Reads the positions of all vertices around a team.
struct Gather<'a, T> {
    neighbors: &'a [[u32; TEAM]],
    vertices: SharedVertices<'a, T>,
    around: &'a mut Neighborhood<T>,
}

impl<T: Scalar> LaneTask<T> for Gather<'_, T> {
    #[inline(always)]
    fn run<L: Lanes<T>>(self) {
        let Self { neighbors, vertices, around } = self;
        for (vertex, around) in neighbors.iter().zip(around) {
            for first in (0..TEAM).step_by(L::LANES) {
                let lanes = &vertex[first..first + L::LANES];
                let columns = L::columns(|lane| vertices.load(lanes[lane]).components());
                for axis in 0..3 {
                    for lane in 0..L::LANES {
                        around[axis][first + lane] = columns[axis].extract(lane);
                    }
                }
            }
        }
    }
}

/// Moves the vertices of a team.
struct MoveTeam<'a, 'b, T: Scalar> {
    color: &'a ColoredVertices<'b, T>,
    team: &'a [u32],
    /// Positions of the vertices.
    around: &'a [[T; TEAM]; 3],
    forces: &'a TeamForces<T>,
}

impl<T: Scalar> LaneTask<T> for MoveTeam<'_, '_, T> {
    #[inline(always)]
    fn run<L: Lanes<T>>(self) {
        let Self { color, team, around, forces } = self;
        let step = color.descent.step().splat::<L>();
        let mut vertices = color.shared();
        for (part, team) in team.chunks(L::LANES).enumerate() {
            let first = part * L::LANES;
            // Excess lanes repeat the last vertex.
            let of = |lane: usize| team[lane.min(team.len() - 1)] as usize;
            let x = vector::<L, T>(|lane, axis| around[axis][first + lane]);
            let inverse_mass = L::from_lanes(|lane| vertices.load(of(lane) as u32).inverse_mass());
            let previous = vector::<L, T>(|lane, axis| color.previous[of(lane)][axis]);
            let velocity = vector::<L, T>(|lane, axis| color.velocities[of(lane)][axis]);
            let load = vector::<L, T>(|lane, axis| load_of(color.loads, of(lane))[axis]);
            let force = forces.lanes::<L>(first);
            let moved = step.step(x.into(), inverse_mass, &previous.into(), &velocity, &force, load);
            L::rows([moved.x, moved.y, moved.z, inverse_mass], |lane, components| {
                if let Some(&vertex) = team.get(lane) {
                    vertices.store(vertex, Vertex::from_components(components));
                }
            });
        }
    }
}

/// One vector per lane. `component(lane, axis)` returns its components.
#[inline(always)]
fn vector<L: Lanes<T>, T: Scalar>(component: impl Fn(usize, usize) -> T) -> Vector3<L> {
    Vector3::new(
        L::from_lanes(|lane| component(lane, 0)),
        L::from_lanes(|lane| component(lane, 1)),
        L::from_lanes(|lane| component(lane, 2)),
    )
}

#[cfg(test)]
mod tests;
