//! Bones: vertebrae with discs, ribs, breastbone, sacrum, iliac wings and hips.

use super::habitus::Habitus;
use super::layered_solid::{Layer, LayeredSolid, grainy, layer};
use super::profile::smooth_path;
use super::random::Random;
use super::solid::{Blob, Solid};
use super::tube;

/// A dense shell around a spongy core.
const BONE: [Layer; 2] = [grainy(0.0, 720.0, 90.0), grainy(2.0, 240.0, 90.0)];
/// Thin bones consist mostly of the dense shell.
const THIN_BONE: [Layer; 2] = [grainy(0.0, 680.0, 80.0), grainy(2.6, 330.0, 80.0)];
/// Height of the center of the fifth lumbar vertebra in mm.
const LOWEST_MM: f32 = -138.0;
const RIB_PAIRS: usize = 12;

/// Center and height of each vertebra with its disc in mm, from the fifth lumbar vertebra upwards.
fn vertebrae() -> impl Iterator<Item = (f32, f32)> {
    let height = |n: usize| (34.0 - n as f32).max(24.0);
    (0..18).scan(LOWEST_MM, move |z, n| {
        let center = *z;
        *z += 0.5 * (height(n) + height(n + 1));
        Some((center, height(n)))
    })
}

/// All bones in painting order.
pub(super) fn solids(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let mut solids = vec![LayeredSolid::new(ribs(person, random), THIN_BONE), pelvis(person), sacrum(person)];
    let breastbone = [[0.0, 150.0], [0.0, 200.0], [0.0, 290.0]].map(|[x, z]| {
        let y = person.muscle.front_at(x, z) - 9.0;
        [x, y, z, 7.0]
    });
    let [low, middle, high] = breastbone;
    let line = |x: f32| [low, middle, high].map(|[_, y, z, r]| [x, y, z, r]);
    solids.push(LayeredSolid::new(tube(&line(-6.0)).chain(tube(&line(6.0))), THIN_BONE));
    solids.extend(spine(person));
    solids
}

/// The spine: vertebral bodies, arches, processes, discs and the spinal canal.
fn spine(person: &Habitus) -> Vec<LayeredSolid> {
    let (mut bodies, mut arches, mut discs) = (Vec::new(), Vec::new(), Vec::new());
    for (z, height) in vertebrae() {
        let y = person.spine(z);
        let size = (height - 14.0) / 20.0;
        bodies.push(vertebral_body(y, z, [25.0 * size.max(0.7), 17.0, 0.5 * height - 3.0]));
        let gap = z + 0.5 * height;
        discs.push(vertebral_body(person.spine(gap), gap, [23.0 * size.max(0.7), 15.5, 5.0]));
        for side in [-1.0, 1.0] {
            let pedicle = [side * 15.0, y - 13.0, z + 3.0, 5.0];
            let lamina = [side * 13.0, y - 28.0, z, 5.0];
            let spinous = [0.0, y - 36.0, z - 5.0, 4.5];
            arches.extend(tube(&[pedicle, lamina, spinous, [0.0, y - 44.0, z - 9.0, 4.5]]));
            arches.extend(tube(&[lamina, [side * 38.0, y - 27.0, z + 1.0, 3.5]]));
        }
    }
    let canal = (-16..=30).map(|n| {
        let z = 10.0 * n as f32;
        [0.0, person.spine(z) - 23.0, z, 8.0]
    });
    let canal: Vec<_> = canal.collect();
    vec![
        LayeredSolid::new(discs, [layer(0.0, 85.0)]),
        LayeredSolid::new(arches, THIN_BONE),
        LayeredSolid::new(bodies, BONE).wobbly(0.8),
        LayeredSolid::new(tube(&canal), [layer(0.0, -20.0), layer(2.0, 18.0)]),
    ]
}

/// A rounded box at `(0, y, z)`, for the body of a vertebra or a disc.
fn vertebral_body(y: f32, z: f32, radii: [f32; 3]) -> Solid {
    Solid::Blob(Blob::new([0.0, y, z], radii).squared(0.75))
}

/// Twelve pairs of ribs that run down and forward within the chest wall. The lowest two pairs end
/// at the side.
fn ribs(person: &Habitus, random: &mut Random) -> Vec<Solid> {
    let roots: Vec<f32> = vertebrae().skip(5).map(|(z, _)| z).take(RIB_PAIRS).collect();
    let drop = random.between(62.0, 82.0);
    let mut solids = Vec::new();
    for (n, &root) in roots.iter().enumerate() {
        // Length as a share of the way from the spine to the breastbone.
        let reach = [0.42, 0.55, 0.74, 0.84].get(n).copied().unwrap_or(0.92);
        for side in [-1.0, 1.0] {
            let head = [side * 21.0, person.spine(root) - 12.0, root + 4.0, 4.5];
            let pieces = 14;
            let arc = (1..=pieces).map(|piece| {
                let along = 0.09 + (reach - 0.09) * piece as f32 / pieces as f32;
                let z = root - drop * along * along * (3.0 - 2.0 * along);
                let direction = half_circle(along);
                let inner = person.cavity.exit(direction, z);
                let outer = person.muscle.exit(direction, z);
                let middle = |c: usize| 0.55 * inner[c] + 0.45 * outer[c];
                [side * middle(0), middle(1), z, 5.0]
            });
            let path: Vec<_> = std::iter::once(head).chain(arc).collect();
            solids.extend(tube(&path));
        }
    }
    solids
}

/// A point of the half circle from the back (`along` = 0) over the side to the front (1), in
/// rational parametrization.
fn half_circle(along: f32) -> [f32; 2] {
    let t = (2.0 * along - 1.0).clamp(-1.0, 1.0);
    let scale = 1.0 / (1.0 + t * t);
    [(1.0 - t * t) * scale, 2.0 * t * scale]
}

/// Sacrum and coccyx: a wedge that curves backwards.
fn sacrum(person: &Habitus) -> LayeredSolid {
    let middle = [-168.0, -190.0, -212.0, -236.0, -258.0].map(|z| person.spine(z) - 4.0);
    let column = [
        [0.0, middle[0], -168.0, 15.0],
        [0.0, middle[1], -190.0, 13.0],
        [0.0, middle[2], -212.0, 11.0],
        [0.0, middle[3], -236.0, 8.0],
        [0.0, middle[4] + 6.0, -258.0, 5.0],
    ];
    let wings = [-1.0, 1.0].map(|side| {
        Solid::Blob(
            Blob::new([side * 28.0, middle[0] - 6.0, -182.0], [26.0, 13.0, 27.0]).turned(1, side * 0.25),
        )
    });
    LayeredSolid::new(tube(&column).chain(wings), BONE).wobbly(1.5)
}

/// The pelvis: iliac wings built of thin struts from the hip joint to the crest, femoral heads and
/// the pubic arch.
fn pelvis(person: &Habitus) -> LayeredSolid {
    let mut solids = Vec::new();
    for side in [-1.0, 1.0] {
        let at = |x: f32, y: f32, z: f32, r: f32| {
            let [x, y, z] = person.place([side * x, y, z]);
            [x, y, z, r]
        };
        let socket = at(88.0, -8.0, -246.0, 15.0);
        let crest = smooth_path(
            &[
                at(44.0, -72.0, -178.0, 8.0),
                at(72.0, -58.0, -138.0, 6.5),
                at(104.0, -20.0, -122.0, 6.0),
                at(116.0, 22.0, -138.0, 6.0),
                at(108.0, 45.0, -170.0, 6.0),
            ],
            5,
        );
        for &[x, y, z, _] in &crest {
            solids.extend(tube(&[at(88.0, -8.0, -246.0, 9.0), [x, y, z, 4.5]]));
        }
        solids.extend(tube(&crest));
        solids.extend(tube(&[
            at(92.0, -6.0, -262.0, 24.0),
            at(104.0, -8.0, -282.0, 15.0),
            at(108.0, -12.0, -310.0, 16.0),
        ]));
        solids.extend(tube(&[socket, at(52.0, 32.0, -262.0, 9.0), at(8.0, 42.0, -292.0, 9.0)]));
    }
    LayeredSolid::new(solids, BONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_circle_runs_from_back_to_front() {
        assert_eq!(
            [half_circle(0.0), half_circle(0.5), half_circle(1.0)],
            [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0]]
        );
    }

    #[test]
    fn the_spine_has_five_lumbar_vertebrae_below_the_ribs() {
        let centers: Vec<f32> = vertebrae().map(|(z, _)| z).collect();
        assert!(centers.windows(2).all(|pair| pair[1] > pair[0] + 20.0));
        assert!(centers[5] > 0.0 && centers[5] < 40.0, "the lowest rib starts at {}", centers[5]);
        assert!(centers[17] > 300.0);
    }
}
