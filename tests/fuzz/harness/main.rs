//! `cargo xtask fuzz`: tries changed inputs with every reader, for some seconds.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use cutis_fuzz::{Limits, TARGETS, Target, find, run, run_input, write_corpus};

const USAGE: &str = "\
usage: cargo xtask fuzz [OPTIONS]

  --seconds N    time for all readers together (20)
  --seed N       seed of the generator (1)
  --target NAME  only this reader; needed for --input
  --input FILE   tries the bytes of a file once
  --corpus DIR   only writes the valid inputs of every reader, as corpora of cargo-fuzz";

struct Options {
    seconds: u32,
    seed: u64,
    target: Option<&'static Target>,
    input: Option<PathBuf>,
    corpus: Option<PathBuf>,
}

fn main() -> ExitCode {
    match options().and_then(|options| options.map_or(Ok(ExitCode::SUCCESS), |options| fuzz(&options))) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The options of the command line. None for help.
fn options() -> Result<Option<Options>> {
    let mut options = Options { seconds: 20, seed: 1, target: None, input: None, corpus: None };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        if word == "--help" {
            say(USAGE);
            return Ok(None);
        }
        let value = words.next().with_context(|| format!("{word} needs a value\n\n{USAGE}"))?;
        match word.as_str() {
            "--seconds" => options.seconds = value.parse().context("--seconds")?,
            "--seed" => options.seed = value.parse().context("--seed")?,
            "--corpus" => options.corpus = Some(value.into()),
            "--input" => options.input = Some(value.into()),
            "--target" => {
                let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
                let expected = || format!("--target {value}: expected one of {}", names.join(", "));
                options.target = Some(find(&value).with_context(expected)?);
            }
            _ => bail!("unknown option {word}\n\n{USAGE}"),
        }
    }
    if options.input.is_some() && options.target.is_none() {
        bail!("--input needs --target");
    }
    Ok(Some(options))
}

fn fuzz(options: &Options) -> Result<ExitCode> {
    if let Some(folder) = &options.corpus {
        write_corpus(folder)?;
        say(&format!("{}: the valid inputs of {} readers", folder.display(), TARGETS.len()));
        return Ok(ExitCode::SUCCESS);
    }
    if let (Some(path), Some(target)) = (&options.input, options.target) {
        let input = std::fs::read(path).with_context(|| path.display().to_string())?;
        let fault = run_input(target, &input)?;
        say(&fault.as_ref().map_or("no fault".to_owned(), |what| format!("fault: {what}")));
        return Ok(if fault.is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    }
    let targets: Vec<&Target> = TARGETS
        .iter()
        .filter(|target| options.target.is_none_or(|chosen| chosen.name == target.name))
        .collect();
    let time = Duration::from_secs(options.seconds.into()) / targets.len() as u32;
    let mut code = ExitCode::SUCCESS;
    say("reader        inputs  accepted  outcomes  slowest, ms  memory, % of the limit");
    for target in targets {
        let campaign = run(target, &Limits { inputs: usize::MAX, time, seed: options.seed })?;
        say(&format!(
            "{:12} {:7}  {:8}  {:8}  {:11.1}  {:22.1}",
            target.name,
            campaign.inputs,
            campaign.accepted,
            campaign.outcomes,
            campaign.slowest.as_secs_f64() * 1e3,
            100.0 * campaign.memory_share
        ));
        for place in &campaign.caught {
            say(&format!("  a panic of a library became an error: {place}"));
        }
        for (number, fault) in campaign.faults.iter().enumerate() {
            let path = std::env::temp_dir().join(format!("cutis-fault-{}-{number}", target.name));
            std::fs::write(&path, &fault.input)?;
            say(&format!(
                "  fault: {}\n  again: cargo xtask fuzz --target {} --input {}",
                fault.what,
                target.name,
                path.display()
            ));
            code = ExitCode::FAILURE;
        }
    }
    Ok(code)
}

#[expect(clippy::print_stdout, reason = "the output of a program")]
fn say(text: &str) {
    println!("{text}");
}
