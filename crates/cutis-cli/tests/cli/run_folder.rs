//! A run folder holds the files of one run: those of an earlier run go, those of the user stay.

use crate::Desk;

#[test]
fn a_second_run_removes_the_files_of_the_first() {
    let desk = Desk::new();
    let run = |set: &str| desk.cutis(&["run", "scene.toml", "--out", "run", "--set", set]).expect_success();
    run("output={ report = true, surface = true, volume = true }");
    desk.put("run/notes.txt", "mine");
    desk.put("run/tissue.vtu", "not of this run");
    let second = run("output={ report = true }");
    let names = desk.names("run");
    assert_eq!(names, ["frames.csv", "notes.txt", "report.html", "report.json", "tissue.vtu"]);
    for words in ["removed the files of an earlier run", "deformed.nii.gz", "skin.vtu"] {
        assert!(second.stderr.contains(words), "{}", second.stderr);
    }
    assert!(second.stderr.contains("does not write") && second.stderr.contains("tissue.vtu"));
    // Control: a run that writes the same files removes none.
    let third = run("output={ report = true }");
    assert!(!third.stderr.contains("removed the files"), "{}", third.stderr);
}

/// The folder is tested before the time of a run is spent. A file system without space for one
/// file name stands for a folder that the user may not write to, because root may write anywhere.
#[test]
fn a_folder_that_cannot_be_written_is_refused_before_the_ct_is_read() {
    let desk = Desk::new();
    desk.put("file", "");
    for out in ["file", "file/run", "/proc", "/proc/run"] {
        let done = desk.cutis(&["run", "scene.toml", "--out", out]);
        done.expect_error(1, &[out]);
        assert!(!done.stderr.contains("make the phantom"), "{}", done.stderr);
    }
}

/// A killed run once removed the series of an earlier run and kept its checkpoint, from which
/// `--resume` then made an incomplete series.
#[test]
fn a_checkpoint_goes_with_its_series() {
    let desk = Desk::new();
    let run = |output: &str, frames: &str, every: &str| {
        let [output, every] = [format!("output={output}"), format!("run.checkpoint_every={every}")];
        let set = ["--frames", frames, "--set", &output, "--set", &every];
        desk.cutis(&[&["run", "scene.toml", "--out", "run"][..], &set].concat()).expect_success();
    };
    run("{ series_every = 1 }", "2", "1");
    assert_eq!(desk.names("run"), ["checkpoint.bin", "skin-series", "skin.pvd"]);
    run("{ series_every = 1 }", "1", "0");
    assert_eq!(desk.names("run"), ["skin-series", "skin.pvd"]);
    assert_eq!(desk.names("run/skin-series"), ["skin-000000.vtp", "skin-000001.vtp"]);
    // Control: a run without a series leaves a checkpoint alone.
    run("{}", "2", "1");
    run("{}", "1", "0");
    assert!(desk.path("run/checkpoint.bin").exists());
}
