//! Read-only folders and full disks. The message names the file, and no partial file remains.

use crate::Desk;

/// Calls that write one file each. Every file is larger than the limits of the tests.
const WRITERS: [(&str, &str); 9] = [
    ("phantom --size 64,64,48 --out out/ct.nii", "out/ct.nii"),
    ("phantom --size 64,64,48 --out out/ct.nii.gz", "out/ct.nii.gz"),
    ("skin ct.nii --out out/skin.vtu", "out/skin.vtu"),
    ("skin ct.nii --out out/skin.vtp", "out/skin.vtp"),
    ("skin ct.nii --out out/skin.ply", "out/skin.ply"),
    ("resample scene.toml --run run --out out/deformed.nii.gz", "out/deformed.nii.gz"),
    ("resample scene.toml --run run --labels ct.nii --out out/labels.mha", "out/labels.mha"),
    ("resample scene.toml --run run --field to-rest --out out/field.nrrd", "out/field.nrrd"),
    ("render ct.nii --out out/skin.png --pixels 700", "out/skin.png"),
];

/// Outputs of a run, and the first file that exceeds the limit.
const RUNS: [(&str, &str); 7] = [
    ("output={surface=true}", "out/skin.vtu"),
    ("output={tissue=true}", "out/tissue.vtu"),
    ("output={ply=true}", "out/skin.ply"),
    ("output={stl=true}", "out/skin.stl"),
    ("output={displacement=true}", "out/displacement.nrrd"),
    ("output={volume=true}", "out/deformed.nii.gz"),
    ("run.checkpoint_every=1", "out/checkpoint.bin"),
];

/// A folder with a volume, a finished run and an empty `out`.
fn prepared() -> Desk {
    let desk = Desk::new();
    desk.cutis(&["phantom", "--size", "48,48,36", "--out", "ct.nii"]).expect_success();
    desk.cutis(&[
        "run",
        "scene.toml",
        "--out",
        "run",
        "--set",
        "output={}",
        "--set",
        "run.checkpoint_every=2",
    ])
    .expect_success();
    std::fs::create_dir(desk.path("out")).unwrap();
    desk
}

/// Every call that writes, and the file that exceeds the limit.
fn calls() -> impl Iterator<Item = (String, &'static str)> {
    let run = |(set, file)| (format!("run scene.toml --out out --set output={{}} --set {set}"), file);
    WRITERS.iter().map(|&(call, file)| (call.to_owned(), file)).chain(RUNS.into_iter().map(run))
}

/// Files are limited to 16 KiB. Longer writes fail as on a full disk, also for root.
#[test]
fn a_write_that_fails_leaves_nothing() {
    let desk = prepared();
    for (call, file) in calls() {
        let done = desk.script(&format!("trap '' XFSZ; ulimit -f 16; exec \"$cutis\" {call}"));
        done.expect_error(1, &[file]);
        assert!(desk.names("out").is_empty(), "{call} left {:?}", desk.names("out"));
    }
}

/// A failed write keeps the previous file unchanged.
#[test]
fn a_write_that_fails_keeps_the_old_file() {
    let desk = prepared();
    for (call, file) in calls() {
        desk.put(file, "the old file");
        let done = desk.script(&format!("trap '' XFSZ; ulimit -f 16; exec \"$cutis\" {call}"));
        done.expect_error(1, &[file]);
        assert_eq!(std::fs::read(desk.path(file)).unwrap(), b"the old file", "{call}");
        std::fs::remove_file(desk.path(file)).unwrap();
        assert!(desk.names("out").is_empty(), "{call} left {:?}", desk.names("out"));
    }
}

/// Negative control: the same calls succeed without a limit.
#[test]
fn the_same_calls_succeed_without_a_limit() {
    let desk = prepared();
    for (call, file) in calls() {
        desk.script(&format!("exec \"$cutis\" {call}")).expect_success();
        assert!(
            std::fs::metadata(desk.path(file)).unwrap().len() > 16 << 10,
            "{file} would fit into the limit"
        );
    }
}

/// The call runs with a small file system in its own mount namespace.
#[test]
fn a_full_disk_leaves_nothing() {
    let desk = prepared();
    let inside = |script: &str| {
        let quoted = script.replace('\'', "'\\''");
        let user = "$([ \"$(id -u)\" = 0 ] || echo --user --map-root-user)";
        desk.script(&format!(
            "exec unshare --mount {user} bash -c 'mount -t tmpfs -o size=16k none out && {quoted}'"
        ))
    };
    if inside("true").code != 0 {
        eprintln!(
            "skipped: this system lets nobody mount a tmpfs here; the limit on file sizes stands in for it"
        );
        return;
    }
    for (call, file) in calls() {
        let done = inside(&format!("{{ \"$cutis\" {call}; code=$?; ls -A out >left; exit $code; }}"));
        done.expect_error(1, &[file]);
        assert!(done.stderr.contains("No space left"), "{}", done.stderr);
        assert_eq!(std::fs::read_to_string(desk.path("left")).unwrap(), "", "{call}");
    }
    assert!(desk.names("out").is_empty());
}

/// Root can write almost anywhere, but nobody can write below a file or in /proc.
#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let desk = prepared();
    desk.put("file", "");
    for place in ["file", "/proc"] {
        for (call, file) in calls() {
            let file = file.replace("out", place);
            let call = call.replace("--out out", &format!("--out {place}"));
            let done = desk.cutis(&call.split(' ').collect::<Vec<_>>());
            done.expect_error(1, &[if call.starts_with("run") { place } else { &file }]);
        }
    }
    assert_eq!(std::fs::read(desk.path("file")).unwrap(), b"");
}
