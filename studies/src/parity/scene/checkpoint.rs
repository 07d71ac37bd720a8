//! The compared state of a checkpoint. `crates/cutis/src/run/checkpoint.rs` describes the layout.

use std::path::Path;

use anyhow::bail;

use crate::parity::bench::Failure;

const MAGIC: &[u8] = b"CUTISCP5";
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
        match vectors(&bytes) {
            Some([positions, velocities]) => Ok(Self { positions, velocities }),
            None => bail!("{} is not a checkpoint of the known layout", path.display()),
        }
    }

    /// Largest coordinate in m; the origin is in the middle of the body.
    pub fn extent(&self) -> f64 {
        self.positions.iter().fold(0.0, |most: f64, &x| most.max(f64::from(x).abs()))
    }
}

/// Positions and velocities in the bytes of a checkpoint. The history of the frames and the states
/// of rest lie between them. Threads and hooks store further words after the velocities.
fn vectors(bytes: &[u8]) -> Option<[Vec<f32>; 2]> {
    let (header, rest) = bytes.split_at_checked(HEADER)?;
    let count = usize::try_from(u64::from_le_bytes(header[HEADER - 8..].try_into().ok()?)).ok()?;
    let length = count.checked_mul(12)?;
    let (positions, rest) = rest.split_at_checked(length)?;
    let (head, rest) = rest.split_at_checked(16)?;
    let number = |n: usize| Some(u32::from_le_bytes(head[4 * n..][..4].try_into().ok()?) as usize);
    let width = 2 + 5 * number(0)? + 2 * number(1)? + number(2)?;
    let history = width.checked_mul(8)?.checked_mul(number(3)?)?;
    let (rests, rest) = rest.get(history..)?.split_first_chunk::<4>()?;
    let velocities = rest.get(u32::from_le_bytes(*rests) as usize..)?.get(..length)?;
    let values = |bytes: &[u8]| {
        bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect::<Vec<f32>>()
    };
    bytes.starts_with(MAGIC).then(|| [values(positions), values(velocities)])
}
