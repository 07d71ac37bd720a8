//! The program behind `cargo xtask stability`: stiff and extreme cases on every backend.

use std::process::ExitCode;

use clap::Parser;
use cutis_tests::stability::{self, Options};

fn main() -> ExitCode {
    match stability::run(&Options::parse(), &mut std::io::stdout()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("\nerror: {error}");
            ExitCode::FAILURE
        }
    }
}
