//! Frame times and `frames.csv`.

use std::fmt::Write as _;

use cutis_mesh::WoundGape;

use crate::output::report::{Frames, fixed};

/// One line of `frames.csv`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FrameRow {
    pub(crate) frame: u32,
    pub(crate) time_s: f64,
    /// Wall time of the frame, ms; none for the state before the first frame, and for a frame that
    /// an earlier run computed.
    pub(crate) ms: Option<f64>,
    pub(crate) gapes: Vec<WoundGape>,
    /// Sum of the forces in the threads of each suture, and the largest one, N.
    pub(crate) sutures: Vec<[f64; 2]>,
    /// Size of the force of each handle, N.
    pub(crate) handles: Vec<f64>,
}

impl FrameRow {
    /// Whether both rows are of the same frame, and of the same wounds, sutures and handles.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let shape = |row: &Self| (row.frame, row.gapes.len(), row.sutures.len(), row.handles.len());
        shape(self) == shape(other)
    }
}

/// Mean and shortest time of the frames that this run computed.
pub(crate) fn frame_times(rows: &[FrameRow]) -> Frames {
    let times: Vec<f64> = rows.iter().filter_map(|row| row.ms).collect();
    if times.is_empty() {
        return Frames::default();
    }
    Frames {
        count: times.len() as u32,
        ms_mean: times.iter().sum::<f64>() / times.len() as f64,
        ms_min: times.iter().copied().fold(f64::INFINITY, f64::min),
    }
}

/// The text of `frames.csv`. Its first line of values is the state before the first frame.
/// The wall time is 0 in that line, and empty for frames that an earlier run computed.
pub(crate) fn frames_csv(rows: &[FrameRow]) -> String {
    let wounds = rows.first().map_or(0, |row| row.gapes.len());
    let mut out = String::from("frame,time_s,ms");
    for n in 0..wounds {
        let _ = write!(out, ",gape_{n}_mean_mm,gape_{n}_mid_mm");
    }
    for n in 0..rows.first().map_or(0, |row| row.sutures.len()) {
        let _ = write!(out, ",suture_{n}_n,suture_{n}_largest_n");
    }
    for n in 0..rows.first().map_or(0, |row| row.handles.len()) {
        let _ = write!(out, ",handle_{n}_n");
    }
    out.push('\n');
    for row in rows {
        let ms = match (row.frame, row.ms) {
            (_, Some(ms)) => format!("{ms:.3}"),
            (0, None) => "0.000".into(),
            (_, None) => String::new(),
        };
        let _ = write!(out, "{},{},{ms}", row.frame, row.time_s);
        for gape in &row.gapes {
            let _ = write!(out, ",{},{}", fixed(gape.mean_mm, 4), fixed(gape.mid_mm, 4));
        }
        for [sum, largest] in &row.sutures {
            let _ = write!(out, ",{sum:.5},{largest:.5}");
        }
        for force in &row.handles {
            let _ = write!(out, ",{force:.5}");
        }
        out.push('\n');
    }
    out
}
