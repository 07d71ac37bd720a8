//! Another program: a script of `studies/python` that waits for its turns.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use anyhow::{Context, bail};
use serde::de::DeserializeOwned;

use super::turns::{About, Program, Turn};
use crate::kit::{Failure, command, root};

/// Longest time in which a program must answer.
const LIMIT: Duration = Duration::from_secs(240);

/// A script that runs. It ends when this value is dropped.
pub struct Script {
    child: Child,
    input: ChildStdin,
    lines: Receiver<String>,
    errors: PathBuf,
}

impl Script {
    /// Starts `studies/python/NAME.py`. `folder` is for its errors and for compiled code.
    ///
    /// # Errors
    /// The interpreter cannot be started.
    pub fn start(python: &Path, name: &str, arguments: &[String], folder: &Path) -> Result<Self, Failure> {
        fs::create_dir_all(folder)?;
        let errors = folder.join(name).with_extension("log");
        let mut command = command(python);
        command.arg(root().join("studies/python").join(name).with_extension("py"));
        command.args(arguments).arg("--wait").env("PYTHONDONTWRITEBYTECODE", "1");
        for (variable, name) in [("WARP_CACHE_PATH", "warp"), ("NUMBA_CACHE_DIR", "numba")] {
            command.env(variable, folder.join(name));
        }
        // MuJoCo writes its warnings into a file in the current folder.
        command.current_dir(folder);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(File::create(&errors)?);
        let mut child = command.spawn().with_context(|| format!("cannot start {}", python.display()))?;
        let (input, output) = (child.stdin.take().context("no input")?, child.stdout.take());
        let (sender, lines) = channel();
        let output = BufReader::new(output.context("no output")?);
        std::thread::spawn(move || {
            // Libraries may print other lines.
            let lines = output.lines().map_while(Result::ok).filter(|line| line.starts_with('{'));
            lines.into_iter().try_for_each(|line| sender.send(line))
        });
        Ok(Self { child, input, lines, errors })
    }

    fn answer<T: DeserializeOwned>(&mut self) -> Result<T, Failure> {
        match self.lines.recv_timeout(LIMIT) {
            Ok(line) => Ok(serde_json::from_str(&line)?),
            Err(RecvTimeoutError::Timeout) => bail!("no answer in {} s", LIMIT.as_secs()),
            Err(RecvTimeoutError::Disconnected) => {
                let status = self.child.wait()?;
                let errors = fs::read_to_string(&self.errors).unwrap_or_default();
                let last = errors.lines().rev().find(|line| !line.trim().is_empty());
                bail!("{}", last.map_or_else(|| format!("ended with {status}"), str::to_owned))
            }
        }
    }
}

impl Program for Script {
    fn about(&mut self) -> Result<About, Failure> {
        self.answer()
    }

    fn turn(&mut self) -> Result<Turn, Failure> {
        // A script that has ended takes no input. Its answer says why it has ended.
        let _ = self.input.write_all(b"\n").and_then(|()| self.input.flush());
        self.answer()
    }
}

impl Drop for Script {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
