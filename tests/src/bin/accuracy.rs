//! The program behind `cargo xtask accuracy`: error against run time.

use std::process::ExitCode;

use clap::Parser;
use cutis_tests::accuracy::{self, Options};

fn main() -> ExitCode {
    match accuracy::run(&Options::parse(), &mut std::io::stdout()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("\nerror: {error}");
            ExitCode::FAILURE
        }
    }
}
