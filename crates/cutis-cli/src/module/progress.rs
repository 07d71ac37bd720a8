//! Progress for 3D Slicer: elements of XML on standard output.

use std::io::Write;
use std::sync::Mutex;
use std::time::Instant;

use cutis::Progress;

use super::xml::escaped;

/// Prints the progress of a run as the execution model of 3D Slicer defines it.
#[derive(Default)]
pub(super) struct ModuleProgress(Mutex<Option<Stage>>);

struct Stage {
    name: String,
    start: Instant,
    total: u64,
    /// Last printed share in percent.
    percent: u64,
}

impl ModuleProgress {
    fn with(&self, act: impl FnOnce(&mut Option<Stage>)) {
        // A poisoned lock means that another thread panicked while printing.
        act(&mut self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner()));
    }
}

/// Prints a line, and shows it at once. A closed pipe is ignored.
fn line(text: &str) {
    let mut out = std::io::stdout();
    let _ = writeln!(out, "{text}").and_then(|()| out.flush());
}

impl Progress for ModuleProgress {
    fn begin(&self, stage: &str, total: u64) {
        let name = escaped(stage);
        line(&format!(
            "<filter-start><filter-name>{name}</filter-name><filter-comment>{name}</filter-comment></filter-start>"
        ));
        let start = Instant::now();
        self.with(|slot| *slot = Some(Stage { name, start, total, percent: 0 }));
    }

    fn set_total(&self, total: u64) {
        self.with(|slot| {
            if let Some(stage) = slot {
                stage.total = total;
            }
        });
    }

    fn advance(&self, done: u64) {
        self.with(|slot| {
            let Some(stage) = slot.as_mut().filter(|stage| stage.total > 0) else { return };
            let percent = (100 * done.min(stage.total)) / stage.total;
            if percent > stage.percent {
                stage.percent = percent;
                line(&format!("<filter-progress>{}</filter-progress>", percent as f64 / 100.0));
            }
        });
    }

    fn end(&self) {
        self.with(|slot| {
            if let Some(Stage { name, start, .. }) = slot.take() {
                let time = start.elapsed().as_secs_f64();
                line(&format!("<filter-end><filter-name>{name}</filter-name><filter-time>{time:.3}</filter-time></filter-end>"));
            }
        });
    }

    fn note(&self, message: &str) {
        crate::terminal::note(message);
    }
}
