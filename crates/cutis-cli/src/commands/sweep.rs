//! `sweep`: runs the cases of a study, each in a process of its own, and collects their results.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

use cutis::Error;
use cutis::sweep::{Case, CaseState, Folder, Hashes, Ran, Study, Table, record_death, run_case};
use serde::Serialize;

use super::pretty;
use crate::args::SweepArgs;
use crate::interrupt::{self, Interruptible};
use crate::terminal::{self, Terminal, print};

/// Exit code of a sweep with cases that are not done.
const UNFINISHED: u8 = 1;

/// Runs what the arguments ask for. Returns the exit code.
pub(super) fn sweep(file: &Path, args: &SweepArgs) -> Result<u8, Error> {
    let folder = Folder(args.out.clone().unwrap_or_else(|| default_folder(file)));
    if let Some(name) = &args.case {
        return one(file, name, &folder, args).map(|()| 0);
    }
    let study = Study::load(file)?;
    if args.list {
        list(&study, args.json);
        return Ok(0);
    }
    if args.dry_run {
        return dry_run(&study, &folder, args.json).map(|()| 0);
    }
    if !args.table {
        folder.create()?;
        run_all(&study, file, &folder, args)?;
    }
    finish(&study, &folder, args.json)
}

/// The study's name with `-sweep`, in the current folder.
fn default_folder(study: &Path) -> PathBuf {
    let mut name = study.file_stem().unwrap_or_default().to_owned();
    name.push("-sweep");
    name.into()
}

/// A case as `--list --json` and `--dry-run --json` print it.
#[derive(Serialize)]
struct Listed<'a> {
    case: &'a str,
    settings_sha256: &'a str,
    reads: &'a [PathBuf],
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds: Option<f64>,
}

impl<'a> Listed<'a> {
    fn new(case: &'a Case, state: Option<&CaseState>) -> Self {
        let seconds = match state {
            Some(CaseState::Done(entry) | CaseState::Failed(entry)) => Some(entry.seconds),
            _ => None,
        };
        let Case { name, settings_sha256, reads, .. } = case;
        Self { case: name, settings_sha256, reads, state: state.map(CaseState::name), seconds }
    }
}

fn list(study: &Study, json: bool) {
    let cases: Vec<Listed<'_>> = study.cases.iter().map(|case| Listed::new(case, None)).collect();
    let names = || cases.iter().map(|case| case.case).collect::<Vec<_>>().join("\n");
    print(&if json { pretty(&cases) } else { names() });
}

/// What a sweep would do, without doing it.
fn dry_run(study: &Study, folder: &Folder, json: bool) -> Result<(), Error> {
    let states = states(study, folder)?;
    let listed: Vec<Listed<'_>> =
        study.cases.iter().zip(&states).map(|(case, state)| Listed::new(case, Some(state))).collect();
    if json {
        print(&pretty(&listed));
        return Ok(());
    }
    let width = study.cases.iter().map(|case| case.name.len()).max().unwrap_or_default();
    for (case, state) in listed.iter().zip(&states) {
        let seconds = case.seconds.map(|seconds| format!("  {seconds:8.1} s")).unwrap_or_default();
        print(format!("{:width$}  {:8}{seconds}", case.case, state.name()).trim_end());
    }
    let done: Vec<f64> = listed
        .iter()
        .zip(&states)
        .filter(|(_, state)| state.is_done())
        .filter_map(|(case, _)| case.seconds)
        .collect();
    let to_run = states.len() - done.len();
    let mean = done.iter().sum::<f64>() / done.len().max(1) as f64;
    let time = match (done.len(), to_run) {
        (0, _) | (_, 0) => String::new(),
        _ => format!(", about {} by the mean of those", duration(mean * to_run as f64)),
    };
    print(&format!("{} cases: {} done, {to_run} to run{time}", states.len(), done.len()));
    Ok(())
}

fn states(study: &Study, folder: &Folder) -> Result<Vec<CaseState>, Error> {
    let mut hashes = Hashes::default();
    study.cases.iter().map(|case| folder.state(study, case, &mut hashes)).collect()
}

/// Runs one case in this process.
fn one(file: &Path, name: &str, folder: &Folder, args: &SweepArgs) -> Result<(), Error> {
    let case = &Study::load_case(file, name)?;
    Interruptible { out: folder.of_case(case).0, can_resume: false, resumed: false }.watch();
    let ran = run_case(file, case, folder, args.threads.map_or(0, usize::from), &Terminal::new())?;
    match ran {
        Ran::Now(report) if args.json => print(&pretty(&report)),
        Ran::Now(_) => print(&format!("{}: done", case.name)),
        Ran::Before => print(&format!("{}: done before", case.name)),
    }
    Ok(())
}

/// How the process of a case ended.
struct Ended<'a> {
    case: &'a Case,
    /// The message of a case that failed, if there is one. An error if the folder of the sweep
    /// cannot be used.
    failure: Result<Option<String>, Error>,
    seconds: f64,
}

/// Runs all cases that are not done, several at a time.
fn run_all(study: &Study, file: &Path, folder: &Folder, args: &SweepArgs) -> Result<(), Error> {
    let states = states(study, folder)?;
    let to_run: Vec<&Case> =
        study.cases.iter().zip(&states).filter(|(_, state)| !state.is_done()).map(|(case, _)| case).collect();
    let jobs = usize::from(args.jobs).min(to_run.len().max(1));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.threads.map_or((cores / jobs).max(1), usize::from);
    terminal::note(&format!(
        "{} cases: {} done before, {} to run, {jobs} at a time with {threads} threads each",
        study.cases.len(),
        study.cases.len() - to_run.len(),
        to_run.len()
    ));
    interrupt::watch_sweep();
    let program = std::env::current_exe().map_err(|e| Error::File {
        path: "cutis".into(),
        action: "find the program",
        why: e.to_string(),
    })?;
    let call = Call { program, file, folder, threads };
    let (next, start) = (AtomicUsize::new(0), Instant::now());
    let (ended, results) = channel();
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            let (ended, call, to_run, next) = (ended.clone(), &call, &to_run, &next);
            scope.spawn(move || work(call, to_run, next, &ended));
        }
        drop(ended);
        let mut broken = None;
        for (number, Ended { case, failure, seconds }) in results.iter().enumerate() {
            let done = number + 1;
            let left = to_run.len() - done;
            let rest = start.elapsed().as_secs_f64() / done as f64 * left as f64;
            let rest = if left > 0 { format!("; about {} left", duration(rest)) } else { String::new() };
            let how = match failure {
                Ok(None) => "done".to_owned(),
                Ok(Some(why)) => format!("failed: {why}"),
                Err(error) => {
                    // No later case could be kept either.
                    next.store(to_run.len(), Ordering::Relaxed);
                    broken = Some(error);
                    continue;
                }
            };
            terminal::say(&format!("[{done}/{}] {}: {how} ({seconds:.1} s{rest})", to_run.len(), case.name));
        }
        broken.map_or(Ok(()), Err)
    })
}

/// Runs cases until none is left.
fn work<'a>(call: &Call<'_>, to_run: &[&'a Case], next: &AtomicUsize, ended: &Sender<Ended<'a>>) {
    while let Some(case) = to_run.get(next.fetch_add(1, Ordering::Relaxed)) {
        let start = Instant::now();
        let failure = call.run(case);
        let done = Ended { case, failure, seconds: start.elapsed().as_secs_f64() };
        if ended.send(done).is_err() {
            return;
        }
    }
}

/// How to call this program for a case.
struct Call<'a> {
    program: PathBuf,
    file: &'a Path,
    folder: &'a Folder,
    threads: usize,
}

impl Call<'_> {
    /// Runs one case in a process of its own, so that a case that the system kills ends no other
    /// one. Returns the message of a case that failed, or how its process ended.
    fn run(&self, case: &Case) -> Result<Option<String>, Error> {
        let start = Instant::now();
        let lines = self.folder.lines(case)?;
        let log = self.folder.log(case);
        let at_log =
            |e: std::io::Error| Error::File { path: log.clone(), action: "write", why: e.to_string() };
        std::fs::create_dir_all(self.folder.of_case(case).0).map_err(at_log)?;
        let mut command = Command::new(&self.program);
        command.arg("sweep").arg(self.file).arg("--out").arg(&self.folder.0);
        command.arg(format!("--case={}", case.name)).arg(format!("--threads={}", self.threads));
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(File::create(&log).map_err(at_log)?);
        let status = command.status().map_err(|e| Error::File {
            path: self.program.clone(),
            action: "start",
            why: e.to_string(),
        })?;
        if status.success() {
            return Ok(None);
        }
        let text = std::fs::read(&log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let text = text.unwrap_or_default();
        let message = text.lines().rev().find_map(|line| line.strip_prefix("error: "));
        let why = message.map_or_else(|| format!("its process ended with {status}"), str::to_owned);
        let seconds = start.elapsed().as_secs_f64();
        record_death(case, self.folder, lines, status.code(), &why, seconds)?;
        Ok(Some(why))
    }
}

/// Writes table and plots, and prints where they are.
fn finish(study: &Study, folder: &Folder, json: bool) -> Result<u8, Error> {
    let table = Table::of(study, folder)?;
    folder.create()?;
    table.write(study, folder)?;
    let done = table.states.iter().filter(|state| state.is_done()).count();
    if json {
        let rows = table.rows.iter().map(|row| {
            table
                .columns
                .iter()
                .cloned()
                .zip(row.iter().cloned())
                .collect::<std::collections::BTreeMap<_, _>>()
        });
        print(&pretty(&rows.collect::<Vec<_>>()));
    } else {
        print(&format!("{done} of {} cases are done", table.rows.len()));
        print(&format!("table:   {}", folder.table().display()));
        print(&format!("look at: {}", folder.plots().display()));
    }
    Ok(if table.is_complete() { 0 } else { UNFINISHED })
}

/// A time for people.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 99.5 => format!("{s:.0} s"),
        s if s < 5970.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
