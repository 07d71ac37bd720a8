//! The energy of a body at one placement of its vertices, and the forces.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use crate::Body;
use crate::body::Elements;

/// Vertices or constraints that a thread takes at once. Sums of parts are added in order, so that a
/// result does not depend on the number of threads.
pub(crate) const PART: usize = 4096;

/// The values of all constraints, and the forces.
pub(crate) struct State {
    /// Positions of all vertices.
    pub x: Vec<Point3<f64>>,
    /// For each kind `C` of each constraint that counts.
    values: Vec<Vec<f64>>,
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

/// Memory to evaluate a constraint.
#[derive(Default)]
pub(crate) struct Scratch {
    /// Positions of its vertices.
    pub places: Vec<Point3<f64>>,
    pub gradients: Vec<Vector3<f64>>,
    /// Gradients at other positions.
    pub ahead: Vec<Vector3<f64>>,
    /// Second derivatives, see [`Scratch::differentiate`].
    pub curvature: Vec<Matrix3<f64>>,
}

impl Scratch {
    /// `C` and `∇C` of a constraint.
    #[inline]
    pub fn evaluate(&mut self, elements: &Elements, k: usize, x: &[Point3<f64>]) -> f64 {
        let vertices = elements.vertices(k);
        if self.places.len() != vertices.len() {
            self.places.resize(vertices.len(), Point3::origin());
            self.gradients.resize(vertices.len(), Vector3::zeros());
        }
        for (place, &v) in self.places.iter_mut().zip(vertices) {
            *place = x[v as usize];
        }
        elements.kind.evaluate(k, &self.places, &mut self.gradients)
    }

    /// How much `C` changes if each coordinate changes by its own size.
    fn reach(&self) -> f64 {
        self.gradients.iter().zip(&self.places).map(|(g, x)| norm_1(g) * norm_1(&x.coords)).sum()
    }
}

impl Body {
    /// Evaluates all constraints.
    pub(crate) fn at(&self, x: Vec<Point3<f64>>) -> State {
        let mut noise = 0.0;
        let mut values = Vec::with_capacity(self.kinds.len());
        for elements in &self.kinds {
            let mut c = vec![0.0; elements.count()];
            let evaluate = |scratch: &mut Scratch, (part, c): (usize, &mut [f64])| -> f64 {
                let mut noise = 0.0;
                for (n, c) in c.iter_mut().enumerate() {
                    let k = elements.nth(part * PART + n);
                    *c = scratch.evaluate(elements, k, &x);
                    noise += c.abs() * elements.stiffness(k) * scratch.reach();
                }
                noise
            };
            let parts = c.par_chunks_mut(PART).enumerate();
            let sums: Vec<f64> = parts.map_init(Scratch::default, evaluate).collect();
            noise += sums.iter().sum::<f64>();
            values.push(c);
        }
        let mut forces = self.weights.clone();
        let part = |scratch: &mut Scratch, (part, forces): (usize, &mut [Vector3<f64>])| {
            let rows = part * PART..part * PART + forces.len();
            let mut sizes: Vec<[f64; 2]> = forces.iter().map(|force| [force.norm(), 0.0]).collect();
            for elements in &self.kinds {
                for &k in elements.of_part(part) {
                    let k = k as usize;
                    let c = scratch.evaluate(elements, k, &x);
                    let stiffness = elements.stiffness(k);
                    let reach = scratch.reach() * stiffness;
                    for (gradient, &v) in scratch.gradients.iter().zip(elements.vertices(k)) {
                        let row = self.place[v as usize] as usize;
                        if rows.contains(&row) {
                            let n = row - rows.start;
                            let size = gradient.norm();
                            forces[n] -= gradient * (c * stiffness);
                            sizes[n][0] += size * (c * stiffness).abs();
                            sizes[n][1] += size * reach;
                        }
                    }
                }
            }
            let mut squares = [0.0; 3];
            for (force, [size, rounding]) in forces.iter().zip(sizes) {
                squares[0] += force.norm_squared();
                squares[1] += size * size;
                squares[2] += rounding * rounding;
            }
            squares
        };
        let parts = forces.par_chunks_mut(PART).enumerate().map_init(Scratch::default, part);
        let parts: Vec<[f64; 3]> = parts.collect();
        let root = |n: usize| parts.iter().map(|squares| squares[n]).sum::<f64>().sqrt();
        let (norm, scale, floor) = (root(0), root(1), f64::EPSILON * root(2));
        State { x, values, forces, norm, scale, floor, noise: f64::EPSILON * noise }
    }

    /// The energy at `to` minus that at `from`, constraint by constraint, so that it is as accurate
    /// as its own size.
    pub(crate) fn difference(&self, from: &State, to: &State) -> f64 {
        let mut sum = 0.0;
        for (elements, (from, to)) in self.kinds.iter().zip(from.values.iter().zip(&to.values)) {
            let part = |(part, (from, to)): (usize, (&[f64], &[f64]))| -> f64 {
                let pairs = from.iter().zip(to).enumerate();
                let change = |(n, (from, to)): (usize, (&f64, &f64))| {
                    0.5 * (to - from) * (to + from) * elements.stiffness(elements.nth(part * PART + n))
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

/// The sum of the sizes of the coordinates.
#[inline]
fn norm_1(x: &Vector3<f64>) -> f64 {
    x.x.abs() + x.y.abs() + x.z.abs()
}
