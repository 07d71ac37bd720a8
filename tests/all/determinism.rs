//! Results are bit-identical for any number of threads and for both CPU backends.

use crate::scenes::{Run, SMALL, real, scene};

const OUTPUT: (&str, &str) = ("output", "{ volume = true, surface = true }");

#[test]
fn the_small_phantom_is_the_same_for_any_number_of_threads() {
    for formulation in ["xpbd", "pbd"] {
        let run = |set: &[(&str, &str)]| {
            let common = [
                OUTPUT,
                ("run.frames", "6"),
                ("run.checkpoint_every", "6"),
                ("solver.formulation", formulation),
            ];
            Run::of(&scene(SMALL, &[&common, set].concat()))
        };
        let one = run(&[("solver.threads", "1")]);
        for threads in ["2", "3", "8"] {
            let other = run(&[("solver.threads", threads)]);
            assert_eq!(other.report.backend.threads.to_string(), threads);
            for file in ["checkpoint.bin", "skin.vtu", "deformed.nii.gz"] {
                assert!(
                    one.bytes(file) == other.bytes(file),
                    "{formulation}: {file} differs with {threads} threads"
                );
            }
        }
        let reference = run(&[("solver.backend", "reference")]);
        assert_eq!(reference.report.backend.name, "reference");
        assert!(one.state() == reference.state(), "{formulation}: the reference backend differs");
        // Negative control: one more substep changes the result.
        let control = run(&[("solver.substeps", "11")]);
        assert!(one.state() != control.state() && one.bytes("skin.vtu") != control.bytes("skin.vtu"));
    }
}

#[test]
fn a_real_abdomen_is_the_same_for_any_number_of_threads() {
    let Some(volume) = real("ct/abdomen_ts_64x53x58.nii.gz") else { return };
    let run = |threads| {
        let set = [
            ("volume.path", volume.as_str()),
            ("solver.threads", threads),
            ("solver.substeps", "2"),
            ("run.checkpoint_every", "30"),
            ("output", "{}"),
        ];
        let run = Run::of(&scene("abdomen-reference.toml", &set));
        assert!(run.report.frames.count == 30 && run.report.max_displacement_mm > 1.0);
        run.bytes("checkpoint.bin")
    };
    let one = run("1");
    for threads in ["2", "3", "8"] {
        assert!(one == run(threads), "differs with {threads} threads");
    }
}
