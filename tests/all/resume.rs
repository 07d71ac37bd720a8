//! A resumed run is bit-identical to an uninterrupted one. A checkpoint that does not fit is
//! refused.

use std::path::Path;

use cutis::{Error, LoadedScene};
use sha2::{Digest, Sha256};

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
    let mut without = dragged("5");
    without.scene.run.checkpoint_every = 0;
    let missing = refused("missing", &without, "run.checkpoint_every");
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
        (7, "version 4"),
        (20, "damaged"),
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

/// A run with checkpoints that ended before the first of them can be repeated by the same command.
#[test]
fn resuming_before_the_first_checkpoint_begins_again() {
    let [fresh, resumed] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    run_in(fresh.path(), &dragged("5"), false).unwrap();
    assert_eq!(run_in(resumed.path(), &dragged("5"), true).unwrap().frames.count, 5);
    for file in ["checkpoint.bin", "skin.vtu"] {
        let read = |folder: &Path| std::fs::read(folder.join(file)).unwrap();
        assert!(read(fresh.path()) == read(resumed.path()), "{file} differs");
    }
}

/// A checksum is no proof of a good writer: lengths that contradict the scene must not panic.
#[test]
fn a_checkpoint_with_false_lengths_and_a_right_checksum_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("checkpoint.bin");
    run_in(folder.path(), &dragged("5"), false).unwrap();
    let good = std::fs::read(&file).unwrap();
    let vertices = u64::from_le_bytes(good[44..52].try_into().unwrap());
    // The history: the number of wounds, sutures, handles and rows.
    let history = 52 + 12 * vertices as usize;
    let counts: Vec<u32> =
        good[history..history + 16].as_chunks().0.iter().map(|&count| u32::from_le_bytes(count)).collect();
    assert_eq!(counts, [1, 0, 1, 6]);
    let rests = history + 16 + 6 * 8 * (2 + 5 + 1);
    let changed = |at: usize, value: &[u8]| {
        let mut bytes = good[..good.len() - 32].to_vec();
        bytes[at..at + value.len()].copy_from_slice(value);
        let seal: [u8; 32] = Sha256::digest(&bytes).into();
        [bytes, seal.to_vec()].concat()
    };
    let nan = f32::NAN.to_le_bytes();
    for (what, at, value) in [
        ("frames", 40, 4u32.to_le_bytes()),
        ("no vertices", 44, [0; 4]),
        ("fewer vertices", 44, (vertices as u32 - 1).to_le_bytes()),
        ("countless vertices", 44, [255; 4]),
        ("no wounds", history, [0; 4]),
        ("countless wounds", history, [255; 4]),
        ("sutures", history + 4, 1u32.to_le_bytes()),
        ("no handles", history + 8, [0; 4]),
        ("no rows", history + 12, [0; 4]),
        ("fewer rows", history + 12, 5u32.to_le_bytes()),
        ("many rows", history + 12, (vertices as u32).to_le_bytes()),
        ("states of rest", rests, 4u32.to_le_bytes()),
        ("countless states of rest", rests, [255; 4]),
        ("a position that is not a number", 52, nan),
    ] {
        std::fs::write(&file, changed(at, &value)).unwrap();
        let error = run_in(folder.path(), &dragged("10"), true).expect_err(what);
        assert!(!error.to_string().is_empty(), "{what}");
        let is_typed = matches!(error, Error::Checkpoint { .. }) || value == nan;
        assert!(is_typed && error.is_bad_input(), "{what}: {error:?}");
    }
    // Control: the right lengths.
    std::fs::write(&file, changed(40, &5u32.to_le_bytes())).unwrap();
    run_in(folder.path(), &dragged("10"), true).unwrap();
}
