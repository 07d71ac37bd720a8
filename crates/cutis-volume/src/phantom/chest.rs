//! The chest: lungs with vessels, the domes of the diaphragm, heart, great vessels and airways.

use super::habitus::Habitus;
use super::layered_solid::{LayeredSolid, grainy, layer};
use super::random::Random;
use super::solid::{Blob, Solid, norm, subtract};
use super::tube;

/// Number of generations of a pulmonary vessel tree.
const GENERATIONS: usize = 6;

/// All solids of the chest in painting order. The lungs come first, so that diaphragm and heart are
/// painted over them.
pub(super) fn solids(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let lungs = [-1.0, 1.0].map(|side| {
        let center = person.place([side * 74.0, -4.0, 152.0]);
        Solid::Blob(Blob::new(center, [70.0, 100.0, 145.0]).squared(0.6))
    });
    let vessels: Vec<Solid> =
        [-1.0, 1.0].into_iter().flat_map(|side| vessel_tree(person, side, random)).collect();
    let mut solids = vec![
        LayeredSolid::new(lungs, [layer(0.0, 10.0), grainy(1.0, -845.0, 35.0)]).wobbly(2.0).in_cavity(1.0),
        LayeredSolid::new(vessels, [layer(0.0, 35.0)]).in_cavity(5.0),
    ];
    solids.extend(domes(person, random));
    solids.extend(mediastinum(person, random));
    solids
}

/// The vessel tree of one lung. It branches from the root towards the surface.
fn vessel_tree(person: &Habitus, side: f32, random: &mut Random) -> Vec<Solid> {
    let [x, y, z] = person.place([side * 26.0, -8.0, 166.0]);
    let middle = person.place([side * 78.0, -8.0, 150.0]);
    let mut solids = Vec::new();
    let mut tips: Vec<([f32; 4], [f32; 3])> =
        (0..12).map(|_| ([x, y, z, 4.5], random.near([side * 0.9, 0.0, 0.0], 1.2))).collect();
    for generation in 0..GENERATIONS {
        let length = 25.0 - 2.5 * generation as f32;
        let mut next = Vec::new();
        for ([x, y, z, r], heading) in tips {
            let reach = length / norm(heading).max(0.2) * random.between(0.75, 1.2);
            let end = [x + reach * heading[0], y + reach * heading[1], z + reach * heading[2]];
            let tip = [end[0], end[1], end[2], 0.78 * r];
            solids.extend(tube(&[[x, y, z, r], tip]));
            // Continue in a random direction, slightly away from the middle of the lung.
            let outward = subtract(end, middle).map(|c| 0.006 * c);
            let straight = heading.map(|c| c / norm(heading).max(0.2));
            for _ in 0..2 {
                let bent = random.near([0, 1, 2].map(|c| straight[c] + outward[c]), 0.85);
                next.push((tip, bent));
            }
        }
        tips = next;
    }
    solids
}

/// The domes of the diaphragm: a thin muscle over fat. The liver later fills the right dome.
fn domes(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    [(-1.0, 80.0), (1.0, 96.0)]
        .map(|(side, top)| {
            let top: f32 = top + random.between(-8.0, 8.0);
            let center = person.place([side * 72.0, -2.0, 0.0]);
            let dome = Blob::new(center, [82.0, 98.0, top]).squared(0.3);
            LayeredSolid::new([Solid::Blob(dome)], [layer(0.0, 48.0), grainy(3.0, -98.0, 14.0)])
                .wobbly(1.5)
                .in_cavity(0.0)
                .above(2, 0.0)
        })
        .into()
}

/// The mediastinum, between the lungs: fat, heart, aorta, esophagus and windpipe.
fn mediastinum(person: &Habitus, random: &mut Random) -> Vec<LayeredSolid> {
    let size = random.between(0.94, 1.06);
    let at = |x: f32, y: f32, z: f32, r: f32| {
        let [x, y, z] = person.place([x, y, z]);
        [x, y, z, r]
    };
    let near_spine = |x: f32, gap: f32, z: f32, r: f32| [x, person.spine(z) + gap, z, r];
    let fat = Blob::new(person.place([0.0, 5.0, 215.0]), [30.0, 84.0, 170.0]);
    let sac = Blob::new(person.place([-20.0, 26.0, 122.0]), [60.0, 47.0, 52.0].map(|r| r * size))
        .turned(1, -0.2)
        .turned(2, 0.18);
    let arch = [
        at(6.0, 26.0, 160.0, 14.0),
        at(12.0, 30.0, 195.0, 14.0),
        at(4.0, 14.0, 220.0, 13.0),
        at(-10.0, -10.0, 222.0, 12.0),
        near_spine(-18.0, 22.0, 200.0, 11.5),
        near_spine(-17.0, 25.0, 140.0, 11.0),
        near_spine(-14.0, 26.0, 78.0, 11.0),
    ];
    let trunk = [at(-14.0, 32.0, 158.0, 13.0), at(-10.0, 10.0, 184.0, 12.0)];
    let limbs = [-1.0, 1.0].map(|side| tube(&[trunk[1], at(side * 26.0, -8.0, 168.0, 8.0)]));
    let upper_cava = [at(24.0, 14.0, 150.0, 9.0), at(24.0, 12.0, 290.0, 8.0)];
    let gullet =
        [near_spine(-2.0, 28.0, 300.0, 7.0), near_spine(-6.0, 30.0, 160.0, 7.0), at(-20.0, 0.0, 72.0, 8.0)];
    let fork = at(2.0, -8.0, 192.0, 8.5);
    let airways = tube(&[at(0.0, -2.0, 310.0, 9.0), fork])
        .chain(tube(&[fork, at(30.0, -12.0, 170.0, 6.5), at(48.0, -14.0, 150.0, 4.5)]))
        .chain(tube(&[fork, at(-32.0, -12.0, 166.0, 6.0), at(-50.0, -14.0, 148.0, 4.5)]));
    vec![
        LayeredSolid::new([Solid::Blob(fat)], [grainy(0.0, -80.0, 30.0)]).wobbly(5.0).in_cavity(0.0),
        LayeredSolid::new([Solid::Blob(sac)], [grainy(0.0, -75.0, 30.0), grainy(3.5, 44.0, 8.0)])
            .wobbly(3.0)
            .in_cavity(2.0),
        LayeredSolid::new(
            tube(&arch).chain(tube(&trunk)).chain(limbs.into_iter().flatten()).chain(tube(&upper_cava)),
            [layer(0.0, 43.0)],
        ),
        LayeredSolid::new(tube(&gullet), [grainy(0.0, 35.0, 10.0)]).wobbly(1.0),
        LayeredSolid::new(airways, [layer(0.0, 25.0), layer(1.6, -990.0)]),
    ]
}
