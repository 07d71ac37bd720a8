//! Skin over a layer of soft tissue, cut straight across: it moves as far from the cut as closed
//! forms and finite elements in plane strain say, which share no code with the product.

use cutis_studies::at_rest::{
    DECAY_TOLERANCE, ELEMENT_ROWS, Layer, PROFILE_TOLERANCE, ROWS, Skin, fat, thin,
};

/// Poisson's ratios of a tissue that is easy to compress, and of the presets.
const RATIOS: [f64; 2] = [0.3, 0.484_375];

fn relative(found: f64, wanted: f64) -> f64 {
    (found / wanted - 1.0).abs()
}

/// The closed form is that of a layer without thickness. Its error must fall with the thickness
/// over the length of shear lag.
#[test]
fn the_skin_of_a_thin_layer_follows_shear_lag() {
    let error = |layer: Layer| Skin::of_lattice(layer, 4).unwrap().difference(|s| layer.lag(s));
    let [thick, middle, thin] = [600.0, 2400.0, 9600.0].map(|modulus| error(thin(modulus)));
    assert!(thick < 0.04 && middle < 0.02 && thin < 0.01, "{thick} {middle} {thin}");
}

#[test]
fn a_layer_of_another_thickness_or_modulus_is_refused() {
    let meant = thin(9600.0);
    for other in [
        Layer { thickness: 2.0 * meant.thickness, ..meant },
        Layer { shear_modulus: 4.0 * meant.shear_modulus, ..meant },
    ] {
        let off = Skin::of_lattice(other, 4).unwrap().difference(|s| meant.lag(s));
        assert!(off > 0.2, "{other:?}: {off}");
    }
}

#[test]
fn the_skin_of_a_thick_layer_follows_plane_strain() {
    for layer in RATIOS.map(fat) {
        let [lattice, elements] =
            [Skin::of_lattice(layer, ROWS).unwrap(), Skin::of_elements(layer, ELEMENT_ROWS)];
        let off = lattice.difference(|s| elements.at(s));
        assert!(off < PROFILE_TOLERANCE, "{layer:?}: {off}");
        // Control: shear lag, which is right for thin layers only.
        let off = lattice.difference(|s| layer.lag(s));
        assert!(off > 4.0 * PROFILE_TOLERANCE, "{layer:?}: {off}");
    }
}

#[test]
fn far_from_the_cut_the_motion_decays_with_the_exact_length() {
    for layer in [thin(600.0), fat(RATIOS[0]), fat(RATIOS[1])] {
        let exact = layer.decay_length();
        for (what, skin) in [
            ("lattice", Skin::of_lattice(layer, ROWS).unwrap()),
            ("elements", Skin::of_elements(layer, ROWS)),
        ] {
            let off = relative(skin.decay_length(), exact);
            assert!(off < DECAY_TOLERANCE, "{what}, {layer:?}: {off}");
            // Controls: other layers.
            for other in [
                Layer { thickness: 2.0 * layer.thickness, ..layer },
                Layer { shear_modulus: 4.0 * layer.shear_modulus, ..layer },
            ] {
                let off = relative(skin.decay_length(), other.decay_length());
                assert!(off > 0.2, "{what}, {other:?}: {off}");
            }
        }
    }
}

/// A finer lattice is nearer to the exact length.
#[test]
fn the_error_of_the_lattice_falls_with_its_step() {
    let layer = fat(RATIOS[0]);
    let error = |rows| relative(Skin::of_lattice(layer, rows).unwrap().decay_length(), layer.decay_length());
    let [coarse, fine] = [2, 4].map(error);
    assert!(fine < 0.5 * coarse, "{coarse} {fine}");
}
