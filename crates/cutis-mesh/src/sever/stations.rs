//! Stations of a blade along the segments of a path.

use nalgebra::Vector3;

use super::blade::Station;
use crate::Slit;

/// Largest number of stations of a segment of a blade.
const MOST_STATIONS: f64 = 1024.0;

/// Stations through the skin along segments, at most `step` apart. The last station of a closed
/// path is the first one again. None if a direction is not defined.
pub(crate) fn stations(slits: &[&Slit], step: f64, closed: bool) -> Option<Vec<Station>> {
    let mut stations: Vec<Station> = Vec::new();
    for (number, slit) in slits.iter().enumerate() {
        let count = (slit.length() / step).ceil().clamp(1.0, MOST_STATIONS) as usize;
        let station = |n: usize| {
            let part = n as f64 / count as f64;
            Some(Station {
                skin: slit.skin_at(slit.length() * part),
                inward: inward_at(slits, number, part, closed)?,
            })
        };
        let mut own = (0..=count).map(station);
        // Where two segments meet, the blade passes between their ends.
        if let Some(last) = stations.last_mut() {
            last.skin = nalgebra::center(&last.skin, &own.next()??.skin);
        }
        for station in own {
            stations.push(station?);
        }
    }
    if closed && let [first, .., last] = &mut stations[..] {
        first.skin = nalgebra::center(&first.skin, &last.skin);
        *last = *first;
    }
    Some(stations)
}

/// Inward direction of a blade at a part of a segment, from 0 to 1. It is that of the segment in
/// its middle and turns evenly from there to the middle of the next one. If it turned at once where
/// two segments meet, the blade would fold over below the skin or above it.
fn inward_at(slits: &[&Slit], number: usize, part: f64, closed: bool) -> Option<Vector3<f64>> {
    let count = slits.len();
    let other = match part < 0.5 {
        true if closed => Some((number + count - 1) % count),
        true => number.checked_sub(1),
        false if closed => Some((number + 1) % count),
        false => Some(number + 1),
    };
    let own = slits[number];
    let Some(other) = other.and_then(|other| slits.get(other)) else { return Some(own.inward()) };
    let from_middle = (part - 0.5).abs() * own.length();
    let share = from_middle / (0.5 * (own.length() + other.length()));
    (own.inward() * (1.0 - share) + other.inward() * share).try_normalize(0.0)
}
