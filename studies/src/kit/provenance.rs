//! Provenance of a result: command, commit, machine, load and adapter.

use std::time::Instant;

use cutis::report::Machine;
use serde::Serialize;

use super::command;

/// Where the figures of one run come from.
#[derive(Clone, Debug, Serialize)]
pub struct Provenance {
    command: String,
    commit: Option<String>,
    machine: Machine,
    /// Load of the machine at the start.
    load: Option<String>,
    /// Names of the GPU adapters in use.
    adapter: Option<String>,
    #[serde(skip)]
    start: Instant,
}

impl Provenance {
    /// Starts a run of `cargo xtask study COMMAND`.
    pub fn start(command: &str) -> Self {
        Self {
            command: format!("cargo xtask study {command}"),
            commit: commit(),
            machine: Machine::here(),
            load: load(),
            adapter: None,
            start: Instant::now(),
        }
    }

    /// Adds the name of a GPU adapter in use.
    pub fn adapter(&mut self, name: &str) {
        self.adapter = Some(self.adapter.take().map_or_else(|| name.into(), |names| names + ", " + name));
    }

    /// A sentence for a page.
    pub fn markdown(&self) -> String {
        let unknown = || "unknown".to_owned();
        let Machine { cpu, cores, system } = &self.machine;
        let adapter = self.adapter.as_ref().map_or_else(String::new, |name| format!(" Adapter: {name}."));
        format!(
            "Measured by `{}` at commit {}, on {cpu}, {cores} threads, {system}, in {:.0} s. Load of the \
             machine: {} at the start, {} at the end.{adapter}",
            self.command,
            self.commit.clone().unwrap_or_else(unknown),
            self.start.elapsed().as_secs_f64(),
            self.load.clone().unwrap_or_else(unknown),
            load().unwrap_or_else(unknown),
        )
    }
}

/// Average number of running processes in the last minute. `None` if the system does not report it.
pub fn load() -> Option<String> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().next().map(str::to_owned)
}

/// The commit of the checkout, with `-dirty` if there are uncommitted changes. Pages of results do
/// not count, because one study may follow another.
pub fn commit() -> Option<String> {
    let git = |options: &[&str]| {
        let output = command("git").args(options).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let commit = git(&["describe", "--always", "--abbrev=12", "--exclude=*"])?;
    let changed =
        git(&["status", "--porcelain", "--untracked-files=no", "--", ":/", ":(top,exclude)docs/results"])?;
    Some(if changed.is_empty() { commit } else { commit + "-dirty" })
}
