//! What a drag must come to, found another way: bounds from the elements that must not move, by sweeping over all links until nothing
//! changes, in 64 bits; and each element moved into its bounds.

use cutis_chainmail::{Chain, Drag, UNITS_PER_STEP};

/// Positions that a drag must come to, by coordinate; none where no state has what was told.
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
        let mut told: Vec<Option<i64>> =
            (0..count).map(|e| chain.is_fixed(e as u32).then_some(before[e])).collect();
        for drag in drags {
            told[drag.element as usize] = Some((drag.to[c] * f64::from(UNITS_PER_STEP)).round() as i64);
        }
        // Far beyond all coordinates, and far within 64 bits.
        let far = 1_i64 << 40;
        let mut low: Vec<i64> = told.iter().map(|told| told.unwrap_or(-far)).collect();
        let mut high: Vec<i64> = told.iter().map(|told| told.unwrap_or(far)).collect();
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
