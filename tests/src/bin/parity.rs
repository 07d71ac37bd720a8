//! The program behind `cargo xtask parity`: the GPU backend compared with the CPU.

use std::process::ExitCode;

use clap::Parser;
use cutis_tests::parity::{self, Options};

fn main() -> ExitCode {
    match parity::run(&Options::parse(), &mut std::io::stdout()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("\nerror: {error}");
            ExitCode::FAILURE
        }
    }
}
