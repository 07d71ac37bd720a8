//! The program behind `cargo xtask study`.

use std::io::{Write, stdout};
use std::process::ExitCode;

use clap::Parser;
use cutis_studies::kit::Failure;
use cutis_studies::{
    accuracy, at_rest, cantilever, chainmail, closing, inputs, instructions, main_job, mutations, parity,
    patch, peers, pictures, region, rest, speed, stability, tuning, wound,
};

/// A study and its options.
#[derive(Debug, Parser)]
#[command(name = "study", bin_name = "cargo xtask study")]
enum Study {
    Accuracy(accuracy::Options),
    AtRest(at_rest::Options),
    Cantilever(cantilever::Options),
    Chainmail(chainmail::Options),
    Closing(closing::Options),
    Inputs(inputs::Options),
    Instructions(instructions::Options),
    MainJob(main_job::Options),
    Mutations(mutations::Options),
    Parity(parity::Options),
    Patch(patch::Options),
    Peers(peers::Options),
    Pictures(pictures::Options),
    Region(region::Options),
    Rest(rest::Options),
    Speed(speed::Options),
    Stability(stability::Options),
    Tuning(tuning::Options),
    Wound(wound::Options),
}

impl Study {
    fn run(&self, out: &mut dyn Write) -> Result<bool, Failure> {
        match self {
            Self::Accuracy(options) => accuracy::run(options, out),
            Self::AtRest(options) => at_rest::run(options, out),
            Self::Cantilever(options) => cantilever::run(options, out),
            Self::Chainmail(options) => chainmail::run(options, out),
            Self::Closing(options) => closing::run(options, out),
            Self::Inputs(options) => inputs::run(options, out),
            Self::Instructions(options) => instructions::run(options, out),
            Self::MainJob(options) => main_job::run(options, out),
            Self::Mutations(options) => mutations::run(options, out),
            Self::Parity(options) => parity::run(options, out),
            Self::Patch(options) => patch::run(options, out),
            Self::Peers(options) => peers::run(options, out),
            Self::Pictures(options) => pictures::run(options, out),
            Self::Region(options) => region::run(options, out),
            Self::Rest(options) => rest::run(options, out),
            Self::Speed(options) => speed::run(options, out),
            Self::Stability(options) => stability::run(options, out),
            Self::Tuning(options) => tuning::run(options, out),
            Self::Wound(options) => wound::run(options, out),
        }
    }
}

fn main() -> ExitCode {
    match Study::parse().run(&mut stdout()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}
