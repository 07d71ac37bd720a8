//! The battery rejects wrong types, each in the check that is meant to notice the fault.

use cutis_conformance::{ConformanceError, Report, Subject, Verdict, checks, device};
use cutis_constraints::Constraint;
use cutis_gpu::Gpu;

use crate::wrong::*;

/// The names of checks that fail.
#[derive(Default)]
struct Failed(Vec<String>);

impl Failed {
    fn note(&mut self, place: &str, name: &str, report: Result<Report, ConformanceError>) {
        let (rejected, why) = match report {
            Ok(report) => (report.verdict() == Verdict::Failed, report.to_string()),
            Err(error) => (true, error.to_string()),
        };
        if rejected {
            eprintln!("{place}{why}\n");
            self.0.push(format!("{place}{name}"));
        }
    }

    fn has(&self, name: &str) -> bool {
        self.0.iter().any(|failed| failed == name)
    }
}

fn opened() -> Option<Gpu> {
    device::open().expect("a device can be opened, or is not required")
}

/// The checks that fail for a type and evaluate single constraints. Checks on a device start with
/// `gpu`.
fn by_evaluation<C: Constraint<N, Material = ()>, const N: usize>() -> Failed {
    let subject = Subject::<C, N>::new([()]);
    let mut failed = Failed::default();
    failed.note("", "gradient", Ok(checks::gradient(&subject)));
    failed.note("", "momentum", Ok(checks::momentum(&subject)));
    failed.note("", "scale", Ok(checks::scale(&subject)));
    failed.note("", "parameters", Ok(checks::parameters(&subject)));
    failed.note("", "precision", Ok(checks::precision(&subject)));
    failed.note("", "lanes", Ok(checks::lanes(&subject)));
    failed.note("", "degenerate", Ok(checks::degenerate(&subject)));
    failed.note("", "wgsl", Ok(checks::wgsl(&subject)));
    if let Some(gpu) = opened() {
        failed.note("gpu ", "evaluation", device::evaluation(&subject, &gpu));
        failed.note("gpu ", "degenerate", device::degenerate(&subject, &gpu));
    }
    failed
}

/// All checks that fail for a type. Each type costs seconds of compilation, because the solvers are
/// compiled for it.
fn by_all<C: Constraint<N, Material = ()>, const N: usize>() -> Failed {
    let subject = Subject::<C, N>::new([()]);
    let mut failed = by_evaluation::<C, N>();
    failed.note("", "projection", checks::projection(&subject));
    if let Some(gpu) = opened() {
        failed.note("gpu ", "projection", device::projection(&subject, &gpu));
    }
    failed
}

/// Fails unless the type is rejected by `check` and by no check in `not`. Without a device, checks
/// on a device are not required to reject it.
#[track_caller]
fn assert_rejected(failed: &Failed, check: &str, not: &[&str]) {
    let no_device = check.starts_with("gpu") && opened().is_none();
    assert!(no_device || failed.has(check), "{:?}", failed.0);
    assert!(!not.iter().any(|name| failed.has(name)), "{:?}", failed.0);
}

/// The types from which the wrong ones are derived are correct.
#[test]
fn the_correct_types_pass() {
    assert_eq!(by_all::<Stretch, 2>().0, [""; 0]);
    assert_eq!(by_all::<Content, 4>().0, [""; 0]);
}

#[test]
fn a_wrong_sign_is_rejected() {
    let failed = by_evaluation::<WrongSign, 2>();
    assert_rejected(&failed, "gradient", &["scale", "lanes", "degenerate", "wgsl"]);
    // The shader has the correct sign, so the device differs too.
    assert_rejected(&failed, "gpu evaluation", &[]);
}

#[test]
fn a_gradient_without_the_sixth_is_rejected() {
    // The sum is still zero and both languages agree, so no other check can notice it.
    let not = ["momentum", "wgsl", "gpu evaluation", "gpu projection"];
    assert_rejected(&by_all::<WithoutSixth, 4>(), "gradient", &not);
}

#[test]
fn a_gradient_that_creates_momentum_is_rejected() {
    assert_rejected(&by_evaluation::<OneSided, 2>(), "momentum", &["lanes", "degenerate", "wgsl"]);
}

#[test]
fn an_absolute_epsilon_is_rejected() {
    let not = ["momentum", "wgsl", "gpu evaluation"];
    assert_rejected(&by_evaluation::<AbsoluteEpsilon, 2>(), "scale", &not);
}

/// These guards are so small that no sample of ordinary size comes near them.
#[test]
fn a_tiny_absolute_epsilon_has_a_length() {
    let not = ["gradient", "momentum", "precision", "degenerate", "wgsl", "gpu evaluation"];
    assert_rejected(&by_evaluation::<TinyGuard, 2>(), "scale", &not);
    assert_rejected(&by_evaluation::<TinyEpsilon, 2>(), "scale", &not);
}

#[test]
fn a_parameter_without_effect_is_rejected() {
    let not = ["gradient", "wgsl", "gpu evaluation", "gpu projection"];
    assert_rejected(&by_all::<Idle, 2>(), "parameters", &not);
}

#[test]
fn cancellation_is_rejected() {
    let not = ["gradient", "momentum", "lanes", "wgsl"];
    assert_rejected(&by_evaluation::<Canceling, 2>(), "precision", &not);
}

#[test]
fn lanes_that_depend_on_each_other_are_rejected() {
    let failed = by_all::<LanesMixed, 2>();
    assert_rejected(&failed, "lanes", &["gradient", "momentum", "wgsl", "gpu evaluation"]);
    // The CPU backend evaluates in lanes.
    assert_rejected(&failed, "projection", &[]);
}

#[test]
fn a_division_without_guard_is_rejected() {
    let not = ["gradient", "momentum", "wgsl", "gpu evaluation"];
    assert_rejected(&by_evaluation::<Unguarded, 2>(), "degenerate", &not);
    let not = ["degenerate", "wgsl", "gpu evaluation"];
    assert_rejected(&by_evaluation::<UnguardedShader, 2>(), "gpu degenerate", &not);
}

#[test]
fn invalid_shaders_are_rejected() {
    assert_rejected(&by_all::<NoShader, 2>(), "wgsl", &["gradient", "projection"]);
    for failed in [
        by_evaluation::<UnknownName, 2>(),
        by_evaluation::<TakenName, 2>(),
        by_evaluation::<TooManyParams, 2>(),
        by_evaluation::<IntegerParams, 2>(),
        by_evaluation::<Normalized, 2>(),
    ] {
        assert_rejected(&failed, "wgsl", &["gradient"]);
    }
}

const HOST: [&str; 8] =
    ["gradient", "momentum", "scale", "parameters", "precision", "lanes", "degenerate", "wgsl"];

#[test]
fn a_shader_with_swapped_fields_is_rejected() {
    let failed = by_all::<SwappedFields, 2>();
    assert_rejected(&failed, "gpu evaluation", &HOST);
    assert_rejected(&failed, "gpu projection", &HOST);
}

#[test]
fn a_shader_without_a_term_is_rejected() {
    let failed = by_all::<LacksTerm, 4>();
    assert_rejected(&failed, "gpu evaluation", &HOST);
    assert_rejected(&failed, "gpu projection", &HOST);
}
