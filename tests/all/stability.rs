//! The quick part of the stability study: stiff and extreme cases meet their requirements at three
//! length scales.

use cutis_studies::stability::{self, Effort, Failure, Outcome, SCALES, Trial, case::Case, cases};
use cutis_test_kit::gpu;

/// Runs cases and fails with a list of all trials that do not meet their requirements.
fn check(run: impl FnOnce(&mut dyn FnMut(Trial) -> Result<(), Failure>) -> Result<(), Failure>) {
    let (mut count, mut failed) = (0, Vec::new());
    let mut keep = |trial: Trial| {
        count += 1;
        if !trial.outcome.is_good() {
            failed.push(format!("{} at scale {:?}: {}", trial.case, trial.scale, trial.outcome.note()));
        }
        Ok(())
    };
    run(&mut keep).unwrap();
    assert!(count > 0, "no case was run");
    assert!(failed.is_empty(), "{} of {count} failed:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn extreme_cases_end_as_expected() {
    let cases = cases::all(Effort::Quick);
    check(|keep| stability::run_cpu(&cases, &SCALES, keep));
}

#[test]
fn extreme_cases_end_as_expected_in_double_precision() {
    let cases = cases::all(Effort::Quick);
    check(|keep| stability::run_reference(&cases, &[1e-3], keep));
}

/// Every body comes to rest from its first placement, or a typed error says why not.
#[test]
fn extreme_bodies_come_to_rest_or_say_why_not() {
    let cases = cases::all(Effort::Normal);
    let (mut at_rest, mut named) = (0, 0);
    check(|keep| {
        stability::run_rest(&cases, &SCALES, &mut |trial| {
            match trial.outcome {
                Outcome::Settled => at_rest += 1,
                _ => named += 1,
            }
            keep(trial)
        })
    });
    // Most of the bodies have a state of rest. 18 cannot: nothing moves, or no force acts on a
    // body that is a point.
    assert!(at_rest > 15 * named, "{at_rest} at rest, {named} not");
}

/// One case of each sort, because a software adapter is slow. The scale is the one at which an
/// absolute length would cause a failure.
#[test]
fn extreme_cases_end_as_they_must_on_a_gpu() {
    const ON_GPU: [&str; 19] = [
        "amplification 1e6, held a hundredfold, XPBD",
        "collapsed to a point, PBD",
        "collapsed to a point, XPBD, compliance 0e0",
        "collapsed to a plane, XPBD",
        "collapsed to a slanted line, PBD",
        "one tetrahedron inverted, XPBD",
        "a skin triangle of zero area, XPBD",
        "everything fixed, XPBD, compliance 0e0",
        "layers 1 : 1000, XPBD",
        "layers 1 : 1000, VBD",
        "steps 1.9 times as long, VBD",
        "collapsed to a plane, VBD",
        "a corner torn off by ten body sizes at once, VBD, compliance 7e-7",
        "strips at rest, compressed to a tenth, XPBD",
        "strips at rest, stiffening 1e6, XPBD, compliance 0e0",
        "strips at rest, not deformed, tension 0.999, stiffening 1e6, PBD",
        "strips at rest, one triangle compressed to a tenth, tension 0.1, PBD",
        "strips at rest, turned over, VBD",
        "strips shrinking, stiffening 1e6, held a hundredfold, VBD",
    ];
    let of_gpu = |case: &Case| ON_GPU.contains(&case.name.as_str());
    let cases: Vec<Case> = cases::all(Effort::Quick).into_iter().filter(of_gpu).collect();
    assert_eq!(cases.len(), ON_GPU.len());
    gpu::on_each_adapter(|gpu| check(|keep| stability::run_gpu(gpu, "gpu", &cases, &[1e-3], keep)));
}

#[test]
fn wrong_inputs_are_refused_by_name() {
    let trials = stability::input_validation::all();
    check(|keep| trials.into_iter().try_for_each(keep));
}
