//! Energy of a chain, and the links that are beyond their bounds.

use rayon::prelude::*;

use crate::chain::Chain;
use crate::links::Neighbor;
use crate::units::{UNITS_PER_STEP, to_steps};

/// A link that is beyond its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkViolation {
    /// The element at the lower end.
    pub element: u32,
    /// The element at the upper end.
    pub next: u32,
    /// The coordinate with the largest violation.
    pub axis: usize,
    /// Size of that violation in steps.
    pub excess: f64,
}

/// Summary of all links that are beyond their bounds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Violations {
    /// Number of such links.
    pub links: usize,
    /// The link with the largest violation; the first one if several are equal.
    pub worst: Option<LinkViolation>,
}

impl Chain {
    /// Energy of the chain in mm²: half the sum, over all links, of the squared deviation of the
    /// vector between the ends from its rest value. The sum is computed in integers, so that it is
    /// the same for any number of threads.
    pub fn energy_mm2(&self) -> f64 {
        let squares = self.over_rows(|sum: &mut [i128; 3], element| {
            let at = self.units(element);
            for axis in 0..3 {
                let Some(next) = self.structure.links.next(element, axis) else { continue };
                let other = self.units(next);
                for coordinate in 0..3 {
                    let rest = if axis == coordinate { UNITS_PER_STEP } else { 0 };
                    let off = i64::from(other[coordinate]) - i64::from(at[coordinate]) - i64::from(rest);
                    sum[coordinate] += i128::from(off * off);
                }
            }
        });
        let total = squares.into_iter().reduce(|a, b| [0, 1, 2].map(|c| a[c] + b[c])).unwrap_or_default();
        let one_mm = self.spacing_mm.map(|step| step / f64::from(UNITS_PER_STEP));
        (0..3).map(|c| 0.5 * total[c] as f64 * one_mm[c] * one_mm[c]).sum()
    }

    /// Finds the links that are beyond their bounds.
    pub fn violations(&self) -> Violations {
        let found = self.over_rows(|sum: &mut (usize, Option<(i32, u32, u32, usize)>), element| {
            for axis in 0..3 {
                let Some(next) = self.structure.links.next(element, axis) else { continue };
                let link = Neighbor { element: next, axis, next: true };
                let excess = [0, 1, 2].map(|coordinate| self.excess(element, link, coordinate));
                let worst =
                    (0..3).max_by_key(|&coordinate| (excess[coordinate], 2 - coordinate)).unwrap_or(0);
                if excess[worst] == 0 {
                    continue;
                }
                sum.0 += 1;
                if sum.1.is_none_or(|(most, ..)| excess[worst] > most) {
                    sum.1 = Some((excess[worst], element, next, worst));
                }
            }
        });
        let links = found.iter().map(|(links, _)| links).sum();
        let most = found.iter().filter_map(|(_, worst)| *worst).reduce(|a, b| if b.0 > a.0 { b } else { a });
        let worst = most.map(|(excess, element, next, axis)| LinkViolation {
            element,
            next,
            axis,
            excess: to_steps(excess),
        });
        Violations { links, worst }
    }

    /// Gathers a value for each row along the first axis by calling `add` for each element of the
    /// row.
    fn over_rows<T: Default + Send>(&self, add: impl Fn(&mut T, u32) + Sync) -> Vec<T> {
        let row = self.shape()[0];
        (0..self.places() / row)
            .into_par_iter()
            .map(|number| {
                let mut sum = T::default();
                (number * row..(number + 1) * row).for_each(|element| add(&mut sum, element as u32));
                sum
            })
            .collect()
    }
}
