//! Exit codes: 0 for success, 1 for a failure during a run, 2 for bad input or usage. Messages name
//! file, key and value.

use crate::Desk;

#[test]
fn successful_calls_end_with_zero() {
    let desk = Desk::new();
    for call in [
        "--help",
        "--version",
        "scene new",
        "check scene.toml",
        "devices",
        "run scene.toml --out run",
        "run scene.toml --frames 0",
    ] {
        let done = desk.cutis(&call.split(' ').collect::<Vec<_>>()).expect_success();
        assert!(!done.stdout.is_empty() && !done.stderr.contains("error"), "{call}: {}", done.stderr);
    }
    assert!(desk.path("run/report.json").is_file() && desk.path("scene-run/report.json").is_file());
}

#[test]
fn usage_errors_end_with_two() {
    let desk = Desk::new();
    let calls: [&[&str]; 15] = [
        &[],
        &["unheard-of"],
        &["run"],
        &["run", "scene.toml", "--unheard-of"],
        &["run", "scene.toml", "--set", "frames"],
        &["run", "scene.toml", "--set", "=1"],
        &["run", "scene.toml", "--frames", "-1"],
        &["run", "scene.toml", "--without", "skin"],
        &["check", "scene.toml", "--lattice", "1,2"],
        &["skin", "a.nii", "--mode", "unheard-of"],
        &["phantom", "--size", "8,8", "--out", "a.nii"],
        &["phantom", "--turn-deg", "15", "0", "--out", "a.nii"],
        &["phantom", "--turn-deg", "15", "nan", "0", "--out", "a.nii"],
        &["render", "a.nii", "--out", "a.png", "--side", "inside"],
        &["render", "a.nii", "--out", "a.png", "--slice", "axial@1", "--side", "left"],
    ];
    for call in calls {
        let done = desk.cutis(call);
        assert_eq!(done.code, 2, "{call:?}: {}", done.stderr);
        assert!(done.stdout.is_empty() && done.stderr.contains("--help"), "{call:?}: {}", done.stderr);
    }
    assert_eq!(desk.names("."), ["scene.toml"]);
}

#[test]
fn bad_input_ends_with_two_and_a_message_that_names_it() {
    let desk = Desk::new();
    desk.put("typo.toml", crate::SCENE.replace("depth_mm", "depht_mm"));
    desk.put("type.toml", crate::SCENE.replace("rest_area_scale = 0.8", "rest_area_scale = \"tight\""));
    desk.put("syntax.toml", "[volume\n");
    desk.put("lost.toml", "[volume]\npath = 'missing.nii.gz'\n[lattice]\n");
    desk.put("empty.toml", "");
    desk.put("text.nii", "this is no volume");
    desk.cutis(&["phantom", "--size", "16,16,12", "--out", "good.nii"]).expect_success();
    let bytes = std::fs::read(desk.path("good.nii")).unwrap();
    desk.put("half.nii", &bytes[..bytes.len() / 2]);
    desk.cutis(&["phantom", "--size", "16,16,12", "--out", "good.nii.gz"]).expect_success();
    let bytes = std::fs::read(desk.path("good.nii.gz")).unwrap();
    desk.put("half.nii.gz", &bytes[..bytes.len() / 2]);
    desk.put("hostile.nii", hostile_header());
    let cases: [(&str, &[&str]); 35] = [
        ("run missing.toml", &["missing.toml", "read"]),
        ("run typo.toml", &["typo.toml", "incision[0].depht_mm", "depth_mm"]),
        ("run type.toml", &["type.toml", "constraints.stc.rest_area_scale", "tight"]),
        ("run syntax.toml", &["syntax.toml", "line 1"]),
        ("run scene.toml --set solver.dt_s=-1", &["scene.toml", "solver.dt_s", "-1", "above 0"]),
        ("run scene.toml --set run.frame=1", &["scene.toml", "run.frame", "frames"]),
        ("run scene.toml --adapter=", &["scene.toml", "solver.adapter", "cutis devices"]),
        ("run scene.toml --backend tpu", &["scene.toml", "solver.backend", "tpu", "reference"]),
        (
            "run scene.toml --set tissue.air_below_hu=5000",
            &["scene.toml", "tissue.air_below_hu", "5000", "air"],
        ),
        ("run scene.toml --resume --out nothing-there", &["nothing-there/checkpoint.bin", "there is no"]),
        ("check scene.toml --set volume.path=a.nii", &["scene.toml", "volume", "exactly one"]),
        ("check scene.toml --set volume={path='half.nii'}", &["half.nii", "truncated"]),
        ("check scene.toml --lattice 0.0001", &["scene.toml", "lattice.spacing_mm", "0.0001", "or more"]),
        ("check scene.toml --lattice 1000", &["lattice.spacing_mm", "1000", "shortest side"]),
        ("check scene.toml --set ..=3", &["key `..`", "an empty name"]),
        ("check scene.toml --set solver.substeps=0", &["scene.toml, overridden: key `solver.substeps`"]),
        (
            "check scene.toml --set incision.0.to_mm.1=500",
            &["key `incision[0]`: the segment", "from the skin, its start", "it must lie within 50.0 mm"],
        ),
        ("resample scene.toml --run nope --out out.nii", &["nope/checkpoint.bin", "there is no folder nope"]),
        ("check lost.toml", &["lost.toml", "volume.path", "missing.nii.gz"]),
        ("check empty.toml", &["empty.toml", "key `volume`", "is missing"]),
        (
            "check scene.toml --set stpe=1",
            &["scene.toml", "unknown key", "`stpe`; the nearest one is `step`; expected"],
        ),
        ("check scene.toml --set run.frames=1.5", &["run.frames", "1.5", "expected a whole number"]),
        (
            "check scene.toml --set incision.0.depth_mm=2000",
            &["scene.toml", "incision[0].depth_mm", "2000", "the diagonal of the scan"],
        ),
        ("inspect missing.nii.gz", &["missing.nii.gz", "No such file"]),
        ("inspect scene.toml", &["scene.toml", "not a NIfTI file"]),
        ("inspect text.nii", &["text.nii"]),
        ("inspect half.nii", &["half.nii", "truncated"]),
        ("inspect half.nii.gz", &["half.nii.gz"]),
        ("inspect hostile.nii", &["hostile.nii", "truncated"]),
        ("skin hostile.nii", &["hostile.nii", "truncated"]),
        ("skin good.nii --out skin.obj", &["skin.obj", ".vtu"]),
        ("render good.nii --out a.png --slice axial", &["--slice axial", "axial@MM"]),
        ("render good.nii --out a.png --slice axial@9999", &["--slice axial@9999", "it goes from"]),
        ("render good.nii --out a.jpg", &["--out a.jpg", ".png"]),
        ("phantom --size 8,0,8 --out a.nii", &["[8, 0, 8]"]),
    ];
    for (call, words) in cases {
        desk.cutis(&call.split(' ').collect::<Vec<_>>()).expect_error(2, words);
    }
    for file in ["skin.obj", "a.png", "a.jpg", "a.nii"] {
        assert!(!desk.path(file).exists(), "{file}");
    }
}

#[test]
fn a_run_that_fails_ends_with_one() {
    let desk = Desk::new();
    let done = desk.cutis(&["run", "scene.toml", "--out", "run", "--set", "solver.gravity_m_s2=[1e300,0,0]"]);
    done.expect_error(1, &["finite"]);
    assert!(desk.names("run").is_empty(), "{:?}", desk.names("run"));
    let gravity = "solver={ formulation = 'vbd', gravity_m_s2 = [0, 0, 1e300] }";
    let done = desk.cutis(&["run", "scene.toml", "--out", "run", "--set", gravity]);
    done.expect_error(2, &["gravity_m_s2", "1e300"]);
}

/// A file of 1 KB with a header for 32767³ voxels, which would take 70 TB.
fn hostile_header() -> Vec<u8> {
    let mut bytes = vec![0_u8; 1024];
    let mut put = |offset: usize, value: &[u8]| bytes[offset..offset + value.len()].copy_from_slice(value);
    put(0, &348_i32.to_le_bytes());
    for (n, size) in [3_i16, 32767, 32767, 32767, 1, 1, 1, 1].iter().enumerate() {
        put(40 + 2 * n, &size.to_le_bytes());
        put(76 + 4 * n, &1_f32.to_le_bytes());
    }
    put(70, &4_i16.to_le_bytes());
    put(72, &16_i16.to_le_bytes());
    put(108, &352_f32.to_le_bytes());
    put(344, b"n+1\0");
    bytes
}

/// The checkpoint of another scene is refused with the keys that differ.
#[test]
fn the_keys_of_another_scene_are_named() {
    let desk = Desk::new();
    let run = ["run", "scene.toml", "--out", "run", "--set", "run.checkpoint_every=2"];
    desk.cutis(&run).expect_success();
    let resample = ["resample", "scene.toml", "--run", "run", "--out", "out.nii", "--set"];
    // Control: keys of the run and of its outputs may differ.
    desk.cutis(&[&resample[..], &["run.frames=7"]].concat()).expect_success();
    for (change, key) in [
        ("solver.substeps=3", "differs in `solver.substeps`;"),
        ("lattice.spacing_mm=16", "differs in `lattice.spacing_mm`;"),
    ] {
        let other = desk.cutis(&[&resample[..], &[change]].concat());
        other.expect_error(2, &["run/checkpoint.bin", key, "--set"]);
    }
    std::fs::remove_file(desk.path("run/report.json")).unwrap();
    desk.cutis(&[&resample[..], &["solver.substeps=3"]].concat())
        .expect_error(2, &["program version differ"]);
}

/// A lattice that is too fine for the memory is refused with the need, the memory and the key,
/// before anything of its size is allocated. The address space is limited, so that the test needs
/// no large machine. Control: the same limit suffices for the lattice of the scene.
#[cfg(target_os = "linux")]
#[test]
fn a_lattice_that_exceeds_the_memory_is_refused_by_name() {
    let desk = Desk::new();
    let limited = |call: &str| desk.script(&format!("ulimit -v 3000000; exec \"$cutis\" {call}"));
    limited("check scene.toml --backend cpu").expect_success();
    limited("check scene.toml --backend cpu --set lattice.spacing_mm=0.5").expect_error(
        2,
        &["scene.toml", "lattice.spacing_mm", "0.5", "GB of memory", "GB are available", "lattice.region"],
    );
    limited("check scene.toml --backend cpu --lattice 1.2")
        .expect_error(2, &["scene.toml", "lattice.spacing_mm", "tetrahedra", "GB are available"]);
    desk.cutis(&["phantom", "--size", "48,48,36", "--out", "ct.nii"]).expect_success();
    limited("skin ct.nii --lattice 0.5").expect_error(2, &["--lattice", "GB of memory", "larger spacing"]);
}
