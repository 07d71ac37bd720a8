//! Output for the user: progress bars on a terminal, plain lines in a pipe, errors.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::Instant;

use cutis::Progress;
use indicatif::{ProgressBar, ProgressStyle};

/// Prints an error on standard error.
pub(crate) fn error(error: &cutis::Error) {
    say(&format!("error: {error}"));
}

/// Prints the last line of an interrupted program. A progress bar stays above it.
pub(crate) fn interrupted(message: &str) {
    say(&format!("\n{message}"));
}

/// Prints a line on standard output. A closed pipe is ignored.
pub(crate) fn print(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

/// Prints a note on standard error.
pub(crate) fn note(message: &str) {
    say(&format!("note: {message}"));
}

/// Prints a line on standard error.
pub(crate) fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Progress on standard error.
pub(crate) struct Terminal {
    interactive: bool,
    stage: Mutex<Option<Stage>>,
}

struct Stage {
    name: String,
    start: Instant,
    bar: Option<ProgressBar>,
}

impl Terminal {
    pub(crate) fn new() -> Self {
        Self { interactive: std::io::stderr().is_terminal(), stage: Mutex::new(None) }
    }

    fn with(&self, act: impl FnOnce(&mut Option<Stage>)) {
        // A poisoned lock means that another thread panicked while drawing. The bar still works.
        act(&mut self.stage.lock().unwrap_or_else(|poisoned| poisoned.into_inner()));
    }
}

impl Progress for Terminal {
    fn begin(&self, stage: &str, total: u64) {
        let bar = self.interactive.then(|| {
            let (bar, template) = if total > 0 {
                (ProgressBar::new(total), "{msg:28} {bar:32} {pos}/{len} {eta} left")
            } else {
                (ProgressBar::new_spinner(), "{msg:28} {spinner} {elapsed}")
            };
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_message(stage.to_owned());
            bar.enable_steady_tick(std::time::Duration::from_millis(100));
            bar
        });
        self.with(|slot| *slot = Some(Stage { name: stage.to_owned(), start: Instant::now(), bar }));
    }

    fn advance(&self, done: u64) {
        self.with(|slot| {
            if let Some(Stage { bar: Some(bar), .. }) = slot {
                bar.set_position(done);
            }
        });
    }

    fn end(&self) {
        self.with(|slot| {
            if let Some(stage) = slot.take() {
                if let Some(bar) = stage.bar {
                    bar.finish_and_clear();
                }
                say(&format!("{:28} {:8.2} s", stage.name, stage.start.elapsed().as_secs_f64()));
            }
        });
    }

    fn note(&self, message: &str) {
        self.with(|slot| match slot {
            Some(Stage { bar: Some(bar), .. }) => bar.println(format!("note: {message}")),
            _ => say(&format!("note: {message}")),
        });
    }
}
