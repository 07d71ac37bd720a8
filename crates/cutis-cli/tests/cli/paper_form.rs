//! `cutis check` lists the paper's form of skin tension under its key.

use crate::Desk;

#[test]
fn the_cost_lines_have_the_colors_of_the_paper_form() {
    let form = [
        "solver.formulation=pbd",
        "constraints.stc.form=paper",
        "constraints.stc.stiffness=0.5",
        "solver.backend=cpu",
    ];
    let set = form.iter().flat_map(|change| ["--set", change]);
    let args: Vec<&str> = ["check", "scene.toml"].into_iter().chain(set).collect();
    let printed = Desk::new().cutis(&args).expect_success().stdout;
    let line = printed.lines().find(|line| line.trim_start().starts_with("stc ")).unwrap_or_default();
    // Part, colors, bytes on the host, milliseconds per frame.
    assert_eq!(line.split_whitespace().count(), 4, "{printed}");
}
