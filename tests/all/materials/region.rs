//! A region of interest has the moduli of the whole body, also where the nearest skin is outside.

use std::collections::BTreeMap;

use super::table::{LAYERS, Place, moduli, small};

const UNCUT: (&str, &str) = ("incision", "[]");
/// A box in the front of the trunk, below the skin.
const INSIDE: (&str, &str) = ("lattice.region", "{ min_mm = [-40, 20, -40], max_mm = [40, 70, 40] }");

/// The largest relative difference of the moduli of a part from those of the whole.
fn difference(part: &[BTreeMap<Place, f64>; 2], whole: &[BTreeMap<Place, f64>; 2]) -> f64 {
    let of_kind = |kind: usize| {
        let difference = |(place, modulus): (&Place, &f64)| (modulus / whole[kind][place] - 1.0).abs();
        part[kind].iter().map(difference).fold(0.0, f64::max)
    };
    of_kind(0).max(of_kind(1))
}

#[test]
fn elements_of_a_region_have_the_moduli_of_the_whole_body() {
    let whole = moduli(&small(&LAYERS, &[UNCUT]));
    let inside = small(&LAYERS, &[UNCUT, INSIDE]);
    let part = moduli(&inside);
    assert!(part[1].len() > 500 && 4 * part[1].len() < whole[1].len(), "{}", part[1].len());
    assert!(difference(&part, &whole) < 1e-6);
    // The region holds no skin. Its muscle still has the depth below the skin of the whole body.
    let plan = cutis::check(&inside, &cutis::Silent).unwrap();
    assert_eq!((plan.sizes.skin_triangles, plan.materials[0].vertices), (0, 0));
    assert!(plan.materials[3].vertices > 50 && plan.materials[4].vertices > 50, "{:?}", plan.materials);
    // Control: with another depth of the muscle a part of the moduli differs.
    let mut deeper = LAYERS;
    deeper[3].depth_mm = Some([5.0, 40.0]);
    assert!(difference(&moduli(&small(&deeper, &[UNCUT, INSIDE])), &whole) > 0.1);
}

/// An incision opens a wound, whose walls are not skin. The depth is that of the uncut body.
#[test]
fn elements_of_a_cut_body_have_the_moduli_of_the_uncut_body() {
    let uncut = moduli(&small(&LAYERS, &[UNCUT]));
    for set in [&[][..], &[("lattice.region", "{ around_mm = 30 }")]] {
        let cut = moduli(&small(&LAYERS, set));
        assert!(cut[1].len() < uncut[1].len());
        assert!(difference(&cut, &uncut) < 1e-6);
    }
}
