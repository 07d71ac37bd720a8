//! The region of interest of scenes that name none.
//!
//! A region that is too small holds the wound back. Skin that slides over soft tissue feels a cut
//! up to a distance that depends on both, and not on the cut. With the tissue and the skin of the
//! presets, cuts of 40 to 100 mm open less in a region of size `r` around them than in the whole
//! body by at most about `1.1 exp(−r/26 mm)` (`cargo xtask study region --default`).

use nalgebra::{Point3, distance};

use super::{MembraneSection, PickedRegion, RegionSection, RegionZone, Scene, TissueMaterials};
use crate::model::ModelChoice;

/// Length over which the error falls by the factor e, mm.
const DECAY_MM: f64 = 26.0;
/// Error of a region of size 0, for wounds of up to [`LONG_MM`].
const NEAREST: f64 = 1.1;
/// Size of a wound above which the error grows with it, mm. No longer cut was measured.
const LONG_MM: f64 = 100.0;
/// Part of the opening by which a region may make it smaller.
const ERROR: f64 = 0.02;
/// The presets of materials and of skin with which regions were measured.
const MEASURED: [&str; 3] = ["trunk", "limb", "head"];

/// Gives a scene a region if it leaves `lattice.region` out and the region is safe: the scan is at
/// rest, so that nothing moves far from the cuts, nothing but incisions and sutures acts, and the
/// tissue and the skin are those of presets.
pub(super) fn fill(scene: &mut Scene) {
    let lattice = &scene.lattice;
    let free = lattice.region.is_none() && lattice.grading.is_none();
    let at_rest = scene.scan_is_at_rest && scene.model == ModelChoice::Pbd;
    let only_cut = scene.handle.is_empty() && scene.undermining.is_empty() && scene.excision.is_empty();
    if !(free && at_rest && only_cut && is_measured(scene)) {
        return;
    }
    let wound_mm = wound_size(scene);
    if !(wound_mm > 0.0 && wound_mm.is_finite()) {
        return;
    }
    let nearest = NEAREST * (wound_mm / LONG_MM).max(1.0);
    let around_mm = (DECAY_MM * (nearest / ERROR).ln()).ceil();
    let picked = PickedRegion { wound_mm, error: nearest * (-around_mm / DECAY_MM).exp() };
    let zone = RegionZone { around_mm: Some(around_mm), picked: Some(picked), ..RegionZone::default() };
    scene.lattice.region = Some(RegionSection::Zone(zone));
}

/// Whether tissue and skin have the values of presets with which regions were measured.
fn is_measured(scene: &Scene) -> bool {
    let is_known = |name: &String| MEASURED.contains(&name.as_str());
    let tissue = matches!(&scene.materials, Some(TissueMaterials::Preset(name)) if is_known(name));
    let skin = scene.constraints.membrane.as_ref().is_some_and(|skin| {
        let MembraneSection { preset, tension_along_n_per_m, tension_across_n_per_m, .. } = skin;
        let MembraneSection { modulus_along_n_per_m, modulus_across_n_per_m, .. } = skin;
        let own =
            [tension_along_n_per_m, tension_across_n_per_m, modulus_along_n_per_m, modulus_across_n_per_m];
        preset.as_ref().is_some_and(is_known) && own.iter().all(|value| value.is_none())
    });
    tissue && skin
}

/// The largest distance in mm between two points of the incisions. 0 without incisions.
fn wound_size(scene: &Scene) -> f64 {
    let paths = scene.incision.iter().flat_map(|incision| incision.path());
    let points: Vec<Point3<f64>> = paths.map(Point3::from).collect();
    let pairs = points.iter().enumerate().flat_map(|(n, p)| points[n + 1..].iter().map(|q| distance(p, q)));
    pairs.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const SKIN: &str = "constraints = { distance = {}, volume = {}, membrane = { preset = 'trunk' } }";

    fn region(lattice: &str, constraints: &str, more: &str) -> Option<RegionSection> {
        let text = format!(
            "materials = 'trunk'\nscan_is_at_rest = true\nvolume = {{ phantom = {{ size = [32, 32, 24] }} }}\n\
             lattice = {{ {lattice} }}\n\
             {constraints}\n[[incision]]\npath_mm = [[0, 0, 0], [30, 0, 0], [60, 80, 0]]\ndepth_mm = 10\n{more}"
        );
        Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap().scene.lattice.region
    }

    #[test]
    fn the_region_grows_with_the_wound() {
        let around = |more: &str| match region("", SKIN, more) {
            Some(RegionSection::Zone(zone)) => zone,
            other => panic!("{other:?}"),
        };
        let plain = around("");
        let picked = plain.picked.unwrap();
        assert_eq!((plain.around_mm, picked.wound_mm), (Some(105.0), 100.0));
        assert!(picked.error < ERROR && picked.error > 0.95 * ERROR);
        let longer = around("[[incision]]\nfrom_mm = [0, 0, 0]\nto_mm = [-60, -80, 0]\ndepth_mm = 5");
        assert_eq!((longer.around_mm, longer.picked.unwrap().wound_mm), (Some(123.0), 200.0));
    }

    #[test]
    fn a_region_is_picked_only_where_it_is_safe() {
        let whole = region("region = 'whole'", SKIN, "");
        assert!(matches!(whole, Some(RegionSection::Whole(_))));
        let own = region("region = { around_mm = 30 }", SKIN, "");
        assert_eq!(own, Some(RegionSection::around(30.0)));
        assert_eq!(region("grading = { around_mm = 30 }", SKIN, ""), None);
        for other in [
            "[[handle]]\nat_mm = [0, 0, 0]\nradius_mm = 5\nmove_mm = [1, 0, 0]",
            "[[undermining]]\nwound = 0\ndistance_mm = 20\ndepth_mm = 5",
            "[[excision]]\npath_mm = [[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 0]]\ndepth_mm = 5",
        ] {
            assert_eq!(region("", SKIN, other), None, "{other}");
        }
        let tense = SKIN.replace("'trunk'", "'trunk', tension_along_n_per_m = 50");
        assert_eq!(region("", &tense, ""), None);
        assert_eq!(region("", "constraints = { distance = {}, volume = {} }", ""), None);
    }

    /// The scene in a report has the region by its size, and reading it again does not pick one.
    #[test]
    fn a_picked_region_is_written_as_a_zone() {
        let picked = region("", SKIN, "").unwrap();
        assert_eq!(serde_json::to_value(&picked).unwrap(), serde_json::json!({ "around_mm": 105.0 }));
        let whole = region("region = 'whole'", SKIN, "").unwrap();
        assert_eq!(serde_json::to_value(&whole).unwrap(), serde_json::json!("whole"));
    }

    #[test]
    fn other_words_than_whole_are_refused() {
        let text = "volume = { phantom = { size = [32, 32, 24] } }\nlattice = { region = 'all' }";
        let error = Scene::parse(text, Path::new("test"), Path::new(""), &[]).unwrap_err().to_string();
        assert!(error.contains("lattice.region") && error.contains("\"whole\""), "{error}");
    }
}
