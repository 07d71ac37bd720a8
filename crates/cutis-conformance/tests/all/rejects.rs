//! The battery rejects wrong types, each in the check that is meant to notice the fault.

use cutis_conformance::{ConformanceError, Report, Subject, Verdict, checks, device};
use cutis_constraints::Constraint;

use crate::wrong::*;

/// The names of the checks that fail for a type, in the order of the battery. Checks on a device
/// start with `gpu`.
fn rejected_by<C: Constraint<N, Material = ()>, const N: usize>() -> Vec<String> {
    let subject = Subject::<C, N>::new([()]);
    let mut failed = Vec::new();
    let mut note = |place: &str, name: &str, report: Result<Report, ConformanceError>| {
        let (rejected, why) = match report {
            Ok(report) => (report.verdict() == Verdict::Failed, report.to_string()),
            Err(error) => (true, error.to_string()),
        };
        if rejected {
            eprintln!("{place}{why}\n");
            failed.push(format!("{place}{name}"));
        }
    };
    note("", "gradient", Ok(checks::gradient(&subject)));
    note("", "momentum", Ok(checks::momentum(&subject)));
    note("", "scale", Ok(checks::scale(&subject)));
    note("", "parameters", Ok(checks::parameters(&subject)));
    note("", "precision", Ok(checks::precision(&subject)));
    note("", "lanes", Ok(checks::lanes(&subject)));
    note("", "degenerate", Ok(checks::degenerate(&subject)));
    note("", "wgsl", Ok(checks::wgsl(&subject)));
    note("", "projection", checks::projection(&subject));
    if let Some(gpu) = device::open().expect("a device can be opened, or is not required") {
        note("gpu ", "evaluation", device::evaluation(&subject, &gpu));
        note("gpu ", "projection", device::projection(&subject, &gpu));
        note("gpu ", "degenerate", device::degenerate(&subject, &gpu));
    }
    failed
}

/// Fails unless the type is rejected by `check` and by no check in `not`. Without a device, checks
/// on a device are not required to reject it.
#[track_caller]
fn assert_rejected<C: Constraint<N, Material = ()>, const N: usize>(check: &str, not: &[&str]) {
    let failed = rejected_by::<C, N>();
    let no_device = check.starts_with("gpu") && matches!(device::open(), Ok(None));
    assert!(no_device || failed.iter().any(|name| name == check), "{}: {failed:?}", C::NAME);
    assert!(!failed.iter().any(|name| not.contains(&name.as_str())), "{}: {failed:?}", C::NAME);
}

/// The types from which the wrong ones are derived are correct.
#[test]
fn the_correct_types_pass() {
    assert_eq!(rejected_by::<Stretch, 2>(), [""; 0]);
    assert_eq!(rejected_by::<Content, 4>(), [""; 0]);
}

#[test]
fn a_wrong_sign_is_rejected() {
    assert_rejected::<WrongSign, 2>("gradient", &["scale", "lanes", "degenerate", "wgsl"]);
    // The shader has the correct sign, so the device differs too.
    assert_rejected::<WrongSign, 2>("gpu evaluation", &[]);
}

#[test]
fn a_gradient_without_the_sixth_is_rejected() {
    // The sum is still zero and both languages agree, so no other check can notice it.
    assert_rejected::<WithoutSixth, 4>("gradient", &["momentum", "wgsl", "gpu evaluation", "gpu projection"]);
}

#[test]
fn a_gradient_that_creates_momentum_is_rejected() {
    assert_rejected::<OneSided, 2>("momentum", &["lanes", "degenerate", "wgsl"]);
}

#[test]
fn an_absolute_epsilon_is_rejected() {
    assert_rejected::<AbsoluteEpsilon, 2>("scale", &["momentum", "wgsl", "gpu evaluation"]);
}

/// These guards are so small that no sample of ordinary size comes near them.
#[test]
fn a_tiny_absolute_epsilon_has_a_length() {
    let not = ["gradient", "momentum", "precision", "degenerate", "wgsl", "gpu evaluation", "gpu projection"];
    assert_rejected::<TinyGuard, 2>("scale", &not);
    assert_rejected::<TinyEpsilon, 2>("scale", &not);
}

#[test]
fn a_parameter_without_effect_is_rejected() {
    assert_rejected::<Idle, 2>("parameters", &["gradient", "wgsl", "gpu evaluation", "gpu projection"]);
}

#[test]
fn cancellation_is_rejected() {
    assert_rejected::<Canceling, 2>("precision", &["gradient", "momentum", "lanes", "wgsl"]);
}

#[test]
fn lanes_that_depend_on_each_other_are_rejected() {
    assert_rejected::<LanesMixed, 2>("lanes", &["gradient", "momentum", "wgsl", "gpu evaluation"]);
    // The CPU backend evaluates in lanes.
    assert_rejected::<LanesMixed, 2>("projection", &[]);
}

#[test]
fn a_division_without_guard_is_rejected() {
    assert_rejected::<Unguarded, 2>("degenerate", &["gradient", "momentum", "wgsl", "gpu evaluation"]);
    assert_rejected::<UnguardedShader, 2>("gpu degenerate", &["degenerate", "wgsl", "gpu evaluation"]);
}

#[test]
fn invalid_shaders_are_rejected() {
    for failed in [
        rejected_by::<NoShader, 2>(),
        rejected_by::<UnknownName, 2>(),
        rejected_by::<TakenName, 2>(),
        rejected_by::<TooManyParams, 2>(),
        rejected_by::<IntegerParams, 2>(),
        rejected_by::<Normalized, 2>(),
    ] {
        assert!(failed.iter().any(|name| name == "wgsl"), "{failed:?}");
        assert!(!failed.iter().any(|name| name == "gradient" || name == "projection"), "{failed:?}");
    }
}

#[test]
fn a_shader_with_swapped_fields_is_rejected() {
    let host = ["gradient", "momentum", "scale", "parameters", "precision", "lanes", "degenerate", "wgsl"];
    assert_rejected::<SwappedFields, 2>("gpu evaluation", &host);
    assert_rejected::<SwappedFields, 2>("gpu projection", &host);
}

#[test]
fn a_shader_without_a_term_is_rejected() {
    let host = ["gradient", "momentum", "scale", "parameters", "precision", "lanes", "degenerate", "wgsl"];
    assert_rejected::<LacksTerm, 4>("gpu evaluation", &host);
    assert_rejected::<LacksTerm, 4>("gpu projection", &host);
}
