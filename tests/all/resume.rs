//! A resumed run is bit-identical to an uninterrupted one. A checkpoint that does not fit is
//! refused.

use std::path::Path;

use cutis::{Error, LoadedScene};

use crate::scenes::{SMALL, frames, run_in, scene};

/// A wound that opens while a handle drags the belly. The handle still moves at frame 5.
fn dragged(frames: &str) -> LoadedScene {
    scene(
        SMALL,
        &[
            ("handle", "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 20, 5], over_s = 0.1 }]"),
            ("run.frames", frames),
            ("run.checkpoint_every", "5"),
            ("output", "{ surface = true, report = true }"),
        ],
    )
}

#[test]
fn five_frames_and_five_more_equal_ten() {
    let [whole, halves] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let whole_report = run_in(whole.path(), &dragged("10"), false).unwrap();
    run_in(halves.path(), &dragged("5"), false).unwrap();
    let read = |folder: &Path, file: &str| std::fs::read(folder.join(file)).unwrap();
    assert!(read(whole.path(), "checkpoint.bin") != read(halves.path(), "checkpoint.bin"));

    let resumed_report = run_in(halves.path(), &dragged("10"), true).unwrap();
    for file in ["checkpoint.bin", "skin.vtu"] {
        assert!(read(whole.path(), file) == read(halves.path(), file), "{file} differs");
    }
    assert_eq!(frames(whole.path()), frames(halves.path()));
    assert_eq!((whole_report.frames.count, resumed_report.frames.count), (10, 5));
    let table = std::fs::read_to_string(halves.path().join("frames.csv")).unwrap();
    let frames: Vec<&str> = table.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    assert_eq!(frames, ["0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10"], "the first half is kept");
    let wound =
        |report: &cutis::report::Report| report.wound.as_ref().map(|w| (w.initial_mm, w.final_mm, w.mid_mm));
    assert_eq!(wound(&whole_report), wound(&resumed_report));
}

/// Resuming a finished run computes no frame and writes the same outputs.
#[test]
fn resuming_at_the_end_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    run_in(folder.path(), &dragged("5"), false).unwrap();
    let before = std::fs::read(folder.path().join("skin.vtu")).unwrap();
    assert_eq!(run_in(folder.path(), &dragged("5"), true).unwrap().frames.count, 0);
    assert!(std::fs::read(folder.path().join("skin.vtu")).unwrap() == before);
}

#[test]
fn a_checkpoint_that_does_not_fit_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("checkpoint.bin");
    let refused = |what: &str, loaded: &LoadedScene, expected: &str| {
        let error = run_in(folder.path(), loaded, true).unwrap_err();
        let text = error.to_string();
        assert!(error.is_bad_input(), "{what}: {text}");
        assert!(text.contains(file.to_str().unwrap()) && text.contains(expected), "{what}: {text}");
        error
    };
    let missing = refused("missing", &dragged("5"), "run.checkpoint_every");
    assert!(matches!(missing, Error::Checkpoint { .. }), "{missing:?}");

    run_in(folder.path(), &dragged("5"), false).unwrap();
    let good = std::fs::read(&file).unwrap();
    let mut other = dragged("10");
    other.scene.solver.substeps = 11;
    refused("another scene", &other, "differ");
    refused("beyond the last frame", &dragged("3"), "run.frames = 3");
    for length in [0, 7, 51, 83, good.len() / 2, good.len() - 1] {
        std::fs::write(&file, &good[..length]).unwrap();
        let error = refused("truncated", &dragged("10"), "");
        assert!(matches!(error, Error::Checkpoint { .. }), "{error:?}");
    }
    for (position, expected) in [
        (0, "begin"),
        (20, "differ"),
        (41, "damaged"),
        (45, "damaged"),
        (1000, "damaged"),
        (good.len() - 1, "damaged"),
    ] {
        let mut flipped = good.clone();
        flipped[position] ^= 1;
        std::fs::write(&file, &flipped).unwrap();
        let error = refused("flipped byte", &dragged("10"), expected);
        assert!(matches!(error, Error::Checkpoint { .. }), "{error:?}");
    }
    std::fs::write(&file, &good).unwrap();
    run_in(folder.path(), &dragged("10"), true).unwrap();
}
