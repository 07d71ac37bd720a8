//! Output for the user: progress bars on a terminal, plain lines in a pipe, errors.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use cutis::Progress;
use indicatif::{ProgressBar, ProgressStyle};

use crate::interrupt;

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

/// Shows the share that is done and an estimate of the time left, or, of a stage without a known
/// total, the time so far.
fn show_total(bar: &ProgressBar, total: u64) {
    let template = match total {
        0 => "{msg:28} {spinner} {elapsed}",
        _ => "{msg:28} {bar:32} {pos}/{len} about {eta} left",
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    if total > 0 {
        bar.set_length(total);
    }
}

impl Progress for Terminal {
    fn begin(&self, stage: &str, total: u64) {
        let bar = self.interactive.then(|| {
            let bar = ProgressBar::new_spinner();
            show_total(&bar, total);
            bar.set_message(stage.to_owned());
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        });
        self.with(|slot| *slot = Some(Stage { name: stage.to_owned(), start: Instant::now(), bar }));
    }

    fn set_total(&self, total: u64) {
        self.with(|slot| {
            if let Some(Stage { bar: Some(bar), .. }) = slot
                && bar.length() != Some(total)
            {
                show_total(bar, total);
            }
        });
    }

    fn advance(&self, done: u64) {
        self.with(|slot| {
            if let Some(Stage { bar: Some(bar), .. }) = slot {
                bar.set_position(done);
            }
        });
    }

    fn end(&self) {
        interrupt::stage_ended();
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

    fn is_stopped(&self) -> bool {
        interrupt::is_asked()
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::{Arc, Mutex};

    use indicatif::{ProgressDrawTarget, TermLike};

    use super::*;

    /// A terminal of one line that keeps its text.
    #[derive(Clone, Debug, Default)]
    struct Screen(Arc<Mutex<String>>);

    impl TermLike for Screen {
        fn width(&self) -> u16 {
            120
        }
        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn write_line(&self, text: &str) -> io::Result<()> {
            self.write_str(text)
        }
        fn write_str(&self, text: &str) -> io::Result<()> {
            self.0.lock().unwrap().push_str(text);
            Ok(())
        }
        fn clear_line(&self) -> io::Result<()> {
            self.0.lock().unwrap().clear();
            Ok(())
        }
        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    /// What a user sees of a stage that is half done after a minute.
    fn shown(total: u64) -> String {
        let screen = Screen::default();
        let target = ProgressDrawTarget::term_like(Box::new(screen.clone()));
        let bar = ProgressBar::with_draw_target(None, target).with_elapsed(Duration::from_secs(60));
        show_total(&bar, total);
        bar.set_message("simulate");
        bar.set_position(total / 2);
        bar.force_draw();
        screen.0.lock().unwrap().clone()
    }

    #[test]
    fn a_stage_with_a_total_shows_the_time_left() {
        let text = shown(10);
        assert!(text.contains("simulate") && text.contains("5/10") && text.contains("left"), "{text}");
        // Control: nobody knows how long another stage takes.
        let unknown = shown(0);
        assert!(unknown.contains("simulate") && !unknown.contains("left"), "{unknown}");
    }
}
