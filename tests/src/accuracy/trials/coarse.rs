//! A start from a coarser level: the substep is first minimized among displacements that a coarse grid interpolates.
//!
//! The grid spans the body at rest, trilinear between its nodes, and knows nothing of a cut; Gauss–Newton with a direct
//! solution and a line search, so that no better start is to be had from this space.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use super::step::{Step, evaluate, vertices};

/// Steps of Gauss–Newton.
const STEPS: usize = 8;

/// The nodes that hold a vertex, with their shares.
type Shares = Vec<(usize, f64)>;

/// Positions to start from, near `x`, on a grid whose step is `spacing` m; and the number of its nodes.
pub fn start(
    step: &Step<'_>,
    rest: &[Point3<f64>],
    x: Vec<Point3<f64>>,
    spacing: f64,
) -> (Vec<Point3<f64>>, usize) {
    let mut nodes: HashMap<[i64; 3], usize> = HashMap::new();
    let low = rest.iter().fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(&p.coords));
    let shares: Vec<Shares> = rest
        .iter()
        .enumerate()
        .map(
            |(v, p)| if step.moves(v) { corners((p.coords - low) / spacing, &mut nodes) } else { Vec::new() },
        )
        .collect();
    let mut x = x;
    let mut energy = objective(step, &x);
    for _ in 0..STEPS {
        let Some(moves) = direction(step, &shares, nodes.len(), &x) else { break };
        let mut length = 1.0;
        let lower = loop {
            let next: Vec<_> =
                x.iter().zip(&shares).map(|(x, shares)| x + moved(shares, &moves) * length).collect();
            let there = objective(step, &next);
            if there < energy {
                break Some((next, there));
            }
            length *= 0.5;
            if length < 1e-3 {
                break None;
            }
        };
        let Some((next, there)) = lower else { break };
        (x, energy) = (next, there);
    }
    (x, nodes.len())
}

/// The corners of the cell with `place`, and their shares.
fn corners(place: Vector3<f64>, nodes: &mut HashMap<[i64; 3], usize>) -> Shares {
    let cell = place.map(f64::floor);
    let inside = place - cell;
    let mut shares = Vec::new();
    for corner in 0..8usize {
        let bit = |axis: usize| (corner >> axis & 1) as f64;
        let share: f64 =
            (0..3).map(|axis| if bit(axis) > 0.0 { inside[axis] } else { 1.0 - inside[axis] }).product();
        if share > 0.0 {
            let key = [0, 1, 2].map(|axis| (cell[axis] + bit(axis)) as i64);
            let next = nodes.len();
            shares.push((*nodes.entry(key).or_insert(next), share));
        }
    }
    shares
}

/// What a vertex moves when the nodes do.
fn moved(shares: &Shares, moves: &DVector<f64>) -> Vector3<f64> {
    shares.iter().map(|&(node, share)| moves.fixed_rows::<3>(3 * node) * share).sum()
}

/// What the substep minimizes, in J.
fn objective(step: &Step<'_>, x: &[Point3<f64>]) -> f64 {
    let free = (0..x.len()).filter(|&v| step.moves(v));
    let inertia: f64 = free
        .map(|v| (x[v] - step.implicit.predicted[v]).norm_squared() * step.per_h2 / step.inverse_mass(v))
        .sum();
    let (mut places, mut gradient) = ([Point3::origin(); 8], [Vector3::zeros(); 8]);
    let mut elastic = 0.0;
    for kind in step.kinds() {
        for k in 0..kind.len() {
            let c = evaluate(kind, k, x, &mut places, &mut gradient);
            elastic += c * c / kind.stiffness().values().at(k);
        }
    }
    0.5 * (inertia + elastic)
}

/// The nodes' step by Gauss–Newton.
fn direction(step: &Step<'_>, shares: &[Shares], nodes: usize, x: &[Point3<f64>]) -> Option<DVector<f64>> {
    let mut matrix = DMatrix::<f64>::zeros(3 * nodes, 3 * nodes);
    let mut force = DVector::<f64>::zeros(3 * nodes);
    for (v, shares) in shares.iter().enumerate() {
        for &(a, share) in shares {
            let inertia = step.per_h2 / step.inverse_mass(v);
            let pull = (step.implicit.predicted[v] - x[v]) * (share * inertia);
            let mut rows = force.fixed_rows_mut::<3>(3 * a);
            rows += pull;
            for &(b, other) in shares {
                (0..3).for_each(|axis| matrix[(3 * a + axis, 3 * b + axis)] += share * other * inertia);
            }
        }
    }
    let (mut places, mut gradient) = ([Point3::origin(); 8], [Vector3::zeros(); 8]);
    for kind in step.kinds() {
        for k in 0..kind.len() {
            let c = evaluate(kind, k, x, &mut places, &mut gradient);
            let stiffness = 1.0 / kind.stiffness().values().at(k);
            let mut rows: Vec<(usize, f64)> = Vec::new();
            for (&v, g) in vertices(kind, k).iter().zip(&gradient) {
                for &(node, share) in &shares[v as usize] {
                    rows.extend((0..3).map(|axis| (3 * node + axis, share * g[axis])));
                }
            }
            for &(row, a) in &rows {
                force[row] -= a * c * stiffness;
                for &(column, b) in &rows {
                    matrix[(row, column)] += a * b * stiffness;
                }
            }
        }
    }
    matrix.cholesky().map(|factors| factors.solve(&force))
}
