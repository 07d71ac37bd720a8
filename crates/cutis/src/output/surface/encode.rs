//! A surface and its states as bytes that a browser reads.
//!
//! Blocks in this order, little-endian, each filled up to a multiple of four bytes:
//!
//! | block | values |
//! |---|---|
//! | triangles | three point numbers each, u16 |
//! | positions in the scan | three u16 for each point, in steps of `step_mm` from `low_mm` |
//! | tissue | red, green, blue and 255 on the skin or 0 in a wound, u8, for each point |
//! | one block for each state but the one in the scan | three i16 for each moving point, in steps of `moved_step_mm` |

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::{Recorder, Surface};

/// An encoded surface.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Encoded {
    points: usize,
    /// Number of points that can move. They come first.
    moving: usize,
    triangles: usize,
    /// Number of states, with the one in the scan.
    states: usize,
    /// World mm, RAS+.
    low_mm: [f64; 3],
    high_mm: [f64; 3],
    step_mm: f64,
    moved_step_mm: f64,
    /// Largest displacement of a point in any state, mm.
    most_mm: f64,
    #[serde(skip)]
    pub(crate) bytes: Vec<u8>,
}

/// Encodes the surface and the states. `origin_mm` is the world position of the local origin.
///
/// A position has an error of at most half a step along each axis: the longest side of the box
/// around the surface, over 131,070. A displacement has one of the largest component of any
/// displacement, over 65,534. What is not a number becomes 0.
pub(crate) fn encode(recorder: &Recorder, origin_mm: Point3<f64>) -> Encoded {
    let Recorder { surface: Surface { rest, moving, triangles, tissue, .. }, states, .. } = recorder;
    let mm = |point: &Point3<f32>| point.cast::<f64>() * 1000.0;
    let is_finite = |point: &Point3<f64>| point.iter().all(|c| c.is_finite());
    let ends = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
    let places = rest.iter().map(mm).filter(is_finite);
    let (low, high) = places.fold(ends, |(low, high), point| (low.inf(&point), high.sup(&point)));
    let (low, high) = if low <= high { (low, high) } else { (Point3::origin(), Point3::origin()) };
    let step = (high - low).amax() / f64::from(u16::MAX);
    let moved = || states.iter().flat_map(|state| &state.moved_mm).map(|moved| moved.cast::<f64>());
    let finite = || moved().filter(|moved| moved.iter().all(|c| c.is_finite()));
    let moved_step = finite().map(|moved| moved.amax()).fold(0.0, f64::max) / f64::from(i16::MAX);

    let mut bytes = Vec::new();
    let mut add = |values: &mut dyn Iterator<Item = u8>| {
        bytes.extend(values);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    };
    add(&mut triangles.iter().flatten().flat_map(|&v| (v as u16).to_le_bytes()));
    let steps = |value: f64, step: f64| if step > 0.0 { (value / step).round() } else { 0.0 };
    let places = rest.iter().flat_map(|point| (mm(point) - low).data.0[0]);
    // Casts take what is not a number for 0, and the nearest value for what is too large.
    add(&mut places.flat_map(|value| (steps(value, step) as u16).to_le_bytes()));
    add(&mut tissue.iter().flat_map(|&([r, g, b], on_skin)| [r, g, b, if on_skin { 255 } else { 0 }]));
    for state in states.iter().skip(1) {
        let still = Vector3::zeros();
        let moved = (0..moving.len()).map(|n| state.moved_mm.get(n).unwrap_or(&still));
        let values = moved.flat_map(|moved| moved.cast::<f64>().data.0[0]);
        add(&mut values.flat_map(|value| (steps(value, moved_step) as i16).to_le_bytes()));
    }
    Encoded {
        points: rest.len(),
        moving: moving.len(),
        triangles: triangles.len(),
        states: states.len(),
        low_mm: (low + origin_mm.coords).into(),
        high_mm: (high + origin_mm.coords).into(),
        step_mm: step,
        moved_step_mm: moved_step,
        most_mm: finite().map(|moved| moved.norm()).fold(0.0, f64::max),
        bytes,
    }
}

#[cfg(test)]
mod tests {
    use super::super::State;
    use super::*;
    use crate::run::frames::FrameRow;
    use cutis_mesh::sever::Embedded;

    fn state(moved_mm: Vec<Vector3<f32>>) -> State {
        let row =
            FrameRow { frame: 1, time_s: 0.5, ms: None, gapes: vec![], sutures: vec![], handles: vec![] };
        State { name: "x".into(), row, moved_mm }
    }

    fn recorder(rest: Vec<Point3<f32>>, moved: &[Vector3<f32>]) -> Recorder {
        let surface = Surface {
            tissue: vec![([1, 2, 3], true); rest.len()],
            moving: vec![Embedded::node(0); moved.len()],
            triangles: vec![[0, 1, 2]],
            nodes: vec![0],
            rest,
        };
        let mut recorder = Recorder::of(surface, 1, 0);
        recorder.states = vec![state(Vec::new()), state(moved.to_vec())];
        recorder
    }

    /// The values of a block of 16-bit numbers, read without the encoder.
    fn block(bytes: &[u8], at: usize, count: usize) -> Vec<[u8; 2]> {
        (0..count).map(|n| [bytes[at + 2 * n], bytes[at + 2 * n + 1]]).collect()
    }

    #[test]
    fn positions_survive_within_half_a_step() {
        let rest: Vec<Point3<f32>> =
            (0..7).map(|n| Point3::new(n as f32 * 0.0517, (n * n) as f32 * -0.0031, 0.1)).collect();
        let moved: Vec<Vector3<f32>> =
            (0..5).map(|n| Vector3::new(n as f32 * 2.7, -0.01 * n as f32, -1.3)).collect();
        let encoded = encode(&recorder(rest.clone(), &moved), Point3::new(100.0, -200.0, 3.0));
        assert!((encoded.step_mm - 310.2 / 65_535.0).abs() < 1e-6, "{}", encoded.step_mm);
        assert!((encoded.moved_step_mm - 10.8 / 32_767.0).abs() < 1e-9);
        assert_eq!(encoded.bytes.len(), 8 + 44 + 28 + 32);
        assert_eq!(&encoded.bytes[..8], [0, 0, 1, 0, 2, 0, 0, 0]);
        let found = block(&encoded.bytes, 8, 21);
        let mut largest = 0.0_f64;
        for (n, point) in rest.iter().enumerate() {
            for axis in 0..3 {
                let steps = f64::from(u16::from_le_bytes(found[3 * n + axis]));
                let value = encoded.low_mm[axis] + steps * encoded.step_mm;
                let expected = f64::from(point[axis]) * 1000.0 + [100.0, -200.0, 3.0][axis];
                largest = largest.max((value - expected).abs());
            }
        }
        assert!(largest <= 0.5001 * encoded.step_mm, "{largest} mm");
        assert!(largest > 0.05 * encoded.step_mm, "nothing is rounded: the test sees no error");
        let found = block(&encoded.bytes, 8 + 44 + 28, 15);
        for (n, moved) in moved.iter().enumerate() {
            for axis in 0..3 {
                let value = f64::from(i16::from_le_bytes(found[3 * n + axis])) * encoded.moved_step_mm;
                let error = (value - f64::from(moved[axis])).abs();
                assert!(error <= 0.5001 * encoded.moved_step_mm, "{error} mm");
            }
        }
        assert!((encoded.most_mm - f64::from(moved[4].norm())).abs() < 1e-6);
    }

    /// Surfaces without a size, and values that are not numbers, give finite numbers.
    #[test]
    fn what_has_no_size_or_is_no_number_is_encoded() {
        let odd = [f32::NAN, f32::INFINITY, 0.0].map(|value| Point3::new(value, 0.0, 0.0));
        let moved = [Vector3::new(f32::NAN, 0.0, f32::NEG_INFINITY), Vector3::zeros()];
        for rest in [odd.to_vec(), vec![Point3::origin(); 3], Vec::new()] {
            let encoded = encode(&recorder(rest, &moved), Point3::origin());
            let text = serde_json::to_string(&encoded).unwrap();
            assert!(!text.contains("null"), "{text}");
        }
    }
}
