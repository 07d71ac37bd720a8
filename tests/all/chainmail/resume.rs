//! A resumed chain equals one that was never stopped.

use cutis::{ResampleInput, ResampleRequest, Silent};

use super::*;
use crate::scenes::{frames, run_in};

const ALL: (&str, &str) = ("output", "{ volume = true, surface = true, report = true }");
/// Two handles, one of which grabs what the other has moved.
const TURNS: (&str, &str) = (
    "handle",
    "[{ at_mm = [-18, 97, 0], radius_mm = 22, move_mm = [-12, 0, 0], over_s = 0.25 },
      { at_mm = [-53, 90, 0], radius_mm = 11, move_mm = [0, 12, 0], at_s = 0.25, over_s = 0.25 }]",
);
/// A handle that fixed tissue cannot follow.
const FAR: (&str, &str) =
    ("handle", "[{ at_mm = [-15, 105, 0], radius_mm = 11, move_mm = [-150, 0, 9], over_s = 0.375 }]");

/// The run is split before, at and after a cut, while handles move and after they arrive, with and
/// without links beyond their limits.
#[test]
fn a_run_in_two_parts_equals_the_whole_run() {
    let cases = [(ASIDE, "0"), (ASIDE, "0.25"), (TURNS, "0.25"), (FAR, "0"), (FAR, "0.25"), (FAR, "0.5")];
    for (handle, at_s) in cases {
        let set = [ALL, INCISION, handle, ("incision.0.at_s", at_s), ("chainmail.relax_per_frame", "3")];
        let scene = chain(&set);
        let whole = Run::of(&scene);
        let chainmail = whole.report.chainmail.as_ref().unwrap();
        assert!(
            chainmail.cut_links > 0 && (chainmail.violated_links > 0) == (handle == FAR),
            "{chainmail:?}"
        );
        for middle in 1..=6 {
            let folder = tempfile::tempdir().unwrap();
            run_in(folder.path(), &first(middle, &scene), false).unwrap();
            let report = run_in(folder.path(), &scene, true).unwrap();
            let what = format!("{handle:?} {at_s}, from frame {middle} on");
            assert_eq!(report.frames.count, 6 - middle);
            for file in ["checkpoint.bin", "skin.vtu", "deformed.nii.gz"] {
                assert!(
                    std::fs::read(folder.path().join(file)).unwrap() == whole.bytes(file),
                    "{what}: {file}"
                );
            }
            assert_eq!(frames(folder.path()), frames(whole.folder()), "{what}");
            assert_eq!(report.warnings, whole.report.warnings, "{what}");
            let found = report.chainmail.unwrap();
            assert_eq!(
                (found.moved, found.violated_links, found.cut_links),
                (chainmail.moved, chainmail.violated_links, chainmail.cut_links),
                "{what}"
            );
            let energies = |chainmail: &ChainmailReport| [chainmail.energy_before, chainmail.energy_after];
            assert_eq!(energies(&found), energies(chainmail), "{what}");
        }
    }
}

#[test]
fn a_checkpoint_of_another_chain_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    run_in(folder.path(), &first(3, &chain(&[HANDLE])), false).unwrap();
    for set in [&[HANDLE, UNIFORM], &[HANDLE, UNRELAXED], &[HANDLE, ("model", "pbd")]] {
        let error = run_in(folder.path(), &chain(set), true).unwrap_err();
        assert!(error.is_bad_input() && error.to_string().contains("differ"), "{error}");
    }
    run_in(folder.path(), &chain(&[HANDLE]), true).unwrap();
}

#[test]
fn another_volume_can_be_resampled_with_the_checkpoint() {
    let scene = chain(&[("output", "{ volume = true }"), INCISION, ASIDE]);
    let run = Run::of(&scene);
    let out = run.path("again.nii.gz");
    let request = ResampleRequest { run: run.folder().into(), input: ResampleInput::Volume(None), out };
    let found = cutis::resample_run(&scene, &request, &Silent).unwrap();
    assert!(run.bytes("again.nii.gz") == run.bytes("deformed.nii.gz"));
    let chainmail = run.report.resample.as_ref().unwrap();
    assert_eq!(
        (found.moved_voxels, found.vacated_voxels),
        (chainmail.moved_voxels, chainmail.vacated_voxels)
    );
}
