//! Error against run time. In the quick measurement single substeps converge, bodies settle in
//! their equilibria, and the negative controls fail.

use cutis_studies::accuracy::{self, Options};

#[test]
fn the_quick_checks_hold() {
    for problem in ["sheet", "hanging"] {
        holds(Options { problem: Some(problem.into()), ..Options::default() });
    }
}

#[test]
fn the_quick_checks_hold_for_a_membrane_at_rest() {
    holds(Options { membrane: true, ..Options::default() });
}

fn holds(options: Options) {
    let mut table = Vec::new();
    let holds = accuracy::run(&Options { quick: true, no_gpu: true, ..options }, &mut table).unwrap();
    assert!(holds, "{}", String::from_utf8_lossy(&table));
}
