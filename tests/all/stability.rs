//! The quick part of the stability suite: stiff and extreme cases end as they must, at three length scales.

use cutis::gpu::{Gpu, GpuError, GpuOptions};
use cutis_tests::stability::{self, Effort, Failure, Row, SCALES, case::Case, cases};

/// Runs `cases` and fails with every row that did not end as it must.
fn check(run: impl FnOnce(&mut dyn FnMut(Row) -> Result<(), Failure>) -> Result<(), Failure>) {
    let (mut count, mut failed) = (0, Vec::new());
    let mut keep = |row: Row| {
        count += 1;
        if !row.outcome.is_good() {
            failed.push(format!("{} at scale {:?}: {}", row.case, row.scale, row.outcome.note()));
        }
        Ok(())
    };
    run(&mut keep).unwrap();
    assert!(count > 0, "no case was run");
    assert!(failed.is_empty(), "{} of {count} failed:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn extreme_cases_end_as_they_must() {
    let cases = cases::all(Effort::Quick);
    check(|keep| stability::run_cpu(&cases, &SCALES, keep));
}

#[test]
fn extreme_cases_end_as_they_must_in_double_precision() {
    let cases = cases::all(Effort::Quick);
    check(|keep| stability::run_reference(&cases, &[1e-3], keep));
}

/// A software device takes its time: one case of each sort, at the scale where an absolute length would show.
#[test]
fn extreme_cases_end_as_they_must_on_a_gpu() {
    let gpu = match Gpu::open(&GpuOptions::default()) {
        Ok(gpu) => gpu,
        Err(error @ GpuError::NoAdapter) => {
            let required = ["CI", "CUTIS_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
            assert!(!required, "{error}");
            eprintln!("skipped: {error}");
            return;
        }
        Err(error) => panic!("{error}"),
    };
    const ON_GPU: [&str; 11] = [
        "amplification 1e6, held a hundredfold, XPBD",
        "collapsed to a point, PBD",
        "collapsed to a point, XPBD, compliance 0e0",
        "collapsed to a plane, XPBD",
        "collapsed to a slanted line, PBD",
        "one tetrahedron inverted, XPBD",
        "a skin triangle of zero area, XPBD",
        "everything fixed, XPBD, compliance 0e0",
        "steps 1.9 times as long, VBD",
        "collapsed to a plane, VBD",
        "a corner torn off by ten body sizes at once, VBD, compliance 7e-7",
    ];
    let of_gpu = |case: &Case| ON_GPU.contains(&case.name.as_str());
    let cases: Vec<Case> = cases::all(Effort::Quick).into_iter().filter(of_gpu).collect();
    assert_eq!(cases.len(), ON_GPU.len());
    check(|keep| stability::run_gpu(&gpu, "gpu", &cases, &[1e-3], keep));
}

#[test]
fn what_cannot_be_used_is_refused_by_name() {
    let doors = stability::doors::all();
    check(|keep| doors.into_iter().try_for_each(keep));
}
