//! Scenes shared by tests and benches.
