//! Ctrl-C during a run: its state is saved, no partial file stays, and the last line says how to
//! resume.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

use cutis::RunFolder;

use crate::terminal;

/// Exit code of a program that SIGINT ended.
pub(crate) const INTERRUPTED: u8 = 130;

/// Whether the present stage asks for the wish of the user, so that it can end by itself.
static ASKS: AtomicBool = AtomicBool::new(false);
/// Whether the user pressed Ctrl-C.
static PRESSED: AtomicBool = AtomicBool::new(false);

/// Whether the user pressed Ctrl-C. A stage that asks ends by itself.
pub(crate) fn is_asked() -> bool {
    ASKS.store(true, Ordering::SeqCst);
    PRESSED.load(Ordering::SeqCst)
}

/// The next stage has not asked yet.
pub(crate) fn stage_ended() {
    ASKS.store(false, Ordering::SeqCst);
}

/// A run that can be interrupted.
pub(crate) struct Interruptible {
    /// The run folder.
    pub(crate) out: PathBuf,
    /// Whether the command can resume, as `cutis run` and `cutis settle` can.
    pub(crate) can_resume: bool,
    /// Whether the run itself resumed from a checkpoint.
    pub(crate) resumed: bool,
}

impl Interruptible {
    /// Waits for Ctrl-C in the background. A run that can be resumed then ends after the present
    /// frame or search for rest, and saves its state. Everything else ends at once, and so does a
    /// run at the second Ctrl-C. Without a handler, which a system may refuse, Ctrl-C ends the
    /// program as it always does.
    #[expect(
        clippy::disallowed_methods,
        reason = "the run goes on in other threads; its partial files are removed"
    )]
    pub(crate) fn watch(self) {
        let start = SystemTime::now();
        let _ = ctrlc::set_handler(move || {
            let is_first = !PRESSED.swap(true, Ordering::SeqCst);
            if is_first && self.can_resume && ASKS.load(Ordering::SeqCst) {
                terminal::interrupted(
                    "the run ends after this frame or search; Ctrl-C again ends it at once",
                );
                return;
            }
            terminal::interrupted(&self.message(start));
            remove_partial_files(&self.out);
            std::process::exit(INTERRUPTED.into());
        });
    }

    /// The message of a run that has saved its state.
    pub(crate) fn saved(checkpoint: &Path, resumed: bool) -> String {
        let call: Vec<String> = std::env::args().map(|word| quoted(&word)).collect();
        let resume = if resumed { "" } else { " --resume" };
        format!(
            "interrupted; {} holds a state of this run. To continue: {}{resume}",
            checkpoint.display(),
            call.join(" ")
        )
    }

    fn message(&self, start: SystemTime) -> String {
        let checkpoint = RunFolder(self.out.clone()).checkpoint();
        let written = std::fs::metadata(&checkpoint).and_then(|facts| facts.modified());
        let is_ours = written.is_ok_and(|written| self.resumed || written >= start);
        match (self.can_resume, is_ours) {
            (true, true) => Self::saved(&checkpoint, self.resumed),
            (true, false) => "interrupted; there is no checkpoint of this run to resume from: \
                              run.checkpoint_every = 10 saves its state after every tenth frame, \
                              and after each search for rest"
                .into(),
            (false, _) => "interrupted; only `cutis run` and `cutis settle` can be resumed".into(),
        }
    }
}

/// Waits for Ctrl-C during a sweep. The processes of its cases receive it, too.
#[expect(clippy::disallowed_methods, reason = "the sweep itself writes no file while cases run")]
pub(crate) fn watch_sweep() {
    let _ = ctrlc::set_handler(move || {
        terminal::interrupted("interrupted; the same command goes on with the cases that are not done");
        std::process::exit(INTERRUPTED.into());
    });
}

/// Removes the hidden files of this process from the run folder.
fn remove_partial_files(folder: &Path) {
    let prefix = format!(".cutis-{}-", std::process::id());
    let folders = [folder.to_owned(), RunFolder(folder.to_owned()).series_folder()];
    let entries = folders.iter().flat_map(|folder| std::fs::read_dir(folder).into_iter().flatten().flatten());
    let is_ours = |name: &str| name.starts_with(&prefix) && name.ends_with(".part");
    for entry in entries.filter(|entry| entry.file_name().to_str().is_some_and(is_ours)) {
        // The program ends, and there is nobody to tell of a file that stays.
        let _ = std::fs::remove_file(entry.path());
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@+".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
