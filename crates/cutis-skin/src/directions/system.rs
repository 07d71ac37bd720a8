//! The linear system of harmonic continuation, and its coarser versions.

use rayon::prelude::*;

use super::graph::SkinGraph;
use super::tensor::Tensor;

/// No group has been chosen yet.
const NONE: u32 = u32::MAX;

/// A symmetric positive definite matrix in rows. An entry on the diagonal is the sum of the links
/// of its row, with each other and with fixed values. The entries of links have a minus sign.
pub(super) struct System {
    diagonal: Vec<f64>,
    /// Sum of the links of each row with fixed values.
    fixed: Vec<f64>,
    /// Start of each row in `links`, and its end at the next position.
    starts: Vec<usize>,
    /// Column and size of each link, ascending by column.
    links: Vec<(u32, f64)>,
}

impl System {
    /// The Laplace operator of a graph at the vertices in `free`, which is ascending. The other
    /// vertices are fixed.
    pub fn of_free(graph: &SkinGraph, free: &[u32]) -> Self {
        let mut number = vec![NONE; graph.len()];
        free.iter().zip(0..).for_each(|(&vertex, n)| number[vertex as usize] = n);
        let (mut fixed, mut starts, mut links) = (Vec::new(), vec![0], Vec::new());
        for &vertex in free {
            let mut to_fixed = 0.0;
            for &(other, weight) in graph.around(vertex as usize) {
                match number[other as usize] {
                    NONE => to_fixed += weight,
                    other => links.push((other, weight)),
                }
            }
            fixed.push(to_fixed);
            starts.push(links.len());
        }
        Self::new(fixed, starts, links)
    }

    /// Sums of positive numbers give the diagonal, so that it does not cancel.
    fn new(fixed: Vec<f64>, starts: Vec<usize>, links: Vec<(u32, f64)>) -> Self {
        let row =
            |n: usize| fixed[n] + links[starts[n]..starts[n + 1]].iter().map(|link| link.1).sum::<f64>();
        let diagonal = (0..fixed.len()).map(row).collect();
        Self { diagonal, fixed, starts, links }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.diagonal.len()
    }

    /// The entries on the diagonal.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    fn row(&self, n: usize) -> &[(u32, f64)] {
        &self.links[self.starts[n]..self.starts[n + 1]]
    }

    /// The product of the matrix and a vector.
    pub fn times(&self, x: &[Tensor]) -> Vec<Tensor> {
        let row = |n: usize| {
            self.row(n).iter().fold(x[n] * self.diagonal[n], |sum, &(m, size)| sum - x[m as usize] * size)
        };
        (0..self.len()).into_par_iter().map(row).collect()
    }

    /// Groups of neighboring rows, as the number of the group of each row, and the number of
    /// groups.
    ///
    /// A row whose neighbors have no group forms a group with them. Each row that is left joins the
    /// group with the strongest link to it.
    pub fn groups(&self) -> (Vec<u32>, usize) {
        let (mut groups, mut count) = (vec![NONE; self.len()], 0);
        for n in 0..self.len() {
            if groups[n] == NONE && self.row(n).iter().all(|&(m, _)| groups[m as usize] == NONE) {
                groups[n] = count;
                self.row(n).iter().for_each(|&(m, _)| groups[m as usize] = count);
                count += 1;
            }
        }
        // A row without a group has a neighbor with one, from the loop above.
        let joined = |n: usize| {
            let linked = self.row(n).iter().filter(|(m, _)| groups[*m as usize] != NONE);
            linked.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(NONE, |&(m, _)| groups[m as usize])
        };
        let all = (0..self.len()).map(|n| if groups[n] == NONE { joined(n) } else { groups[n] }).collect();
        (all, count as usize)
    }

    /// The system of groups. Links are the sums of those between groups.
    pub fn coarse(&self, groups: &[u32], count: usize) -> Self {
        let mut fixed = vec![0.0; count];
        let mut entries = Vec::new();
        for n in 0..self.len() {
            let group = groups[n];
            fixed[group as usize] += self.fixed[n];
            let others = self.row(n).iter().map(|&(m, size)| (group, groups[m as usize], size));
            entries.extend(others.filter(|&(group, other, _)| group != other));
        }
        // A stable sort, so that equal entries are added in their order.
        entries.par_sort_by_key(|&(group, other, _)| (group, other));
        let (mut starts, mut links): (_, Vec<(u32, f64)>) = (vec![0; count + 1], Vec::new());
        for same in entries.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            links.push((same[0].1, same.iter().map(|&(_, _, size)| size).sum()));
            starts[same[0].0 as usize + 1] = links.len();
        }
        for group in 0..count {
            starts[group + 1] = starts[group + 1].max(starts[group]);
        }
        Self::new(fixed, starts, links)
    }
}
