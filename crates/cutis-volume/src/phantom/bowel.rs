//! Stomach and bowel: walls, contents, and gas at the front above a level surface of fluid.

use super::habitus::Habitus;
use super::layered_solid::{LayeredSolid, grainy, layer};
use super::profile::smooth_path;
use super::random::Random;
use super::solid::{Blob, Solid, norm, subtract};
use super::tube;

const GAS_HU: f32 = -955.0;
/// Distance between neighboring loops of the small bowel in mm.
const LOOP_MM: f32 = 26.0;

/// Stomach, small bowel and colon, in painting order.
pub(super) fn solids(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let mut solids = small_bowel(person, random);
    solids.extend(colon(person, random));
    solids.extend(stomach(person, random));
    solids
}

fn stomach(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let size = random.between(0.9, 1.1);
    let fundus =
        Blob::new(person.place([-62.0, 4.0, 52.0]), [38.0, 46.0, 34.0].map(|r| r * size)).turned(1, 0.2);
    let antrum =
        Blob::new(person.place([-20.0, 52.0, 10.0]), [48.0, 22.0, 22.0].map(|r| r * size)).turned(1, -0.25);
    let blobs = [fundus, antrum];
    let level = fundus.center[1] + random.between(14.0, 30.0);
    vec![
        LayeredSolid::new(blobs.map(Solid::Blob), [layer(0.0, 45.0), grainy(4.5, 22.0, 22.0)])
            .wobbly(3.0)
            .in_cavity(5.0),
        LayeredSolid::new(blobs.map(|blob| Solid::Blob(blob.shrunk(6.0))), [layer(0.0, GAS_HU)])
            .wobbly(3.0)
            .in_cavity(10.0)
            .above(1, level),
    ]
}

/// The colon. It runs up on the right, across at the front, down on the left, and to the rectum.
fn colon(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let points = [
        [88.0, 18.0, -138.0, 24.0],
        [98.0, 2.0, -95.0, 25.0],
        [100.0, -2.0, -55.0, 23.0],
        [84.0, 30.0, -34.0, 21.0],
        [44.0, 56.0, -44.0, 20.0],
        [0.0, 62.0, -52.0, 19.0],
        [-46.0, 58.0, -38.0, 19.0],
        [-86.0, 28.0, -10.0, 19.0],
        [-108.0, -8.0, 4.0, 18.0],
        [-108.0, -16.0, -45.0, 16.0],
        [-106.0, -8.0, -105.0, 15.0],
        [-86.0, 14.0, -158.0, 15.0],
        [-40.0, 24.0, -186.0, 16.0],
        [2.0, -2.0, -192.0, 16.0],
        [6.0, -28.0, -222.0, 18.0],
        [0.0, -36.0, -262.0, 20.0],
        [0.0, -42.0, -310.0, 14.0],
    ];
    let points = points.map(|[x, y, z, r]| {
        let [x, y, z] = person.place(random.near([x, y, z], 6.0));
        [x, y, z, r]
    });
    let mut path = smooth_path(&points, 6);
    // Haustra: every other piece of the wall is constricted.
    for point in path.iter_mut().skip(1).step_by(2) {
        point[3] *= 0.84;
    }
    let wall =
        LayeredSolid::new(tube(&path), [layer(0.0, 42.0), grainy(3.0, 5.0, 75.0)]).wobbly(2.0).in_cavity(3.0);
    let mut solids = vec![wall];
    solids.extend(gas(&path, 4.5, 15, random));
    solids
}

/// The small bowel: tubes through the points of a jittered lattice, each joined to its nearest
/// unused neighbor.
fn small_bowel(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let mut free = Vec::new();
    for k in -4..=4 {
        for j in -2..=2 {
            for i in -3..=3 {
                let offset = [i, j, k].map(|c| LOOP_MM * c as f32);
                let inside = norm([offset[0] / 88.0, offset[1] / 60.0, offset[2] / 84.0]) < 1.0;
                let point = random.near([offset[0], offset[1] + 24.0, offset[2] - 112.0], 8.0);
                if inside {
                    free.push(person.place(point));
                }
            }
        }
    }
    let mut solids = Vec::new();
    let (mut walls, mut pockets) = (Vec::new(), Vec::new());
    for chain in chains(free, 1.7 * LOOP_MM) {
        let radius = random.between(11.5, 14.0);
        let knots: Vec<_> =
            chain.iter().map(|&[x, y, z]| [x, y, z, radius * random.between(0.85, 1.1)]).collect();
        let path = smooth_path(&knots, 5);
        walls.extend(tube(&path));
        pockets.extend(gas(&path, 4.0, 11, random));
    }
    solids.push(
        LayeredSolid::new(walls, [layer(0.0, 48.0), grainy(2.5, 18.0, 30.0)]).wobbly(2.0).in_cavity(4.0),
    );
    solids.extend(pockets);
    solids
}

/// Joins points into chains. Each chain continues with the nearest unused point, and ends if that
/// is farther than `limit_mm`.
fn chains(mut free: Vec<[f32; 3]>, limit_mm: f32) -> Vec<Vec<[f32; 3]>> {
    let mut chains: Vec<Vec<[f32; 3]>> = Vec::new();
    let mut last: Option<[f32; 3]> = None;
    while !free.is_empty() {
        let distance = |p: &[f32; 3]| last.map_or(p[2], |last| norm(subtract(*p, last)));
        let nearest = (1..free.len())
            .fold(0, |best, n| if distance(&free[n]) < distance(&free[best]) { n } else { best });
        let step = distance(&free[nearest]);
        let point = free.swap_remove(nearest);
        match chains.last_mut() {
            Some(chain) if step <= limit_mm => chain.push(point),
            _ => chains.push(vec![point]),
        }
        last = Some(point);
    }
    chains
}

/// Pockets of gas along a tube, `wall_mm` below its surface: about one for every `every` points of
/// the path.
fn gas(path: &[[f32; 4]], wall_mm: f32, every: usize, random: &mut Random) -> Vec<LayeredSolid> {
    let mut solids = Vec::new();
    let mut start = random.between(0.0, every as f32) as usize;
    while start + 2 < path.len() {
        let length = 2 + random.between(0.0, 4.0) as usize;
        let pocket: Vec<_> = path[start..(start + length).min(path.len())]
            .iter()
            .map(|&[x, y, z, r]| [x, y, z, (r - wall_mm).max(2.0)])
            .collect();
        let level = pocket[0][1] + pocket[0][3] * random.between(-0.7, 0.4);
        solids.push(
            LayeredSolid::new(tube(&pocket), [layer(0.0, GAS_HU)]).wobbly(2.0).in_cavity(8.0).above(1, level),
        );
        start += length + every / 2 + random.between(0.0, every as f32) as usize;
    }
    solids
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_use_every_point_once_and_end_at_wide_gaps() {
        let points =
            vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [50.0, 0.0, 0.0], [51.0, 0.0, 0.0]];
        let chains = chains(points, 5.0);
        assert_eq!(chains.iter().map(Vec::len).collect::<Vec<_>>(), [3, 2]);
        assert_eq!(chains[0], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
    }
}
