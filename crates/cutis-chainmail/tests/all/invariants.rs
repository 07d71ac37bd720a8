//! Properties of every drag, cut and relaxation, tested on random bodies.

use cutis_chainmail::{Chain, Drag, DragReport, Material, NO_MATERIAL, Order, UNITS_PER_STEP};
use proptest::prelude::*;

use crate::oracle;
use crate::random::{Case, case};

fn all_units(chain: &Chain) -> Vec<[i32; 3]> {
    (0..chain.places() as u32).map(|element| chain.units(element)).collect()
}

fn target(drag: &Drag) -> [i32; 3] {
    drag.to.map(|steps| (steps * f64::from(UNITS_PER_STEP)).round() as i32)
}

/// Links beyond their bounds, as pairs of elements.
fn violated(chain: &Chain) -> Vec<(u32, u32)> {
    let mut list = Vec::new();
    for a in 0..chain.places() as u32 {
        for axis in 0..3 {
            let Some((b, bounds)) = chain.link(a, axis) else { continue };
            let apart = [0, 1, 2].map(|c| chain.units(b)[c] - chain.units(a)[c]);
            if (0..3).any(|c| apart[c] < bounds[c][0] || apart[c] > bounds[c][1]) {
                list.push((a, b));
            }
        }
    }
    list
}

fn reported(report: &DragReport) -> Vec<(u32, u32)> {
    let mut list: Vec<(u32, u32)> =
        report.contradictions.iter().map(|c| (c.held.min(c.other), c.held.max(c.other))).collect();
    list.sort();
    list.dedup();
    list
}

/// The elements that are connected with `from` by links.
fn part_of(chain: &Chain, from: u32) -> Vec<bool> {
    let mut part = vec![false; chain.places()];
    let mut open = vec![from];
    part[from as usize] = true;
    while let Some(element) = open.pop() {
        for next in chain.neighbors(element) {
            if !std::mem::replace(&mut part[next as usize], true) {
                open.push(next);
            }
        }
    }
    part
}

fn check(case: &Case) -> Result<(), TestCaseError> {
    let mut chain = case.chain();
    let mut feasible = true;
    for drags in case.drags(&chain) {
        let before = all_units(&chain);
        let least = oracle::least_move(&chain, &drags);
        let mut rounds = chain.clone();
        let report = chain.drag(&drags, Order::Fifo).unwrap();
        let after = all_units(&chain);

        // Every order gives the same bits.
        let found = rounds.drag(&drags, Order::Slabs).unwrap();
        prop_assert_eq!(&after, &all_units(&rounds));
        prop_assert_eq!((report.elements, &report.contradictions), (found.elements, &found.contradictions));

        // Grabbed elements are at their targets. Fixed and unconnected elements have not moved.
        for drag in &drags {
            prop_assert_eq!(after[drag.element as usize], target(drag));
        }
        let parts: Vec<Vec<bool>> = drags.iter().map(|drag| part_of(&chain, drag.element)).collect();
        for element in 0..before.len() {
            let reached = parts.iter().any(|part| part[element]);
            if chain.is_fixed(element as u32) || (feasible && !reached) {
                prop_assert_eq!(after[element], before[element]);
            }
        }
        let differ = (0..before.len()).filter(|&e| before[e] != after[e]).count();
        prop_assert!(report.elements == differ || (!feasible && report.elements > differ));

        // The reported links are exactly the violated ones.
        let links = violated(&chain);
        prop_assert_eq!(&reported(&report), &links);
        prop_assert_eq!(chain.violations().links, links.len());

        // A drag finds a solution if there is one, also after a drag without a solution. The
        // solution is the least move.
        let holds = least.iter().all(Option::is_some);
        prop_assert_eq!(report.contradictions.is_empty(), holds);
        for (coordinate, positions) in least.iter().enumerate().filter(|_| feasible) {
            let Some(positions) = positions else { continue };
            let found: Vec<i64> = after.iter().map(|units| i64::from(units[coordinate])).collect();
            prop_assert_eq!(&found, positions);
        }
        feasible = feasible && holds;

        // Relaxation does the same as the reference, which visits every element, even if it only
        // visits the rows of the drag. It never raises the energy, and it keeps links within their
        // bounds.
        let held: Vec<u32> = drags.iter().map(|drag| drag.element).collect();
        let mut energy = chain.energy_mm2();
        let k = |element: u32| case.materials[case.element_materials[element as usize] as usize].k;
        for n in 0..4 {
            // In the last round the held elements are released.
            let held = if n < 3 { held.as_slice() } else { &[] };
            let (expected, moves) = oracle::sweep(&chain, k, held);
            let relaxed = chain.relax(1, held);
            prop_assert_eq!((all_units(&chain), relaxed.moves), (expected, moves));
            let now = chain.energy_mm2();
            prop_assert!(if relaxed.moves == 0 { now == energy } else { now < energy }, "{energy} -> {now}");
            prop_assert!(violated(&chain).iter().all(|link| links.contains(link)));
            energy = now;
            for &element in held {
                prop_assert_eq!(chain.units(element), after[element as usize]);
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_drag_is_the_least_move(case in case()) {
        check(&case)?;
    }
}

/// Rows that are longer than a block of the relaxation, with clustered materials and holes.
#[test]
fn long_rows_relax_like_the_reference() {
    let shape = [150, 6, 7];
    let materials =
        [Material::isotropic(0.5, 1.5, 0.4, 0.0), Material::isotropic(0.8, 1.2, 0.1, 0.02), Material::RIGID];
    let random = |n: u32| n.wrapping_mul(2_654_435_761).rotate_left(15).wrapping_mul(0x9E37_79B9) >> 8;
    let of = |n: u32| match random(n / 41) % 8 {
        0..=3 => 0,
        4..=5 => 1,
        6 => 2,
        _ => {
            if n % 41 < 3 {
                NO_MATERIAL
            } else {
                0
            }
        }
    };
    let of: Vec<u8> = (0..150 * 42).map(of).collect();
    let mut chain = Chain::new(shape, [1.0; 3], &materials, of.clone()).unwrap();
    for n in 0..30 {
        let element = random(1000 + n) % (150 * 42);
        if chain.has_element(element) {
            let by = |axis: u32| f64::from(random(3 * n + axis) % 200) / 100.0 - 1.0;
            let at = chain.position(element);
            let to = [at[0] + by(0), at[1] + by(1), at[2] + by(2)];
            chain.drag(&[Drag { element, to }], Order::Slabs).unwrap();
        }
    }
    for _ in 0..8 {
        let k = |element: u32| materials[of[element as usize] as usize].k;
        let (expected, moves) = oracle::sweep(&chain, k, &[77]);
        assert!(moves > 1000, "{moves}");
        assert_eq!(chain.relax(1, &[77]).moves, moves);
        assert!(all_units(&chain) == expected);
    }
}
