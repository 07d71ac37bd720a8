//! Cuts the skin of a synthetic torso and prints how far its tension opens the wound.
//!
//! `cargo run --example cut_phantom -p cutis` takes a few seconds and needs no data.
#![expect(clippy::print_stdout, reason = "an example that prints its results")]

use cutis::{Error, Override, RunOptions, Silent};

fn main() -> Result<(), Error> {
    // The built-in demo on a smaller phantom and a coarser lattice, without files except the
    // report.
    let changes = [
        ("volume.phantom", "{ size = [64, 64, 48], seed = 1 }"),
        ("lattice.spacing_mm", "9.0"),
        ("run.frames", "20"),
        ("solver.backend", "\"cpu\""),
        ("output", "{ report = true }"),
    ];
    let changes = changes.map(|(key, value)| Override { key: key.into(), value: value.into() });
    let scene = cutis::demo(&changes)?;

    let plan = cutis::check(&scene, &Silent)?;
    println!("{} vertices, {} tetrahedra", plan.sizes.vertices, plan.sizes.tets);
    for line in &plan.left_out {
        println!("left out: {line}");
    }

    let out = std::env::temp_dir().join("cutis-cut-phantom");
    let report = cutis::run(&scene, &RunOptions { out: out.clone(), resume: false }, &Silent)?;
    for wound in &report.wounds {
        println!("wound: {:.2} mm -> {:.2} mm", wound.initial_mm, wound.final_mm);
    }
    println!("report: {}", out.join("report.html").display());
    Ok(())
}
