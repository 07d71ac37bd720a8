//! The compared state of a checkpoint. `crates/cutis/src/run/checkpoint.rs` describes the layout.

use std::path::Path;

use anyhow::bail;

use crate::parity::bench::Failure;

const MAGIC: &[u8] = b"CUTISCP3";
/// Length of magic, fingerprint, frame, and number of vertices.
const HEADER: usize = 8 + 32 + 4 + 8;

/// Positions in local meters and velocities in m/s, x, y, z of each vertex in turn.
pub struct State {
    pub positions: Vec<f32>,
    pub velocities: Vec<f32>,
}

impl State {
    /// Reads the final state of a run.
    ///
    /// # Errors
    /// The file does not exist or has another layout.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let bytes = std::fs::read(path)?;
        let count = bytes.get(HEADER - 8..HEADER).and_then(|count| count.try_into().ok());
        let numbers = count.and_then(|count| usize::try_from(u64::from_le_bytes(count)).ok());
        // Threads and hooks store further words after the velocities.
        let length = numbers.and_then(|count| count.checked_mul(24));
        let state = length.and_then(|length| bytes.get(HEADER..)?.get(..length));
        let (Some(state), true) = (state, bytes.starts_with(MAGIC)) else {
            bail!("{} is not a checkpoint of the known layout", path.display());
        };
        let mut values: Vec<f32> =
            state.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let velocities = values.split_off(values.len() / 2);
        Ok(Self { positions: values, velocities })
    }

    /// Largest coordinate in m; the origin is in the middle of the body.
    pub fn extent(&self) -> f64 {
        self.positions.iter().fold(0.0, |most: f64, &x| most.max(f64::from(x).abs()))
    }
}
