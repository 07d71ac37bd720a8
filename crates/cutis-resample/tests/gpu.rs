//! GPU resampling.
