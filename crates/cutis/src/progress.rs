//! Reports the progress of a run to the caller.

/// Receives the progress of long work. Worker threads may call all methods.
pub trait Progress: Sync {
    /// A stage begins; it will report up to `total` units (0: unknown).
    fn begin(&self, stage: &str, total: u64);
    /// The current stage turned out to have `total` units.
    fn set_total(&self, total: u64) {
        let _ = total;
    }
    /// `done` units of the current stage are finished.
    fn advance(&self, done: u64);
    /// `done` of `total` units of the current stage are finished.
    fn advance_of(&self, done: u64, total: u64) {
        self.set_total(total);
        self.advance(done);
    }
    /// The current stage is finished.
    fn end(&self);
    /// A note to the user. Each note is sent once.
    fn note(&self, message: &str);
    /// Whether the user asked for the end of the run. A run asks before each frame, and before and
    /// after each search for a state of rest. It then writes a checkpoint and returns
    /// [`Error::Interrupted`](crate::Error::Interrupted).
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Ignores all progress.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _stage: &str, _total: u64) {}
    fn advance(&self, _done: u64) {}
    fn end(&self) {}
    fn note(&self, _message: &str) {}
}
