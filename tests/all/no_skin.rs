//! A CT without a skin is refused with the reason, and with what to change.

use cutis::mesh::{SkinMode, Split};
use cutis::volume::{Volume, nifti, phantom, sample::LatticeSize};
use cutis::{Error, NoSkin, Override, Scene, Silent, SkinRequest};

use crate::scenes::{SMALL, folder, overrides};

/// A torso with `change` made to each of its HU. The file has no intercept.
fn torso(change: impl Fn(i16) -> i16) -> Volume {
    let ct = phantom::Phantom::new([48, 48, 36], 1).unwrap().volume().unwrap();
    assert_eq!((ct.slope(), ct.intercept()), (1.0, 0.0));
    let grid = *ct.grid();
    Volume::new(grid, ct.into_voxels().into_iter().map(change).collect(), 1.0, 0.0).unwrap()
}

fn skin(volume: &Volume, offset_hu: f32) -> Result<usize, Error> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ct.nii.gz");
    nifti::write(&file, volume).unwrap();
    let lattice = LatticeSize::SpacingMm(12.0);
    let (split, mode) = (Split::Kuhn6, SkinMode::Exterior);
    let request = SkinRequest { read: Default::default(), lattice, split, mode, offset_hu };
    cutis::find_skin(&file, &request, None, &Silent).map(|report| report.triangles)
}

/// What `cutis check` says of the small scene with this volume.
fn check(volume: &Volume, set: &[(&str, &str)]) -> Result<usize, Error> {
    let here = tempfile::tempdir().unwrap();
    let file = here.path().join("ct.nii.gz");
    nifti::write(&file, volume).unwrap();
    let mut keys = vec![Override { key: "volume".into(), value: format!("{{ path = {file:?} }}") }];
    keys.extend(overrides(&[("lattice", "{ spacing_mm = 12.0 }")]));
    keys.extend(overrides(set));
    let loaded = Scene::load(&folder().join(SMALL), &keys).unwrap();
    cutis::check(&loaded, &Silent).map(|plan| plan.sizes.skin_triangles)
}

fn why(error: Error) -> NoSkin {
    let text = error.to_string();
    assert!(error.is_bad_input() && text.contains("ct.nii.gz") && !text.contains("inf"), "{text}");
    match error {
        Error::NoSkin { why, .. } => why,
        Error::SceneSection { section, source, .. } if section == "volume" => why(*source),
        other => panic!("{other}"),
    }
}

/// Air is 0 and water 1024 in the file. With the offset that the message advises, the skin is that
/// of the same CT in HU.
#[test]
fn a_ct_with_an_offset_is_noticed_and_read_with_its_offset() {
    let (plain, offset) = (torso(|hu| hu), torso(|hu| hu + 1024));
    let triangles = skin(&plain, 0.0).unwrap();
    assert!(triangles > 500, "{triangles}");
    for found in [why(skin(&offset, 0.0).unwrap_err()), why(check(&offset, &[]).unwrap_err())] {
        let NoSkin::Offset { lowest_hu, has_padding, key, advice_hu, .. } = found.clone() else {
            panic!("{found}")
        };
        assert!((0.0..100.0).contains(&lowest_hu) && !has_padding && advice_hu == -1024.0, "{found}");
        assert!(found.to_string().contains(&format!("{key} = -1024")), "{found}");
    }
    assert_eq!(skin(&offset, -1024.0).unwrap(), triangles);
    let of_scene = check(&plain, &[]).unwrap();
    assert_eq!(check(&offset, &[("volume.offset_hu", "-1024")]).unwrap(), of_scene);
}

/// Padding far below air does not hide the offset. Control: padding in a CT in HU is no fault.
#[test]
fn padding_does_not_hide_an_offset() {
    let pad = |hu: i16, to: i16| if hu < -1010 { -3024 } else { hu + to };
    let found = why(skin(&torso(|hu| pad(hu, 1024)), 0.0).unwrap_err());
    assert!(matches!(found, NoSkin::Offset { has_padding: true, .. }), "{found}");
    assert!(skin(&torso(|hu| pad(hu, 0)), 0.0).unwrap() > 500);
}

#[test]
fn each_reason_has_its_own_message() {
    let air = why(skin(&torso(|_| -1000), 0.0).unwrap_err());
    assert!(matches!(air, NoSkin::AllAir { highest_hu: -1000.0, .. }), "{air}");
    let masked = torso(|hu| if hu < -200 { 0 } else { hu });
    for found in [why(skin(&masked, 0.0).unwrap_err()), why(check(&masked, &[]).unwrap_err())] {
        assert!(matches!(found, NoSkin::AllTissue { .. }), "{found}");
    }
    let grid = *torso(|hu| hu).grid();
    let solid = |hu: &dyn Fn([usize; 3]) -> i16| {
        Volume::new(grid, (0..grid.len()).map(|n| hu(grid.point(n))).collect(), 1.0, 0.0).unwrap()
    };
    let hole = solid(&|p| if p.iter().all(|c| (12..20).contains(c)) { -1000 } else { 40 });
    let found = why(check(&hole, &[]).unwrap_err());
    assert!(matches!(found, NoSkin::Enclosed), "{found}");
    let sheet = solid(&|[i, ..]| if i == 24 { 400 } else { -700 });
    let found = why(skin(&sheet, 0.0).unwrap_err());
    assert!(matches!(found, NoSkin::AllAir { .. } | NoSkin::TooThin { .. }), "{found}");
}

/// `cutis inspect` names the offset too. Control: it does not for a CT in HU.
#[test]
fn inspect_warns_about_an_offset() {
    let folder = tempfile::tempdir().unwrap();
    let warns = |to: i16| {
        let file = folder.path().join("ct.nii");
        nifti::write(&file, &torso(|hu| hu + to)).unwrap();
        cutis::inspect(&file, &Default::default())
            .unwrap()
            .warnings
            .iter()
            .any(|line| line.contains("volume.offset_hu = -1024"))
    };
    assert!(warns(1024) && !warns(0));
}
