//! Keeps some states of a run for the report, in memory that does not depend on their number.

use cutis_volume::Volume;
use nalgebra::Vector3;

use super::{MOST_BYTES, MOST_STATES, Surface};
use crate::Error;
use crate::body::Body;
use crate::model::Simulation;
use crate::run::frames::FrameRow;

/// A state of the surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct State {
    /// What the state is, for a reader.
    pub(crate) name: String,
    /// Openings, forces and the time.
    pub(crate) row: FrameRow,
    /// Displacement of each moving point of the surface, mm. Empty in the scan.
    pub(crate) moved_mm: Vec<Vector3<f32>>,
}

/// The surface of a body, and the states of it that are kept.
#[derive(Clone, Debug)]
pub(crate) struct Recorder {
    pub(crate) surface: Surface,
    /// The states in the order of time. The first one is the body in the scan.
    pub(crate) states: Vec<State>,
    /// Number of frames of the run, and how many of them are kept at most.
    frames: Quota,
    /// The same for the states of rest after the frames.
    rests: Quota,
    /// The frame from which the run resumed. The states before it are missing.
    pub(crate) resumed: Option<u32>,
}

/// How many of `count` states are kept.
#[derive(Clone, Copy, Debug)]
struct Quota {
    count: u64,
    most: u64,
}

impl Quota {
    /// Whether the state of this number is kept, from 1 to `count`. The last one is, and the others
    /// are at equal distances.
    fn keeps(self, number: u64) -> bool {
        let Self { count, most } = self;
        count <= most || number * most / count != (number - 1) * most / count
    }
}

impl Recorder {
    /// For a run with a number of frames, after which `rests` states of rest follow. None without a
    /// skin.
    pub(crate) fn new(body: &Body, ct: &Volume, frames: u32, rests: usize) -> Option<Self> {
        Some(Self::of(Surface::of(body, ct)?, frames, rests))
    }

    pub(super) fn of(surface: Surface, frames: u32, rests: usize) -> Self {
        let left = MOST_BYTES.saturating_sub(surface.bytes());
        let most = (left / surface.state_bytes().max(1)).clamp(1, MOST_STATES) as u64;
        let (frames, rests) = (u64::from(frames), rests as u64);
        let for_rests = match (frames, rests) {
            (0, _) => most,
            (_, 0) => 0,
            (_, rests) => rests.min(most.div_ceil(2)),
        };
        Self {
            surface,
            states: Vec::new(),
            frames: Quota { count: frames, most: most - for_rests },
            rests: Quota { count: rests, most: for_rests },
            resumed: None,
        }
    }

    /// Keeps as many states as fit into a number of bytes, before base64: the one in the scan, the
    /// last one, and others at equal distances.
    pub(crate) fn thin(&mut self, bytes: usize) {
        let most = bytes.saturating_sub(self.surface.bytes()) / self.surface.state_bytes().max(1);
        let quota = Quota { count: self.states.len().saturating_sub(1) as u64, most: most.max(1) as u64 };
        let mut number = 0;
        self.states.retain(|_| {
            number += 1;
            number == 1 || quota.keeps(number - 1)
        });
    }

    /// Begins with the body in the scan. With `resumed` the run begins after that frame.
    pub(crate) fn start(&mut self, row: &FrameRow, resumed: Option<u32>) {
        let name = "in the scan".to_owned();
        self.states.push(State { name, row: row.clone(), moved_mm: Vec::new() });
        self.resumed = resumed.filter(|&frame| frame > 0);
    }

    /// Keeps the state after a frame, if it is one of those that are kept.
    ///
    /// # Errors
    /// The errors of the simulation.
    pub(crate) fn frame(&mut self, simulation: &mut dyn Simulation, row: &FrameRow) -> Result<(), Error> {
        if !self.frames.keeps(row.frame.into()) {
            return Ok(());
        }
        self.keep(format!("after frame {}", row.frame), simulation, row)
    }

    /// Keeps state of rest `number` of `count`, from 1 on, if it is one of those that are kept. It
    /// follows what was `done`.
    ///
    /// # Errors
    /// The errors of the simulation.
    pub(crate) fn rest(
        &mut self,
        [number, count]: [usize; 2],
        done: &[String],
        simulation: &mut dyn Simulation,
        row: &FrameRow,
    ) -> Result<(), Error> {
        if !(Quota { count: count as u64, ..self.rests }).keeps(number as u64) {
            return Ok(());
        }
        let name = match done {
            [] => "at rest".to_owned(),
            done => format!("at rest after {}", done.join(", ")),
        };
        self.keep(name, simulation, row)
    }

    fn keep(&mut self, name: String, simulation: &mut dyn Simulation, row: &FrameRow) -> Result<(), Error> {
        let moved_mm = self.surface.moved_mm(&simulation.positions_of(&self.surface.nodes)?);
        self.states.push(State { name, row: row.clone(), moved_mm });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_kept_at_equal_distances_with_the_last_one() {
        for (count, most) in [(1, 1), (7, 7), (60, 40), (61, 40), (1000, 3), (4_000_000_000, 39)] {
            let quota = Quota { count, most };
            let numbers: Vec<u64> = match count {
                ..=1000 => (1..=count).collect(),
                _ => (count - 1000..=count).collect(),
            };
            let kept: Vec<u64> = numbers.into_iter().filter(|&n| quota.keeps(n)).collect();
            assert_eq!(kept.last(), Some(&count), "{count}, {most}");
            if count <= 1000 {
                assert_eq!(kept.len() as u64, most.min(count));
                let gaps: Vec<u64> = kept.windows(2).map(|pair| pair[1] - pair[0]).collect();
                let (least, largest) = (gaps.iter().min(), gaps.iter().max());
                assert!(least.zip(largest).is_none_or(|(least, largest)| largest - least <= 1), "{gaps:?}");
            }
        }
        assert!(!(1..=9).any(|n| Quota { count: 9, most: 0 }.keeps(n)));
    }

    #[test]
    fn thinned_states_fit_and_the_last_one_stays() {
        let surface = Surface {
            rest: vec![nalgebra::Point3::origin(); 10],
            moving: vec![cutis_mesh::sever::Embedded::node(0); 10],
            ..Surface::default()
        };
        let row = |frame| FrameRow {
            frame,
            time_s: 0.0,
            ms: None,
            gapes: vec![],
            sutures: vec![],
            handles: vec![],
        };
        for (bytes, left) in [(0, 2), (100 + 60, 2), (100 + 4 * 60, 5), (100 + 100 * 60, 13)] {
            let mut recorder = Recorder::of(surface.clone(), 12, 0);
            recorder.start(&row(0), None);
            let state = |frame| State { name: String::new(), row: row(frame), moved_mm: vec![] };
            recorder.states.extend((1..=12).map(state));
            recorder.thin(bytes);
            assert_eq!(recorder.states.len(), left, "{bytes}");
            let frames: Vec<u32> = recorder.states.iter().map(|state| state.row.frame).collect();
            assert_eq!((frames[0], frames[left - 1]), (0, 12));
        }
    }

    /// Frames and states of rest share the memory.
    #[test]
    fn the_states_fit_the_limit_for_each_size() {
        for points in [0, 1, 100, 40_000] {
            let surface = Surface {
                rest: vec![nalgebra::Point3::origin(); points],
                moving: vec![cutis_mesh::sever::Embedded::node(0); points],
                triangles: vec![[0; 3]; 3 * points],
                ..Surface::default()
            };
            for (frames, rests) in [(0, 0), (0, 1), (0, 5000), (3, 0), (60, 2), (u32::MAX, 100), (1, 1)] {
                let recorder = Recorder::of(surface.clone(), frames, rests);
                let kept = |quota: Quota| quota.most.min(quota.count) as usize;
                let states = kept(recorder.frames) + kept(recorder.rests);
                let bytes = surface.bytes() + states * surface.state_bytes();
                assert!(states <= MOST_STATES && bytes <= MOST_BYTES, "{points}: {states} of {bytes} bytes");
                assert!((frames == 0 && rests == 0) || states > 0);
            }
        }
    }
}
