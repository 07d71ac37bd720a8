//! The program behind `cargo xtask chainmail`: ChainMail on scans, and beside position-based dynamics.

use std::process::ExitCode;

use clap::Parser;
use cutis_tests::chainmail::{self, Options};

fn main() -> ExitCode {
    match chainmail::run(&Options::parse(), &mut std::io::stdout()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("\nerror: {error}");
            ExitCode::FAILURE
        }
    }
}
