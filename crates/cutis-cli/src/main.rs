//! The `cutis` program. Exit codes: 0 done, 1 failed while running, 2 bad input or usage, 130
//! interrupted by Ctrl-C.

mod args;
mod commands;
mod headless;
mod interrupt;
mod module;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    headless::quiet_drivers();
    let words: Vec<std::ffi::OsString> = std::env::args_os().skip(1).collect();
    let done = match module::call(&words) {
        Some(module::Call::Describe) => {
            module::describe();
            Ok(0)
        }
        Some(module::Call::Run) => module::run().map(|()| 0),
        None => commands::run(args::Args::parse().command),
    };
    match done {
        Ok(code) => ExitCode::from(code),
        // The command has said how to resume.
        Err(cutis::Error::Interrupted { .. }) => ExitCode::from(interrupt::INTERRUPTED),
        Err(error) => {
            terminal::error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}
