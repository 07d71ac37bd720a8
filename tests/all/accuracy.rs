//! Error against run time. In the quick measurement single substeps converge, bodies settle in
//! their equilibria, and the negative controls fail.

use cutis_studies::accuracy::{self, Options};

#[test]
fn the_quick_checks_hold() {
    for problem in ["sheet", "hanging"] {
        let options =
            Options { quick: true, problem: Some(problem.into()), no_gpu: true, ..Options::default() };
        let mut table = Vec::new();
        let holds = accuracy::run(&options, &mut table).unwrap();
        assert!(holds, "{}", String::from_utf8_lossy(&table));
    }
}
