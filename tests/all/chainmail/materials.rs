//! Link limits by axis and by HU.

use cutis::mesh::{Lattice, Split};
use cutis::volume::phantom::Phantom;
use cutis::volume::sample::{LatticeSize, lattice_grid};

use super::*;

/// Soft links absorb a drag by one step along their axis. Rigid rows move as a whole.
#[test]
fn links_give_way_along_their_own_axis() {
    for soft in 0..3 {
        let of = |soft_one: f64, others: f64| {
            let mut each = [others; 3];
            each[soft] = soft_one;
            format!("{each:?}")
        };
        let list = format!(
            "[{{ from_hu = -1024, shortest = {}, longest = {}, shear = 4 }}]",
            of(0.0, 1.0),
            of(2.5, 1.0)
        );
        for drag in 0..3 {
            let mut by = [0.0; 3];
            by[drag] = -0.9 * STEPS_MM[drag];
            let handle = format!("[{{ at_mm = [-41.8, 89.5, 0], radius_mm = 5, move_mm = {by:?} }}]");
            let set =
                [("handle", handle.as_str()), ("chainmail.materials", &list), UNRELAXED, ("fixed", "{}")];
            let ended = Ended::of(&chain(&set));
            let held = ended.twin.held[0].len();
            assert!(held > 0 && ended.chainmail().violated_links == 0);
            if drag == soft {
                assert_eq!(ended.moved(), held, "soft along {soft}");
            } else {
                assert!(ended.moved() > held, "soft along {soft}, dragged along {drag}");
                assert!(ended.by.iter().all(|by| *by == Vector3::zeros() || by[drag] != 0.0));
            }
        }
    }
}

/// HU at the vertices, sampled by the lattice.
fn hu(twin: &Twin) -> Vec<f32> {
    let volume = Phantom::new([64, 64, 48], 1).unwrap().volume().unwrap();
    let grid = lattice_grid(volume.grid(), LatticeSize::SpacingMm(12.0)).unwrap();
    assert_eq!(grid.shape, POINTS);
    let hu = Lattice::new(grid, Split::Kuhn6).unwrap().sample(&volume).unwrap();
    let at = |place: &Point3<f32>| {
        let middle = |axis: usize| (POINTS[axis] - 1) as f64 / 2.0;
        let index =
            |axis: usize| (f64::from(place[axis]) * 1000.0 / STEPS_MM[axis] + middle(axis)).round() as usize;
        hu[index(0) + POINTS[0] * (index(1) + POINTS[1] * index(2))]
    };
    twin.rest.iter().map(at).collect()
}

#[test]
fn materials_begin_at_their_hu() {
    let list = |from: f32| {
        format!(
            "[{{ from_hu = -449, shortest = 0.8, longest = 1.2, shear = 0.2 }},
              {{ from_hu = {from:?}, shortest = 1, longest = 1, shear = 0 }}]"
        )
    };
    let handle =
        ("handle", "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [10, 30, 5], over_s = 0.5 }]");
    for from in [-30.0_f32, 40.0] {
        let ended =
            Ended::of(&chain(&[handle, ("chainmail.materials", &list(from)), UNRELAXED, ("fixed", "{}")]));
        assert_eq!(ended.chainmail().violated_links, 0);
        let hu = hu(&ended.twin);
        // Largest strain of a link in half rest lengths, by the number of its rigid ends.
        let mut most = [0.0_f64; 3];
        for (&([a, b], axis), (_, strain)) in ended.twin.links.iter().zip(ended.strains()) {
            let rigid = [a, b].into_iter().filter(|&v| hu[v] >= from).count();
            most[rigid] = most[rigid].max(strain.amax() / STEPS_MM[axis] * 2.0);
        }
        assert!(most[2] < 1e-3, "rigid from {from}: {most:?}");
        assert!(
            (0.15..0.201).contains(&most[1]) && (0.35..0.401).contains(&most[0]),
            "rigid from {from}: {most:?}"
        );
    }
}

/// Relaxation keeps the dragged shape with a large `k_steps`, and changes it with a small one.
#[test]
fn k_steps_keeps_small_deviations() {
    let chainmail = |k: &str| {
        let list =
            format!("[{{ from_hu = -1024, shortest = 0.7, longest = 1.3, shear = 0.4, k_steps = {k} }}]");
        Run::of(&chain(&[HANDLE, ("chainmail.materials", &list)])).report.chainmail.unwrap()
    };
    let (plastic, elastic) = (chainmail("2"), chainmail("0"));
    assert_eq!((plastic.relax_moves, plastic.energy_before), (0, plastic.energy_after));
    assert!(elastic.relax_moves > 100 && elastic.energy_after < plastic.energy_after);
}
