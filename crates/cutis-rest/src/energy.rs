//! The energy of a body at one placement of its vertices, and the forces.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::Body;
use crate::blocks::ROWS;

/// Constraints that a thread evaluates at once, and whose energies are summed in order before the
/// sums of all parts are.
const PART: usize = 1024;

/// The values and gradients of all constraints, and the forces.
pub(crate) struct State {
    /// Positions of all vertices.
    pub x: Vec<Point3<f64>>,
    /// For each kind `C` of each constraint.
    pub values: Vec<Vec<f64>>,
    /// For each kind `∇C` of each constraint, one vector per vertex.
    pub gradients: Vec<Vec<Vector3<f64>>>,
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

impl Body {
    /// Evaluates all constraints.
    pub(crate) fn at(&self, x: Vec<Point3<f64>>) -> State {
        let (mut values, mut gradients) = (Vec::new(), Vec::new());
        let mut noise = 0.0;
        for elements in &self.kinds {
            let (kind, arity) = (&elements.kind, elements.kind.arity().max(1));
            let mut c = vec![0.0; kind.len()];
            let mut g = vec![Vector3::zeros(); kind.len() * arity];
            let parts = c.par_chunks_mut(PART).zip(g.par_chunks_mut(PART * arity)).enumerate();
            let evaluate = |places: &mut Vec<Point3<f64>>,
                            part: (usize, (&mut [f64], &mut [Vector3<f64>]))| {
                let (part, (c, g)) = part;
                let mut noise = 0.0;
                for (n, (c, g)) in c.iter_mut().zip(g.chunks_exact_mut(arity)).enumerate() {
                    let k = part * PART + n;
                    for (place, &vertex) in places.iter_mut().zip(elements.vertices(k)) {
                        *place = x[vertex as usize];
                    }
                    *c = kind.evaluate(k, places, g);
                    let reach: f64 = g.iter().zip(&*places).map(|(g, x)| g.norm() * x.coords.norm()).sum();
                    noise += c.abs() * elements.stiffness(k) * reach;
                }
                noise
            };
            let sums: Vec<f64> = parts.map_init(|| vec![Point3::origin(); arity], evaluate).collect();
            noise += sums.iter().sum::<f64>();
            values.push(c);
            gradients.push(g);
        }
        let at_vertex = |(place, &vertex): (usize, &u32)| {
            let (mut force, mut size) = (self.weights[place], self.weights[place].norm());
            let mut rounding = 0.0;
            for (elements, (c, g)) in self.kinds.iter().zip(values.iter().zip(&gradients)) {
                let arity = elements.kind.arity();
                for &at in elements.incidence.of(vertex) {
                    let k = at as usize / arity;
                    let (gradient, stiffness) = (g[at as usize], elements.stiffness(k));
                    let part = gradient * (c[k] * stiffness);
                    force -= part;
                    size += part.norm();
                    let reach: f64 = g[k * arity..][..arity]
                        .iter()
                        .zip(elements.vertices(k))
                        .map(|(g, &v)| g.norm() * x[v as usize].coords.norm())
                        .sum();
                    rounding += gradient.norm() * reach * stiffness;
                }
            }
            (force, size, rounding)
        };
        let found: Vec<_> = self.free.par_iter().enumerate().with_min_len(ROWS).map(at_vertex).collect();
        let norm = root_of_squares(found.iter().map(|(force, ..)| force.norm()));
        let scale = root_of_squares(found.iter().map(|(_, size, _)| *size));
        let floor = f64::EPSILON * root_of_squares(found.iter().map(|(.., rounding)| *rounding));
        let noise = f64::EPSILON * noise;
        let forces = found.into_iter().map(|(force, ..)| force).collect();
        State { x, values, gradients, forces, norm, scale, floor, noise }
    }

    /// The energy at `to` minus that at `from`, constraint by constraint, so that it is as accurate
    /// as its own size.
    pub(crate) fn difference(&self, from: &State, to: &State) -> f64 {
        let mut sum = 0.0;
        for (elements, (from, to)) in self.kinds.iter().zip(from.values.iter().zip(&to.values)) {
            let part = |(part, (from, to)): (usize, (&[f64], &[f64]))| -> f64 {
                let pairs = from.iter().zip(to).enumerate();
                let change = |(n, (from, to)): (usize, (&f64, &f64))| {
                    0.5 * (to - from) * (to + from) * elements.stiffness(part * PART + n)
                };
                pairs.map(change).sum()
            };
            let parts: Vec<f64> =
                from.par_chunks(PART).zip(to.par_chunks(PART)).enumerate().map(part).collect();
            sum += parts.iter().sum::<f64>();
        }
        let work = |(weight, &v): (&Vector3<f64>, &u32)| weight.dot(&(to.x[v as usize] - from.x[v as usize]));
        sum - self.weights.iter().zip(&self.free).map(work).sum::<f64>()
    }

    /// A placement with the free vertices moved.
    pub(crate) fn moved(&self, from: &State, direction: &[Vector3<f64>], length: f64) -> State {
        let mut x = from.x.clone();
        for (&v, step) in self.free.iter().zip(direction) {
            x[v as usize] += step * length;
        }
        self.at(x)
    }
}

/// The root of the sum of squares.
fn root_of_squares(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}
