//! Groups of neighboring nodes that become the nodes of a coarser level.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::blocks::{Block, ROWS, divided, row_parts};
use crate::smoother::Operator;

/// Couplings weaker than this share of the geometric mean of both diagonal blocks join no nodes.
const WEAK: f64 = 0.02;

/// Mark of a node that is in no aggregate.
const NONE: u32 = u32::MAX;

/// A division of the nodes of a level.
pub(crate) struct Aggregates {
    /// Aggregate of each node. Aggregates have the order of their first nodes.
    pub of: Vec<u32>,
    pub count: usize,
}

impl Aggregates {
    /// Divides the nodes of a matrix along its strong couplings (Vaněk, Mandel and Brezina,
    /// Computing 56, 1996). A node whose neighbors are all free forms an aggregate with them. The
    /// rest join the aggregate to which they couple most. Nodes with many neighbors come first,
    /// because larger aggregates make smaller levels.
    pub fn of<const B: usize, const L: usize>(matrix: &impl Operator<B, L>) -> Self {
        let (count, graph) = (matrix.nodes(), &*matrix.above().neighbors);
        let size = |row: usize| norm(&matrix.diagonal(row));
        let sizes: Vec<f64> = (0..count).into_par_iter().with_min_len(ROWS).map(size).collect();
        // How strongly each node couples to its neighbors, or zero where it is too little.
        let mut strengths = vec![0.0; 2 * graph.blocks()];
        let parts = row_parts(count);
        let length = |rows: &Range<usize>| graph.start(rows.end) - graph.start(rows.start);
        let of_parts = divided(&mut strengths, parts.iter().map(length));
        parts.into_par_iter().zip(of_parts).for_each(|(rows, strengths)| {
            let couplings = rows.flat_map(|row| matrix.above().row(row).map(move |found| (row, found)));
            for (to, (row, (column, block))) in strengths.iter_mut().zip(couplings) {
                let strength = norm(&block);
                let is_strong = strength > WEAK * (sizes[row] * sizes[column]).sqrt();
                *to = if is_strong { strength as f32 } else { 0.0 };
            }
        });
        let strong = |row: usize| {
            let of_row = graph.of(row).iter().zip(&strengths[graph.start(row)..]);
            of_row
                .filter(|(_, strength)| **strength > 0.0)
                .map(|(&node, &strength)| (node as usize, strength))
        };
        let neighbors = |row: usize| graph.of(row).len();
        let mean = (2 * graph.blocks()).div_ceil(count.max(1));
        let (most, few): (Vec<usize>, Vec<usize>) = (0..count).partition(|&row| neighbors(row) >= mean);
        let mut of = vec![NONE; count];
        let mut aggregates = 0;
        for row in most.into_iter().chain(few) {
            if of[row] == NONE && strong(row).all(|(column, _)| of[column] == NONE) {
                let mut members = 0;
                for (column, _) in strong(row) {
                    of[column] = aggregates;
                    members += 1;
                }
                // A lone node waits for a neighbor's aggregate.
                if members > 0 {
                    of[row] = aggregates;
                    aggregates += 1;
                }
            }
        }
        let seeds = of.clone();
        for row in 0..count {
            if of[row] == NONE {
                let joined = strong(row).filter(|(column, _)| seeds[*column] != NONE);
                let closest = joined.max_by(|(_, a), (_, b)| a.total_cmp(b));
                of[row] = closest.map_or(NONE, |(column, _)| seeds[column]);
            }
        }
        for row in 0..count {
            if of[row] == NONE {
                of[row] = aggregates;
                for (column, _) in strong(row) {
                    if of[column] == NONE {
                        of[column] = aggregates;
                    }
                }
                aggregates += 1;
            }
        }
        let mut number = vec![NONE; aggregates as usize];
        let mut count = 0;
        for aggregate in &mut of {
            let number = &mut number[*aggregate as usize];
            if *number == NONE {
                *number = count;
                count += 1;
            }
            *aggregate = *number;
        }
        Self { of, count: count as usize }
    }

    /// The center of the nodes of each aggregate.
    pub fn centers(&self, places: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let mut sums = vec![(Vector3::zeros(), 0.0); self.count];
        for (&aggregate, place) in self.of.iter().zip(places) {
            let (sum, count) = &mut sums[aggregate as usize];
            *sum += place.coords;
            *count += 1.0;
        }
        sums.into_iter().map(|(sum, count)| Point3::from(sum / count)).collect()
    }
}

/// The Frobenius norm of a block.
fn norm<const B: usize>(block: &Block<B, B>) -> f64 {
    block.as_flattened().iter().map(|x| x * x).sum::<f64>().sqrt()
}
