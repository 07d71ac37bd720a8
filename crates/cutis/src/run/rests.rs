//! The states of rest before a checkpoint, as bytes.
//!
//! Layout: the length in bytes (u32, little-endian), then JSON, with spaces up to a multiple of
//! four bytes. A length of zero stands for none. The wall times are zero, so that a state has the
//! same bytes on each machine.

use serde::{Deserialize, Serialize};

use super::frames::FrameRow;
use crate::output::rest_report::{RestReport, StopReport};

/// The states of rest up to a checkpoint, which holds the last one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rests {
    pub(crate) stops: Vec<StopReport>,
    /// The search for the last one.
    pub(crate) last: RestReport,
}

impl Rests {
    /// Whether the states have the wounds, sutures and handles of a row.
    pub(super) fn are_like(&self, row: &FrameRow) -> bool {
        let shape = [row.gapes.len(), row.gapes.len(), row.sutures.len(), row.handles.len()];
        self.stops.iter().all(|stop| {
            [&stop.mean_mm, &stop.mid_mm, &stop.sutures_n, &stop.handles_n].map(Vec::len) == shape
        })
    }
}

/// Appends the states.
pub(super) fn encode(rests: Option<&Rests>, bytes: &mut Vec<u8>) {
    let without_times = |rests: &Rests| {
        let mut rests = rests.clone();
        rests.stops.iter_mut().for_each(|stop| stop.ms = 0.0);
        rests.last.ms = 0.0;
        serde_json::to_vec(&rests).unwrap_or_default()
    };
    let mut text = rests.map(without_times).unwrap_or_default();
    text.resize(text.len().next_multiple_of(4), b' ');
    bytes.extend_from_slice(&(text.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&text);
}

/// The states at the beginning of `bytes`, and what follows them. None if the bytes do not hold
/// them.
pub(super) fn decode(bytes: &[u8]) -> Option<(Option<Rests>, &[u8])> {
    let (length, bytes) = bytes.split_first_chunk::<4>()?;
    let (text, rest) = bytes.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    if text.is_empty() {
        return Some((None, rest));
    }
    let rests: Rests = serde_json::from_slice(text).ok()?;
    (!rests.stops.is_empty()).then_some((Some(rests), rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_survive_without_their_times_and_damage_is_noticed() {
        let stop = StopReport {
            time_s: 0.1,
            done: vec!["incision[0]".into()],
            mean_mm: vec![1.0 / 3.0],
            mid_mm: vec![2.5],
            sutures_n: vec![],
            handles_n: vec![1e-7],
            error: 1e-3,
            steps: 3,
            cycles: 17,
            ms: 12.5,
        };
        let last =
            RestReport { error: 1e-3, force: 1e-6, ms: 12.5, equations_on: "cpu".into(), steps: vec![] };
        let rests = Rests { stops: vec![stop], last };
        let gape = cutis_mesh::WoundGape {
            mean_mm: 0.0,
            mid_mm: 0.0,
            mean_distance_mm: 0.0,
            mid_distance_mm: 0.0,
            bins: 0,
        };
        let row = |wounds: usize| FrameRow {
            frame: 0,
            time_s: 0.0,
            ms: None,
            gapes: vec![gape; wounds],
            sutures: vec![],
            handles: vec![1.0],
        };
        assert!(rests.are_like(&row(1)) && !rests.are_like(&row(2)));
        let mut expected = rests.clone();
        expected.stops[0].ms = 0.0;
        expected.last.ms = 0.0;
        for (rests, expected) in [(None, None), (Some(rests), Some(expected))] {
            let mut bytes = Vec::new();
            encode(rests.as_ref(), &mut bytes);
            assert_eq!(bytes.len() % 4, 0);
            bytes.extend_from_slice(b"rest");
            let (back, rest) = decode(&bytes).unwrap();
            assert_eq!((&back, rest), (&expected, b"rest".as_slice()));
            let mut damaged = bytes.clone();
            damaged[0] ^= 8;
            assert!(decode(&damaged).is_none() && decode(&bytes[..3]).is_none());
        }
        assert!(decode(b"\x04\0\0\0{}  ").is_none());
    }
}
