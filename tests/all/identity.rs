//! A body that does not move gives the input CT back, with the same voxels at the same positions.

use cutis::volume::{AIR_HU, Volume, phantom::Phantom};

use crate::scenes::{Run, SMALL, scene};

const VOLUME_ONLY: (&str, &str) = ("output", "{ volume = true }");
const UNCUT: (&str, &str) = ("incision", "[]");

fn deformed(set: &[(&str, &str)]) -> Volume {
    Run::of(&scene(SMALL, set)).deformed()
}

/// The CT of the small phantom.
pub fn original() -> Volume {
    Phantom::new([64, 64, 48], 1).unwrap().volume().unwrap()
}

#[test]
fn a_body_at_rest_gives_the_input_back() {
    let original = original();
    let still: [&[(&str, &str)]; 4] = [
        &[("constraints", "{}"), ("run.frames", "0")],
        &[("run.frames", "0")],
        &[("constraints", "{}"), ("run.frames", "5")],
        &[("constraints.stc.rest_area_scale", "1.0"), ("run.frames", "5")],
    ];
    for set in still {
        let set = [set, &[VOLUME_ONLY, UNCUT]].concat();
        let found = deformed(&set);
        assert_eq!(found.grid(), original.grid(), "{set:?}");
        assert!(found.voxels() == original.voxels(), "{set:?}: voxels differ");
    }
}

#[test]
fn skin_tension_changes_the_volume() {
    let found = deformed(&[VOLUME_ONLY, UNCUT, ("run.frames", "5")]);
    assert_eq!(found.grid(), original().grid());
    assert!(found.voxels() != original().voxels());
}

/// Tissue that an incision removes becomes air. All other voxels keep their values.
#[test]
fn a_cut_that_does_not_move_only_removes_tissue() {
    let (original, found) = (original(), deformed(&[VOLUME_ONLY, ("run.frames", "0")]));
    let pairs = original.voxels().iter().zip(found.voxels());
    let changed: Vec<usize> = pairs.enumerate().filter(|(_, (a, b))| a != b).map(|(n, _)| n).collect();
    assert!(changed.len() > 100, "{}", changed.len());
    for n in changed {
        assert_eq!(f32::from(found.voxels()[n]), AIR_HU);
        let [x, y, z]: [f64; 3] = original.grid().mm(original.grid().point(n)).into();
        assert!((x - 30.0).abs() < 25.0 && y > 60.0 && z.abs() < 75.0, "{:?}", [x, y, z]);
    }
}
