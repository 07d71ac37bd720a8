//! The energy of a body at one placement of its vertices, and the forces.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::Body;
use crate::blocks::ROWS;
use crate::constraints::{Evaluation, GROUP};
use crate::elements::Elements;
use crate::vectors::sum;

/// The values of all constraints, and the forces.
#[derive(Default)]
pub(crate) struct State {
    /// Positions of all vertices.
    pub x: Vec<Point3<f64>>,
    /// For each part of the free vertices, `C` of the constraints that it owns, kind by kind.
    values: Vec<Arc<Vec<f64>>>,
    /// For each part, the squares of the forces, of their sizes and of their rounding, and the
    /// energy of the rounding.
    sums: Vec<[f64; 4]>,
    /// `−∇U` at each free vertex, in N.
    pub forces: Vec<Vector3<f64>>,
    /// Norm of the forces in N.
    pub norm: f64,
    /// Norm of the sums of the sizes of all forces at each free vertex, in N.
    pub scale: f64,
    /// Norm of the forces that rounded positions alone can cause, in N.
    pub floor: f64,
    /// Change of the energy that rounding alone can cause, in J.
    pub noise: f64,
}

impl State {
    /// Whether all forces are finite.
    pub fn is_finite(&self) -> bool {
        self.norm.is_finite() && self.noise.is_finite()
    }
}

/// The forces on a part of the free vertices while they add up.
struct PartSums<'a> {
    /// Place of the first vertex.
    start: usize,
    forces: &'a mut [Vector3<f64>],
    /// Sums of the sizes of the forces at each vertex, and of their rounding.
    sizes: Vec<[f64; 2]>,
    /// Energy of the rounding.
    noise: f64,
}

/// How much a constraint changes if each coordinate of its vertices changes by its own size.
#[inline(always)]
fn reach(places: &[Point3<f64>], gradients: &[Vector3<f64>]) -> f64 {
    gradients.iter().zip(places).map(|(g, x)| norm_1(g) * norm_1(&x.coords)).sum()
}

impl Body {
    /// Evaluates all constraints.
    pub(crate) fn at(&self, x: Vec<Point3<f64>>) -> State {
        self.evaluated_again(State { x, ..State::default() })
    }

    /// Evaluates all constraints at the positions of a state, whose memory is used again.
    fn evaluated_again(&self, mut memory: State) -> State {
        let parts = self.parts.count;
        memory.values.resize(parts, Arc::default());
        memory.sums.resize(parts, [0.0; 4]);
        memory.forces.resize(self.free.len(), Vector3::zeros());
        self.evaluated(memory, &vec![true; parts])
    }

    /// Moves the free vertices at some places from `state` to their positions in `x`. Only the
    /// parts with a constraint at one of them are evaluated.
    pub(crate) fn with_moved(&self, state: &State, x: Vec<Point3<f64>>, places: &[u32]) -> State {
        let mut touched = vec![false; state.values.len()];
        for &place in places {
            touched[self.parts.at(place)] = true;
            self.neighbors.of(place as usize).iter().for_each(|&n| touched[self.parts.at(n)] = true);
        }
        let State { values, sums, forces, .. } = state;
        let (values, sums, forces) = (values.clone(), sums.clone(), forces.clone());
        self.evaluated(State { x, values, sums, forces, ..State::default() }, &touched)
    }

    /// Evaluates the constraints of the touched parts.
    fn evaluated(&self, mut state: State, touched: &[bool]) -> State {
        let State { x, values, sums, forces, .. } = &mut state;
        let size = self.parts.size;
        let parts = forces.par_chunks_mut(size).zip(values.par_iter_mut().zip(sums.par_iter_mut()));
        let parts = parts.enumerate().filter(|(part, _)| touched[*part]);
        parts.for_each_init(Evaluation::default, |scratch, (part, (forces, (values, sums)))| {
            forces.copy_from_slice(&self.weights[part * size..][..forces.len()]);
            // Values that another state has, too, stay as they are.
            let mut own = Arc::get_mut(values).map(std::mem::take).unwrap_or_default();
            *sums = self.part_at(x, scratch, part, forces, &mut own);
            *values = Arc::new(own);
        });
        let sum = |n: usize| state.sums.iter().map(|sums| sums[n]).sum::<f64>();
        let (norm, scale, floor, noise) = (sum(0).sqrt(), sum(1).sqrt(), sum(2).sqrt(), sum(3));
        State { norm, scale, floor: f64::EPSILON * floor, noise: f64::EPSILON * noise, ..state }
    }

    /// Adds the forces on a part of the free vertices, and writes `C` of the constraints that it
    /// owns. Returns the sums of the part, see [`State`].
    fn part_at(
        &self,
        x: &[Point3<f64>],
        scratch: &mut Evaluation,
        part: usize,
        forces: &mut [Vector3<f64>],
        values: &mut Vec<f64>,
    ) -> [f64; 4] {
        let start = part * self.parts.size;
        let sizes = forces.iter().map(|force| [force.norm(), 0.0]).collect();
        let mut sums = PartSums { start, forces, sizes, noise: 0.0 };
        values.clear();
        values.reserve_exact(self.kinds.iter().map(|kind| kind.owned(part).len()).sum());
        for elements in &self.kinds {
            let add = match elements.kind.arity() {
                2 => Self::add_forces::<2>,
                3 => Self::add_forces::<3>,
                4 => Self::add_forces::<4>,
                _ => Self::add_forces::<0>,
            };
            add(self, elements, part, x, scratch, &mut sums, values);
        }
        let mut squares = [0.0, 0.0, 0.0, sums.noise];
        for (force, [size, rounding]) in sums.forces.iter().zip(sums.sizes) {
            squares[0] += force.norm_squared();
            squares[1] += size * size;
            squares[2] += rounding * rounding;
        }
        squares
    }

    /// Adds the constraints of one kind, with `N` vertices each, or any number if `N` is zero.
    fn add_forces<const N: usize>(
        &self,
        elements: &Elements,
        part: usize,
        x: &[Point3<f64>],
        scratch: &mut Evaluation,
        sums: &mut PartSums<'_>,
        values: &mut Vec<f64>,
    ) {
        let arity = if N > 0 { N } else { elements.kind.arity() };
        let indices = elements.kind.indices();
        let (list, borrowed) = (elements.of_part(part), elements.borrowed(part));
        for (group, constraints) in list.chunks(GROUP).enumerate() {
            scratch.of::<N>(&*elements.kind, constraints, x);
            let Evaluation { places, c, stiffness, gradients } = &*scratch;
            let corners = places.chunks_exact(arity).zip(gradients.chunks_exact(arity));
            let of_constraints = constraints.iter().zip(c.iter().zip(stiffness)).zip(corners);
            for (n, ((&k, (&c, &stiffness)), (places, gradients))) in of_constraints.enumerate() {
                let reach = reach(places, gradients) * stiffness;
                if group * GROUP + n >= borrowed {
                    values.push(c);
                    sums.noise += c.abs() * reach;
                }
                let vertices = &indices[k as usize * arity..][..arity];
                for (gradient, &v) in gradients.iter().zip(vertices) {
                    let n = (self.place[v as usize] as usize).wrapping_sub(sums.start);
                    if let Some(force) = sums.forces.get_mut(n) {
                        let size = gradient.norm();
                        *force -= gradient * (c * stiffness);
                        sums.sizes[n][0] += size * (c * stiffness).abs();
                        sums.sizes[n][1] += size * reach;
                    }
                }
            }
        }
    }

    /// The energy at `to` minus that at `from`, constraint by constraint, so that it is as accurate
    /// as its own size.
    pub(crate) fn difference(&self, from: &State, to: &State) -> f64 {
        let part = |part: usize| -> f64 {
            let (from, to) = (&from.values[part], &to.values[part]);
            let (mut sum, mut start) = (0.0, 0);
            for elements in &self.kinds {
                let owned = elements.owned(part);
                let own = start..start + owned.len();
                sum += elements.kind.energy_change(owned, &from[own.clone()], &to[own.clone()]);
                start = own.end;
            }
            sum
        };
        let parts: Vec<f64> = (0..from.values.len()).into_par_iter().map(part).collect();
        let work = |n: usize| {
            let v = self.free[n] as usize;
            self.weights[n].dot(&(to.x[v] - from.x[v]))
        };
        parts.iter().sum::<f64>() - sum(self.free.len(), work)
    }

    /// A placement with the free vertices moved. The memory of an earlier state is used again.
    pub(crate) fn moved(
        &self,
        from: &State,
        direction: &[Vector3<f64>],
        length: f64,
        mut memory: State,
    ) -> State {
        // Fixed vertices have no direction.
        let moved = |(x, &place): (&Point3<f64>, &u32)| {
            direction.get(place as usize).map_or(*x, |step| x + step * length)
        };
        let vertices = from.x.par_iter().zip(&self.place).with_min_len(ROWS);
        vertices.map(moved).collect_into_vec(&mut memory.x);
        self.evaluated_again(memory)
    }
}

/// The sum of the sizes of the coordinates.
#[inline]
fn norm_1(x: &Vector3<f64>) -> f64 {
    x.x.abs() + x.y.abs() + x.z.abs()
}
