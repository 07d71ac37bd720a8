//! The program behind `cargo xtask cantilever`: beams bent by Newton's method and by the solver, for the FEM to compare.

use std::process::ExitCode;

use clap::Parser;
use cutis_tests::cantilever::{Document, Failure, Options};

fn run(options: &Options) -> Result<(), Failure> {
    let file = std::fs::File::create(&options.out)
        .map_err(|error| format!("cannot write {}: {error}", options.out.display()))?;
    Ok(serde_json::to_writer(std::io::BufWriter::new(file), &Document::new(options)?)?)
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("\nerror: {error}");
            ExitCode::FAILURE
        }
    }
}
