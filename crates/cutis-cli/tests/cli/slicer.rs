//! What 3D Slicer, ITK and ParaView get: label maps, fields, time series, the module.

use crate::{Desk, SCENE};

/// A folder with a volume and a finished run.
fn finished() -> Desk {
    let desk = Desk::new();
    desk.cutis(&["phantom", "--size", "20,16,12", "--out", "labels.nii.gz"]).expect_success();
    let run = ["run", "scene.toml", "--out", "run", "--set", "output={}", "--set", "run.checkpoint_every=2"];
    desk.cutis(&run).expect_success();
    desk
}

#[test]
fn labels_and_fields_are_written_or_refused_by_name() {
    let desk = finished();
    let call = |words: &str| {
        let all = format!("resample scene.toml --run run {words}");
        desk.cutis(&all.split(' ').collect::<Vec<_>>())
    };
    for words in [
        "--labels labels.nii.gz --out moved.mha",
        "--field to-rest --out field.nrrd",
        "--field from-rest --out forward.nrrd",
    ] {
        let done = call(words).expect_success();
        assert!(done.stdout.contains("voxels of the body moved"), "{}", done.stdout);
    }
    let original = std::fs::read(desk.path("field.nrrd")).unwrap();
    assert!(original != std::fs::read(desk.path("forward.nrrd")).unwrap(), "two directions");
    desk.put("text.nrrd", "no labels");
    for (words, said) in [
        ("--labels text.nrrd --out a.nrrd", "text.nrrd"),
        ("--labels missing.mha --out a.nrrd", "missing.mha"),
        ("--labels labels.nii.gz --out a.png", "a.png"),
        ("--field to-rest --out a.nii.gz", ".nrrd"),
        ("--field to-rest --out a.nhdr", ".nrrd"),
    ] {
        call(words).expect_error(2, &[said]);
    }
    for words in [
        "--labels labels.nii.gz --volume labels.nii.gz --out a.nrrd",
        "--labels labels.nii.gz --field to-rest --out a.nrrd",
        "--volume labels.nii.gz --field to-rest --out a.nrrd",
        "--field sideways --out a.nrrd",
    ] {
        assert_eq!(call(words).code, 2, "{words}");
    }
    assert!(!["a.nrrd", "a.png", "a.nii.gz", "a.nhdr"].iter().any(|name| desk.path(name).exists()));
}

/// The frames that `skin.pvd` lists.
fn listed(desk: &Desk) -> Vec<u32> {
    let text = std::fs::read_to_string(desk.path("run/skin.pvd")).unwrap();
    let numbers = text.split("skin-series/skin-").skip(1);
    numbers.map(|rest| rest.split('.').next().unwrap().parse().unwrap()).collect()
}

#[test]
fn a_series_goes_on_with_a_resumed_run_and_goes_with_another_run() {
    let desk = Desk::new();
    let run = |more: &str| {
        let all = format!("run scene.toml --out run --set run.checkpoint_every=2 {more}");
        desk.cutis(&all.split(' ').collect::<Vec<_>>()).expect_success()
    };
    run("--set output.series_every=2 --frames 4");
    assert_eq!(listed(&desk), [0, 2, 4]);
    let first = std::fs::read(desk.path("run/skin-series/skin-000002.vtp")).unwrap();
    run("--set output.series_every=2 --frames 7 --resume");
    assert_eq!(listed(&desk), [0, 2, 4, 6, 7]);
    assert_eq!(std::fs::read(desk.path("run/skin-series/skin-000002.vtp")).unwrap(), first);
    run("--set output.series_every=3 --frames 3");
    assert_eq!(listed(&desk), [0, 3]);
    assert_eq!(desk.names("run/skin-series"), ["skin-000000.vtp", "skin-000003.vtp"]);
    desk.put("run/skin-series/notes.txt", "mine");
    run("--frames 2");
    assert_eq!(desk.names("run/skin-series"), ["notes.txt"]);
    assert!(!desk.path("run/skin.pvd").exists());
    let none = ["run", "scene.toml", "--out", "b", "--frames", "0", "--set", "output.series_every=2"];
    desk.cutis(&none).expect_error(2, &["output.series_every", "run.frames"]);
}

/// Settling computes no frames. Its series once was refused.
#[test]
fn a_series_has_the_states_of_rest() {
    let desk = Desk::new();
    let settle = ["settle", "scene.toml", "--out", "run", "--set", "output={ series_every = 2 }"];
    desk.cutis(&settle).expect_success();
    assert_eq!(desk.names("run/skin-series"), ["skin-000000.vtp", "skin-rest-000001.vtp"]);
    let list = std::fs::read_to_string(desk.path("run/skin.pvd")).unwrap();
    let [start, rest] = ["skin-000000.vtp", "skin-rest-000001.vtp"].map(|name| list.find(name).unwrap());
    assert!(start < rest && list.matches("timestep=\"0\"").count() == 1, "{list}");
    let skin = |name: &str| std::fs::read(desk.path(&format!("run/skin-series/{name}"))).unwrap();
    assert_ne!(skin("skin-000000.vtp"), skin("skin-rest-000001.vtp"));
    // Frames alone leave no state of rest behind.
    let frames =
        ["run", "scene.toml", "--out", "run", "--frames", "2", "--set", "output={ series_every = 2 }"];
    desk.cutis(&frames).expect_success();
    assert_eq!(desk.names("run/skin-series"), ["skin-000000.vtp", "skin-000002.vtp"]);
}

#[test]
fn a_scene_names_a_path_from_its_folder() {
    let desk = Desk::new();
    let ends = "from_mm = [30, 110, -50], to_mm = [30, 110, 50]";
    std::fs::create_dir(desk.path("scenes")).unwrap();
    desk.put("scenes/cut.txt", "30 110 -50\n30 110 50\n");
    desk.put("scenes/scene.toml", SCENE.replace(ends, "markups = \"cut.txt\""));
    let run = |scene: &str, out: &str| desk.cutis(&["run", scene, "--out", out]).expect_success();
    run("scene.toml", "points");
    run("scenes/scene.toml", "file");
    let skin = |out: &str| std::fs::read(desk.path(&format!("{out}/skin.vtu"))).unwrap();
    assert_eq!(skin("points"), skin("file"));
    desk.put("scenes/cut.txt", "30 110 -40\n30 110 50\n");
    run("scenes/scene.toml", "other");
    assert_ne!(skin("points"), skin("other"), "the control: a shorter path");
}

#[test]
fn a_call_by_slicer_is_known_by_its_flags() {
    let desk = Desk::new();
    let xml = desk.cutis(&["--xml"]).expect_success();
    assert!(xml.stdout.starts_with("<?xml") && xml.stderr.is_empty(), "{} {}", xml.stdout, xml.stderr);
    for words in [&["--xml", "run"][..], &["--unheard-of"], &["--depth", "deep"], &["--depth", "5"]] {
        let done = desk.cutis(words);
        assert_eq!((done.code, done.stdout.as_str()), (2, ""), "{words:?}: {}", done.stderr);
    }
    desk.cutis(&["--inputVolume=missing.nrrd", "--incision", "cut.mrk.json", "--outputModel", "a.ply"])
        .expect_error(2, &["cut.mrk.json"]);
    assert_eq!(desk.names("."), ["scene.toml"]);
}
