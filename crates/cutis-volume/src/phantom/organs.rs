//! Solid organs, muscles and vessels of the abdomen: liver, spleen, kidneys, pancreas, bladder,
//! psoas muscles, aorta and vena cava.

use super::habitus::Habitus;
use super::layered_solid::{LayeredSolid, grainy, layer};
use super::random::Random;
use super::solid::{Blob, Solid};
use super::tube;

/// Thickness of the fat around a kidney in mm.
const CAPSULE_MM: f32 = 6.0;

/// The organs in painting order. The fat around the kidneys is painted over the organs before it.
pub(super) fn solids(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let mut solids = upper_organs(person, random);
    solids.extend([-1.0, 1.0].into_iter().flat_map(|side| kidney(person, side, random)));
    solids
}

/// Muscles and vessels next to the spine. They are painted after the bowel, so that they keep their
/// shape.
pub(super) fn rear_solids(person: &Habitus) -> Vec<LayeredSolid> {
    vec![psoas(person), vessels(person)]
}

/// Liver with gallbladder, spleen, pancreas and bladder.
fn upper_organs(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let size = random.between(0.93, 1.06);
    let shift = random.between(-8.0, 8.0);
    let blob = |center: [f32; 3], radii: [f32; 3]| {
        Blob::new(person.place([center[0], center[1], center[2] + shift]), radii.map(|r| r * size))
    };
    let right_lobe = blob([74.0, 4.0, 44.0], [76.0, 82.0, 57.0]).squared(0.3).turned(1, 0.16);
    let left_lobe = blob([8.0, 48.0, 58.0], [74.0, 36.0, 32.0]).turned(1, 0.2);
    let spleen = blob([-106.0, -44.0, 42.0], [25.0, 44.0, 52.0]).turned(2, 0.2).turned(0, 0.15);
    let gallbladder = blob([52.0, 50.0, 0.0], [14.0, 17.0, 27.0]).turned(0, 0.2);
    let pancreas = [
        [34.0, 18.0, -14.0, 13.0],
        [8.0, 24.0, -2.0, 10.0],
        [-30.0, 14.0, 12.0, 9.5],
        [-66.0, -14.0, 24.0, 8.0],
    ];
    let pancreas = pancreas.map(|[x, y, z, r]| {
        let [x, y, z] = person.place([x, y, z]);
        [x, y, z, r]
    });
    let bladder = Blob::new(person.place([0.0, 22.0, -236.0]), [42.0, 30.0, 28.0]);
    vec![
        LayeredSolid::new([Solid::Blob(right_lobe), Solid::Blob(left_lobe)], [grainy(0.0, 60.0, 9.0)])
            .wobbly(3.0)
            .in_cavity(3.0),
        LayeredSolid::new(liver_vessels(person, shift), [layer(0.0, 42.0)]).wobbly(1.0),
        LayeredSolid::new([Solid::Blob(gallbladder)], [layer(0.0, 35.0), layer(2.5, 8.0)])
            .wobbly(1.5)
            .in_cavity(4.0),
        LayeredSolid::new([Solid::Blob(spleen)], [grainy(0.0, 50.0, 7.0)]).wobbly(3.0).in_cavity(3.0),
        LayeredSolid::new(tube(&pancreas), [grainy(0.0, 38.0, 20.0)]).wobbly(3.0).in_cavity(3.0),
        LayeredSolid::new([Solid::Blob(bladder)], [layer(0.0, 38.0), layer(4.0, 6.0)])
            .wobbly(2.0)
            .in_cavity(2.0),
    ]
}

/// The hepatic veins, and the portal vein with its two branches.
fn liver_vessels(person: &Habitus, shift: f32) -> Vec<Solid> {
    let at = |x: f32, y: f32, z: f32, r: f32| {
        let [x, y, z] = person.place([x, y, z + shift]);
        [x, y, z, r]
    };
    let (cava, porta) = (at(20.0, -6.0, 82.0, 5.0), at(36.0, 12.0, 28.0, 6.0));
    let branches = [
        vec![cava, at(60.0, -8.0, 66.0, 4.5), at(104.0, -14.0, 44.0, 2.5)],
        vec![cava, at(54.0, 24.0, 66.0, 4.0), at(82.0, 52.0, 46.0, 2.5)],
        vec![cava, at(8.0, 30.0, 74.0, 3.5), at(-20.0, 54.0, 66.0, 2.0)],
        vec![porta, at(66.0, 6.0, 26.0, 5.0), at(92.0, 20.0, 16.0, 3.0), at(112.0, 26.0, 0.0, 2.0)],
        vec![at(66.0, 6.0, 26.0, 5.0), at(88.0, -24.0, 18.0, 3.0), at(106.0, -44.0, 12.0, 2.0)],
        vec![porta, at(18.0, 32.0, 44.0, 4.5), at(-8.0, 52.0, 52.0, 2.5)],
    ];
    branches.iter().flat_map(|branch| tube(branch)).collect()
}

/// A kidney with the fat of its sinus. The right kidney (`side` 1) lies lower.
fn kidney(person: &Habitus, side: f32, random: &mut Random) -> Vec<LayeredSolid> {
    let z = -22.0 - 9.0 * side + random.between(-7.0, 7.0);
    let size = random.between(0.94, 1.08);
    let at = |x: f32, y: f32| person.place([side * x, y, z]);
    let body = Blob::new(at(66.0, -32.0), [27.0, 23.0, 53.0].map(|r| r * size + CAPSULE_MM))
        .turned(1, -side * 0.1)
        .turned(2, side * 0.2);
    let sinus = Blob::new(at(55.0, -26.0), [15.0, 9.0, 26.0]);
    vec![
        LayeredSolid::new([Solid::Blob(body)], [grainy(0.0, -100.0, 10.0), grainy(CAPSULE_MM, 36.0, 6.0)])
            .wobbly(2.0)
            .in_cavity(0.0),
        LayeredSolid::new([Solid::Blob(sinus)], [grainy(0.0, -70.0, 50.0)]).wobbly(4.0),
    ]
}

/// The psoas muscles, from the lumbar spine to the groin.
fn psoas(person: &Habitus) -> LayeredSolid {
    let sides = [-1.0, 1.0].map(|side| {
        tube(&[
            [side * 26.0, person.spine(10.0) - 2.0, 10.0, 8.0],
            [side * 36.0, person.spine(-50.0) + 1.0, -50.0, 15.0],
            [side * 44.0, person.spine(-110.0) + 6.0, -110.0, 21.0],
            [side * 60.0, -8.0, -180.0, 20.0],
            [side * 82.0, 26.0, -250.0, 17.0],
            [side * 96.0, 20.0, -310.0, 15.0],
        ])
    });
    LayeredSolid::new(sides.into_iter().flatten(), [grainy(0.0, 54.0, 12.0)]).wobbly(2.0)
}

/// Abdominal aorta and vena cava with their iliac branches.
fn vessels(person: &Habitus) -> LayeredSolid {
    let before_spine = |x: f32, gap: f32, z: f32, r: f32| [x, person.spine(z) + gap, z, r];
    let mut solids = Vec::new();
    for (side, radius, top) in [(-1.0, 10.0, 80.0), (1.0, 12.0, 95.0)] {
        let x = side * 14.0;
        let fork = before_spine(0.5 * x, 27.0, -104.0, radius);
        solids.extend(tube(&[
            before_spine(x, 26.0, top, radius + 1.0),
            before_spine(x, 27.0, 0.0, radius),
            fork,
        ]));
        for limb in [-1.0, 1.0] {
            let [_, y, z, _] = before_spine(0.0, 34.0, -160.0, 0.0);
            let branch_radius = 0.62 * radius;
            solids.extend(tube(&[
                fork,
                [limb * 38.0, y, z, branch_radius],
                [limb * 84.0, 40.0, -260.0, branch_radius],
                [limb * 92.0, 44.0, -310.0, branch_radius],
            ]));
        }
    }
    LayeredSolid::new(solids, [layer(0.0, 43.0)])
}
