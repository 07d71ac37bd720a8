//! Reference implementations of a drag and of a sweep, written differently and in 64 bits.
//!
//! The drag computes the bounds of each element by visiting all links until nothing changes, and
//! then moves each element into its bounds.

use cutis_chainmail::{Chain, Drag, UNITS_PER_STEP};

/// Positions after a drag, by coordinate; `None` where there is no solution.
pub fn least_move(chain: &Chain, drags: &[Drag]) -> [Option<Vec<i64>>; 3] {
    let count = chain.places();
    let links: Vec<(usize, usize, [[i32; 2]; 3])> = (0..count as u32)
        .flat_map(|a| {
            (0..3).filter_map(move |axis| {
                chain.link(a, axis).map(|(b, bounds)| (a as usize, b as usize, bounds))
            })
        })
        .collect();
    [0, 1, 2].map(|c| {
        let before: Vec<i64> = (0..count).map(|e| i64::from(chain.units(e as u32)[c])).collect();
        let mut targets: Vec<Option<i64>> =
            (0..count).map(|e| chain.is_fixed(e as u32).then_some(before[e])).collect();
        for drag in drags {
            targets[drag.element as usize] = Some((drag.to[c] * f64::from(UNITS_PER_STEP)).round() as i64);
        }
        // Far beyond all coordinates, and far within 64 bits.
        let far = 1_i64 << 40;
        let mut low: Vec<i64> = targets.iter().map(|target| target.unwrap_or(-far)).collect();
        let mut high: Vec<i64> = targets.iter().map(|target| target.unwrap_or(far)).collect();
        loop {
            let old = (low.clone(), high.clone());
            for &(a, b, bounds) in &links {
                let [lo, hi] = bounds[c].map(i64::from);
                low[b] = low[b].max(low[a] + lo);
                low[a] = low[a].max(low[b] - hi);
                high[b] = high[b].min(high[a] + hi);
                high[a] = high[a].min(high[b] - lo);
            }
            if (low.iter().zip(&high)).any(|(low, high)| low > high) {
                return None;
            }
            if (&old.0, &old.1) == (&low, &high) {
                break;
            }
        }
        Some((0..count).map(|e| before[e].max(low[e]).min(high[e])).collect())
    })
}

/// Positions after one sweep of relaxation, and the number of coordinates that change. Every
/// element is visited, one after the other. `k` is that of each element in steps.
pub fn sweep(chain: &Chain, k: impl Fn(u32) -> f64, held: &[u32]) -> (Vec<[i32; 3]>, u64) {
    let count = chain.places() as u32;
    let mut x: Vec<[i32; 3]> = (0..count).map(|element| chain.units(element)).collect();
    let mut moves = 0;
    let [nx, ny, _] = chain.shape().map(|n| n as u32);
    let one = i64::from(UNITS_PER_STEP);
    for odd in 0..2 {
        for element in (0..count).filter(|e| (e % nx + e / nx % ny + e / (nx * ny)) % 2 == odd) {
            if !chain.has_element(element) || chain.is_fixed(element) || held.contains(&element) {
                continue;
            }
            for c in 0..3 {
                let own = i64::from(x[element as usize][c]);
                // For each neighbor: the position it asks for, and the range that it allows.
                let mut asked = Vec::new();
                for axis in 0..3 {
                    let rest = if axis == c { one } else { 0 };
                    if let Some((next, bounds)) = chain.link(element, axis) {
                        let [lo, hi] = bounds[c].map(i64::from);
                        let there = i64::from(x[next as usize][c]);
                        asked.push((there - rest, there - hi, there - lo));
                    }
                    let stride = [1, nx, nx * ny][axis];
                    let before = element.checked_sub(stride).and_then(|b| Some((b, chain.link(b, axis)?)));
                    if let Some((before, (_, bounds))) = before.filter(|(_, (next, _))| *next == element) {
                        let [lo, hi] = bounds[c].map(i64::from);
                        let there = i64::from(x[before as usize][c]);
                        asked.push((there + rest, there + lo, there + hi));
                    }
                }
                if asked.is_empty() || asked.iter().any(|&(_, from, to)| own < from || own > to) {
                    continue;
                }
                let sum: i64 = asked.iter().map(|(to, ..)| to - own).sum();
                let mean = sum as f64 / asked.len() as f64;
                let by = mean.signum() * (mean.abs() - 0.5).ceil().max(0.0);
                let to = asked.iter().fold(own + by as i64, |to, &(_, from, most)| to.clamp(from, most));
                if by.abs() >= (k(element) * one as f64).round().max(1.0) && to != own {
                    x[element as usize][c] = to as i32;
                    moves += 1;
                }
            }
        }
    }
    (x, moves)
}
