//! The Rust program in the README compiles.

use std::error::Error;

/// The program of the README, line by line. It is compiled but never run, because it needs a scene.
#[expect(dead_code, clippy::print_stdout, reason = "the README shows a program that prints")]
fn program() -> Result<(), Box<dyn Error>> {
    use cutis::solver::Solver;
    use cutis::solver_cpu::SolverCpu;

    let scene = cutis::Scene::load("scene.toml".as_ref(), &[])?; // names the CT and the incision
    let body = cutis::build_system(&scene)?; // lattice, skin, cut, constraints
    let mut solver = SolverCpu::new(body.system, body.settings, None)?;
    solver.step(40)?; // 40 frames
    let gape = body.gapes[0].measure(&solver.positions()?);
    println!("the wound is open by {:.1} mm", gape.mean_mm);
    Ok(())
}

/// Lines of code without indentation, comments and blank lines.
fn code(text: &str) -> Vec<&str> {
    let lines = text.lines().map(|line| line.split(" //").next().unwrap_or(line).trim());
    lines.filter(|line| !line.is_empty()).collect()
}

#[test]
fn the_program_of_the_readme_compiles() {
    let readme = include_str!("../../README.md");
    let block = readme.split("```rust\n").nth(1).unwrap().split("```").next().unwrap();
    let source = include_str!("readme.rs");
    let program = code(source.split("fn program()").nth(1).unwrap().split("Ok(())").next().unwrap());
    assert_eq!(code(block), program[1..]);
}
