//! A body as energies: constraints, weights and loads.

use std::sync::Arc;

use cutis_coloring::Tuples;
use cutis_constraints::Scalar;
use cutis_solver::System;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::RestError;
use crate::blocks::ROWS;
use crate::constraints::Constraints;
use crate::curvature::is_curved;
use crate::elements::{Elements, Parts, joined};
use crate::energy::State;
use crate::order::near_neighbors;
use crate::settle::diagonal;
use crate::symmetric::Neighbors;

/// Mark of a vertex that cannot move.
pub(crate) const FIXED: u32 = u32::MAX;

/// The energies of a system in double precision. Vertices with inverse mass 0 are fixed.
pub struct Body {
    pub(crate) kinds: Vec<Elements>,
    /// The vertices that can move, in the order of [`near_neighbors`].
    pub(crate) free: Vec<u32>,
    /// For each vertex its place in `free`, or [`FIXED`].
    pub(crate) place: Vec<u32>,
    /// For each free vertex the places of the free ones that share a constraint with it.
    pub(crate) neighbors: Arc<Neighbors>,
    /// How the free vertices are divided.
    pub(crate) parts: Parts,
    /// Weight and load of each free vertex in N.
    pub(crate) weights: Vec<Vector3<f64>>,
    /// Origin of the positions, in the caller's coordinates.
    pub(crate) origin: Vector3<f64>,
    /// Positions of all vertices relative to the origin, in m.
    pub(crate) start: Vec<Point3<f64>>,
    /// Longest displacement of a vertex in a step: half of the diagonal of the body, in m.
    pub(crate) reach_m: f64,
    /// The GPU on which searches solve their equations. None for the CPU.
    #[cfg(feature = "gpu")]
    pub(crate) gpu: Option<crate::RestGpu>,
}

impl Body {
    /// The energies of a system, with its positions, parameters, stiffnesses and loads, under a
    /// gravity in m/s².
    ///
    /// # Errors
    /// [`RestError::Value`] for a gravity that is not finite, [`RestError::PbdStiffness`],
    /// [`RestError::Rigid`], [`RestError::NothingMoves`].
    pub fn of<T: Scalar>(system: &System<T>, gravity_m_s2: [f64; 3]) -> Result<Self, RestError> {
        for value in gravity_m_s2 {
            if !value.is_finite() {
                let (what, expected) = ("gravity_m_s2", "three finite numbers");
                return Err(RestError::Value { what, value, expected });
            }
        }
        let vertices = system.vertices();
        let mut place = vec![FIXED; vertices.len()];
        let start: Vec<Point3<f64>> =
            vertices.par_iter().with_min_len(ROWS).map(|vertex| vertex.position().map(T::to_f64)).collect();
        let inverse_mass = |v: u32| vertices[v as usize].inverse_mass().to_f64();
        let free: Vec<u32> = (0..vertices.len() as u32).filter(|&v| inverse_mass(v) > 0.0).collect();
        if free.is_empty() {
            return Err(RestError::NothingMoves { vertices: vertices.len() });
        }
        let tuples: Vec<_> = system
            .kinds()
            .iter()
            .map(|kind| Tuples { vertices: kind.indices(), arity: kind.arity() })
            .collect();
        let free = near_neighbors(free, &tuples, vertices.len());
        for (n, &v) in free.iter().enumerate() {
            place[v as usize] = n as u32;
        }
        let weight = |&v: &u32| {
            let load = system.loads().get(v as usize).map(|load| load.map(T::to_f64)).unwrap_or_default();
            Vector3::from(gravity_m_s2) / inverse_mass(v) + load
        };
        let weights = free.par_iter().with_min_len(ROWS).map(weight).collect();
        let kinds: Vec<Arc<dyn Constraints>> = system
            .kinds()
            .iter()
            .map(|kind| {
                Constraints::check(kind)?;
                Ok(Arc::new(kind.clone()) as Arc<dyn Constraints>)
            })
            .collect::<Result<_, RestError>>()?;
        let parts = Parts::of(free.len(), &kinds, &place);
        let divided = |kind: Arc<dyn Constraints>| {
            let curved = is_curved(&*kind, &start);
            Elements::new(kind, curved, &place, parts)
        };
        let kinds: Vec<Elements> = kinds.into_iter().map(divided).collect();
        let neighbors = Arc::new(neighbors(&kinds, &place, free.len(), parts));
        let origin = system.origin().coords.map(T::to_f64);
        let reach_m = 0.5 * diagonal(&start);
        Ok(Self {
            kinds,
            free,
            place,
            neighbors,
            parts,
            weights,
            origin,
            start,
            reach_m,
            #[cfg(feature = "gpu")]
            gpu: None,
        })
    }

    /// The same body, whose searches solve their equations on a GPU.
    ///
    /// The CPU computes forces and matrices, so that third-party types of constraints need no
    /// shader for this. Only the matrices go to the device, and only the solution comes back, with
    /// some sums in each cycle. See [`RestGpu`](crate::RestGpu) for the memory and the agreement
    /// with the CPU. Bodies that share a `RestGpu` share its kernels.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub fn on_gpu(self, gpu: &crate::RestGpu) -> Self {
        Self { gpu: Some(gpu.clone()), ..self }
    }

    /// Memory of a search in bytes per vertex that can move, about, besides the system. The demo
    /// took 1.5 to 1.6 kB, with 0.07 to 2.6 million vertices.
    pub const SEARCH_BYTES_PER_VERTEX: usize = 1600;

    /// Places of the vertices that can move.
    pub(crate) fn places(&self, state: &State) -> Vec<Point3<f64>> {
        self.free.par_iter().with_min_len(ROWS).map(|&v| state.x[v as usize]).collect()
    }

    /// Whether a vertex cannot move.
    pub(crate) fn is_fixed(&self, vertex: usize) -> bool {
        self.place[vertex] == FIXED
    }

    /// Number of vertices that can move.
    pub fn free_count(&self) -> usize {
        self.free.len()
    }
}

/// See [`Body::neighbors`].
fn neighbors(kinds: &[Elements], place: &[u32], free: usize, parts: Parts) -> Neighbors {
    // The later neighbors.
    let of_part = |rows: &mut Vec<Vec<u32>>, part: usize| -> (Vec<usize>, Vec<u32>) {
        let range = part * parts.size..((part + 1) * parts.size).min(free);
        rows.resize(range.len(), Vec::new());
        rows.iter_mut().for_each(Vec::clear);
        for elements in kinds {
            // In a lattice the next constraint has its neighbors at the same places of the rows.
            let mut slots = vec![0; elements.kind.arity().pow(2)];
            for &k in elements.of_part(part) {
                let vertices = elements.vertices(k as usize);
                for (own, &vertex) in vertices.iter().enumerate() {
                    let own_place = place[vertex as usize] as usize;
                    if !range.contains(&own_place) {
                        continue;
                    }
                    let row = &mut rows[own_place - range.start];
                    let slots = &mut slots[own * vertices.len()..][..vertices.len()];
                    for (slot, &other) in slots.iter_mut().zip(vertices) {
                        let column = place[other as usize];
                        let is_later = column != FIXED && column as usize > own_place;
                        if is_later && row.get(*slot) != Some(&column) {
                            *slot = row.iter().position(|&known| known == column).unwrap_or(row.len());
                            if *slot == row.len() {
                                row.push(column);
                            }
                        }
                    }
                }
            }
        }
        rows.iter_mut().for_each(|row| row.sort_unstable());
        (rows.iter().map(Vec::len).collect(), rows.concat())
    };
    let (counts, columns): (Vec<_>, Vec<_>) =
        (0..parts.count).into_par_iter().map_init(Vec::new, of_part).unzip();
    let mut starts = Vec::with_capacity(free + 1);
    starts.push(0);
    for count in counts.iter().flatten() {
        starts.push(starts[starts.len() - 1] + count);
    }
    Neighbors::from_later(starts, &joined(columns).1)
}
