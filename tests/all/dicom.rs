//! A scene takes a DICOM series, as a folder and as one of its files.

use cutis::volume::{self, ReadOptions, nifti};

use crate::scenes::{Run, overrides, real};

const SCENE: &str = "
[lattice]
vertices = [24, 28, 12]
[volume]
[constraints.distance]
youngs_modulus_pa = 1e4
[solver]
dt_s = 0.02
[run]
frames = 1
[output]
volume = true
report = true
";

fn load(set: &[(&str, &str)]) -> Result<cutis::LoadedScene, cutis::Error> {
    cutis::Scene::parse(SCENE, "dicom.toml".as_ref(), "".as_ref(), &overrides(set))
}

#[test]
fn a_tilted_series_runs_on_perpendicular_axes() {
    let Some(folder) = real("dicom/head_tilt_variable_spacing") else { return };
    let path = [("volume.path", folder.as_str()), ("volume.series", "2")];
    let plain = load(&path).unwrap();
    let error = cutis::check(&plain, &cutis::Silent).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("volume.resample = true"), "{error}");

    let resampled = load(&[&path[..], &[("volume.resample", "true")]].concat()).unwrap();
    let run = Run::of(&resampled);
    let options = ReadOptions { series: Some(2), resample: true };
    let input = volume::read(&folder, &options).unwrap().volume;
    let deformed = run.deformed();
    assert_eq!(deformed.grid().shape, input.grid().shape);
    let corner = input.grid().shape.map(|n| n - 1);
    assert!((deformed.grid().mm(corner) - input.grid().mm(corner)).norm() < 1e-3);
    assert!(
        run.report.warnings.iter().any(|warning| warning.contains("18.5 degrees")),
        "{:?}",
        run.report.warnings
    );

    // A file of the series names it too, and gives the same bytes.
    let file = format!("{folder}/07.dcm");
    let by_file = load(&[("volume.path", file.as_str()), ("volume.resample", "true")]).unwrap();
    let by_file = Run::of(&by_file);
    assert_eq!(by_file.report.inputs[1].sha256, run.report.inputs[1].sha256);
    let voxels = |run: &Run| nifti::read(run.path("deformed.nii.gz")).unwrap().volume.into_voxels();
    assert!(voxels(&by_file) == voxels(&run));
}

#[test]
fn keys_of_a_series_need_a_path() {
    for (key, value) in [("volume.series", "3"), ("volume.resample", "true")] {
        let error = load(&[("volume.phantom.size", "[8, 8, 8]"), (key, value)]).unwrap_err().to_string();
        assert!(error.contains(key) && error.contains("`path`"), "{error}");
    }
    assert!(load(&[("volume.phantom.size", "[8, 8, 8]"), ("volume.resample", "false")]).is_ok());
}
