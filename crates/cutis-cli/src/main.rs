//! The `cutis` program. Exit codes: 0 done, 1 failed while running, 2 bad input or usage.

mod args;
mod commands;
mod headless;
mod interrupt;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    headless::quiet_drivers();
    let args = args::Args::parse();
    match commands::run(args.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::error(&error);
            ExitCode::from(if error.is_bad_input() { 2 } else { 1 })
        }
    }
}
