//! Tests of skin detection: an identity of the literal rule on random volumes, and surfaces of
//! known topology.

use std::collections::BTreeSet;

use cutis_mesh::{
    HalfSpace, MeshError, Skin, SkinMode, SkinOptions, Split, Tissue, TissueMask, Topology, skin,
};
use proptest::prelude::*;

use crate::oracle::{
    air, all_tets, directed_edges, lattice, mesh, random_body, set, skin_on_mesh, sorted, tets_of_faces,
};

fn detect(lattice: &cutis_mesh::Lattice, air: &[bool], mode: SkinMode) -> Skin {
    skin::detect(lattice, air, mode, &SkinOptions::default()).unwrap()
}

fn distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum::<f64>().sqrt()
}

proptest! {
    /// The literal rule gives the boundary of the tets with four tissue corners, without faces on
    /// the box, plus stray sheets.
    #[test]
    fn literal_rule_gives_boundary_plus_stray_sheets((lattice, air) in random_body()) {
        let tets = all_tets(&lattice);
        let is_tissue = |tet: &[usize; 4]| tet.iter().all(|&p| !air[p]);
        let (mut boundary, mut sheets, mut twice) = (BTreeSet::new(), BTreeSet::new(), 0);
        for (face, owners) in tets_of_faces(&tets) {
            let all_tissue = face.iter().all(|&p| !air[p]);
            let whole = owners.iter().filter(|(t, _)| is_tissue(&tets[*t])).count();
            if all_tissue && owners.len() == 2 && whole == 1 {
                boundary.insert(face);
            }
            if all_tissue && whole == 0 {
                sheets.insert(face);
                twice += owners.len() - 1;
            }
        }
        let paper = detect(&lattice, &air, SkinMode::Paper);
        let found = detect(&lattice, &air, SkinMode::Boundary);
        prop_assert_eq!(set(&found.triangles), boundary.clone());
        prop_assert_eq!(found.triangles.len(), boundary.len());
        prop_assert!(boundary.is_disjoint(&sheets));
        prop_assert_eq!(set(&paper.triangles), &boundary | &sheets);
        prop_assert_eq!(paper.triangles.len(), boundary.len() + sheets.len());
        prop_assert_eq!(paper.report.duplicates, twice);
        // The histogram, counted tet by tet.
        let mut histogram = [0; 5];
        tets.iter().for_each(|tet| histogram[tet.iter().filter(|&&p| air[p]).count()] += 1);
        prop_assert_eq!(paper.report.air_vertex_histogram, histogram);
        // Without sheets every open edge is on the box.
        prop_assert_eq!(found.report.open_edges, found.report.open_edges_on_box);
        // The exterior is a subset of the boundary, and the enclosed share is the share of the
        // rest.
        let exterior = detect(&lattice, &air, SkinMode::Exterior);
        prop_assert!(set(&exterior.triangles).is_subset(&boundary));
        let share = 1.0 - exterior.triangles.len() as f64 / boundary.len().max(1) as f64;
        prop_assert!(boundary.is_empty() || (exterior.report.enclosed_share - share).abs() < 1e-12);
        prop_assert!((0.0..=1.0).contains(&exterior.report.coverage));
    }

    /// The normal of each triangle points to an air corner of one of its tets.
    #[test]
    fn triangles_face_the_air((lattice, air) in random_body()) {
        let faces = tets_of_faces(&all_tets(&lattice));
        for mode in [SkinMode::Paper, SkinMode::Boundary, SkinMode::Exterior] {
            for triangle in detect(&lattice, &air, mode).triangles {
                let at = |point: usize| lattice.grid().mm(lattice.grid().point(point));
                let [a, b, c] = triangle.map(|p| at(p as usize));
                let normal = (b - a).cross(&(c - a));
                let owners = &faces[&sorted(triangle.map(|p| p as usize))];
                let towards_air = owners.iter().any(|&(_, opposite)| air[opposite] && (at(opposite) - a).dot(&normal) > 0.0);
                prop_assert!(towards_air);
            }
        }
    }
}

#[test]
fn sphere_has_a_closed_exterior() {
    for (split, step) in [(Split::Kuhn6, 2.0), (Split::Five, 2.0), (Split::Kuhn6, -2.0)] {
        let lattice = lattice([21, 21, 21], [step, 2.0, 2.0], split);
        let middle: [f64; 3] = lattice.grid().mm([10, 10, 10]).into();
        let air = air(&lattice, |p| distance(p, middle) <= 15.0);
        let skin = detect(&lattice, &air, SkinMode::Exterior);
        let report = &skin.report;
        assert_eq!(
            (report.open_edges, report.non_manifold_edges, report.components),
            (0, 0, 1),
            "{report:?}"
        );
        assert_eq!((report.euler_characteristic, report.bodies), (2, 1));
        assert_eq!((report.enclosed_share, report.coverage), (0.0, 1.0));
        // The surface is oriented: each edge occurs once in each direction.
        let edges = directed_edges(&skin.triangles);
        assert!(edges.iter().all(|(&[a, b], &count)| count == 1 && edges[&[b, a]] == 1));
        // The orientation is outward: the enclosed volume is positive.
        let (on_mesh, dropped) = skin_on_mesh(&mesh(&lattice, &air), &skin);
        assert_eq!((on_mesh.len(), dropped), (skin.triangles.len(), 0));
        let at = |p: u32| lattice.grid().mm(lattice.grid().point(p as usize)).coords;
        let volume: f64 = skin.triangles.iter().map(|&[a, b, c]| at(a).dot(&at(b).cross(&at(c))) / 6.0).sum();
        let ball = 4.0 / 3.0 * std::f64::consts::PI * 15f64.powi(3);
        assert!(volume > 0.75 * ball && volume < ball, "{volume} of {ball}");
    }
}

#[test]
fn sphere_within_a_sphere_gives_one_component() {
    let lattice = lattice([41, 41, 41], [1.0; 3], Split::Kuhn6);
    let middle: [f64; 3] = lattice.grid().mm([20, 20, 20]).into();
    // A thick shell around a small ball, then a thin shell around a large ball. The body is the
    // shell or the ball. The skin is one sphere in both cases.
    for (outer, hollow, inner, shell_is_body) in [(18.2, 12.3, 6.2, true), (18.2, 15.7, 13.4, false)] {
        let air = air(&lattice, |p| {
            let r = distance(p, middle);
            r <= inner || (hollow..=outer).contains(&r)
        });
        let skin = detect(&lattice, &air, SkinMode::Exterior);
        assert_eq!(
            (skin.report.components, skin.report.euler_characteristic, skin.report.open_edges),
            (1, 2, 0)
        );
        assert!(skin.report.bodies >= 2);
        let reaches_out =
            |&p: &u32| distance(lattice.grid().mm(lattice.grid().point(p as usize)).into(), middle) > hollow;
        assert_eq!(skin.triangles.iter().flatten().all(reaches_out), shell_is_body);
        let boundary = detect(&lattice, &air, SkinMode::Boundary).report;
        assert_eq!(boundary.enclosed_share, skin.report.enclosed_share);
        assert!(boundary.components >= 2 && boundary.enclosed_share > 0.2);
    }
}

/// A chest on a table: a box of tissue through all slices, with a lung that is open at both ends.
fn chest(p: [f64; 3]) -> bool {
    let body = (8.0..=32.0).contains(&p[0]) && (10.0..=30.0).contains(&p[1]);
    let lung = (14.0..=26.0).contains(&p[0]) && (15.0..=25.0).contains(&p[1]);
    let table = (4.0..=6.0).contains(&p[1]);
    (body && !lung) || table
}

fn chest_lattice() -> cutis_mesh::Lattice {
    let affine = cutis_volume::Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap();
    cutis_mesh::Lattice::new(cutis_volume::Grid { shape: [41, 41, 12], affine }, Split::Kuhn6).unwrap()
}

#[test]
fn outside_air_does_not_enter_through_the_end_slices() {
    let lattice = chest_lattice();
    let air = air(&lattice, chest);
    let skin = detect(&lattice, &air, SkinMode::Exterior);
    let on_wall = |&point: &u32| {
        let [x, y, _]: [f64; 3] = lattice.grid().mm(lattice.grid().point(point as usize)).into();
        x == 8.0 || x == 32.0 || y == 10.0 || y == 30.0
    };
    assert!(skin.triangles.iter().flatten().all(on_wall));
    // Four walls that are 11 cells high, with two triangles per cell. The table is another
    // component.
    assert_eq!(skin.triangles.len(), 2 * 11 * (24 + 20 + 24 + 20));
    assert_eq!((skin.report.bodies, skin.report.coverage), (2, 1.0));
    assert_eq!(skin.report.open_edges, skin.report.open_edges_on_box);
    // Control: with another through axis, the end slices count as outside, and the lung becomes
    // outside air.
    let options = SkinOptions { through_axis: Some(0), ..SkinOptions::default() };
    let flooded = skin::detect(&lattice, &air, SkinMode::Exterior, &options).unwrap();
    assert!(flooded.triangles.len() > skin.triangles.len());
    let invalid = SkinOptions { through_axis: Some(3), ..SkinOptions::default() };
    assert!(matches!(
        skin::detect(&lattice, &air, SkinMode::Paper, &invalid),
        Err(MeshError::Axis { axis: 3 })
    ));
}

#[test]
fn a_cut_plane_separates_the_body_from_a_board_under_it() {
    let lattice = chest_lattice();
    let body = |p: [f64; 3]| (8.0..=32.0).contains(&p[0]) && (10.0..=30.0).contains(&p[1]);
    let air = air(&lattice, |p| body(p) || (4.0..=10.0).contains(&p[1]));
    let walls = 2 * 11 * (24 + 19 + 24 + 19);
    assert_ne!(detect(&lattice, &air, SkinMode::Exterior).triangles.len(), walls);
    let below = HalfSpace { point_mm: [0.0, 10.5, 0.0], normal: [0.0, -1.0, 0.0] };
    let options = SkinOptions { cut_away: vec![below], ..SkinOptions::default() };
    let separated = skin::detect(&lattice, &air, SkinMode::Exterior, &options).unwrap();
    assert_eq!(separated.triangles.len(), walls);
}

#[test]
fn skin_found_with_the_body_equals_skin_found_alone() {
    let lattice = chest_lattice();
    // A chest, a table, and a sheet that is one vertex thick.
    let air = air(&lattice, |p| chest(p) || p[1] == 36.0);
    let end = HalfSpace { point_mm: [28.0, 0.0, 0.0], normal: [2.0, 0.0, 0.0] };
    let front = HalfSpace { point_mm: [0.0, 27.0, 9.0], normal: [0.0, 1.0, 0.5] };
    let mut seen = Vec::new();
    for cut_away in [vec![], vec![end], vec![end, front]] {
        for through_axis in [None, Some(0)] {
            for mode in [SkinMode::Paper, SkinMode::Boundary, SkinMode::Exterior] {
                let options = SkinOptions { cut_away: cut_away.clone(), through_axis };
                let alone = skin::detect(&lattice, &air, mode, &options).unwrap();
                for largest_component in [true, false] {
                    let tissue = Tissue { air: &air, cut_away: &cut_away, largest_component };
                    let (body, skin) =
                        TissueMask::find_with_skin(&lattice, &tissue, mode, through_axis).unwrap();
                    assert_eq!(skin.triangles, alone.triangles);
                    assert_eq!(skin.report, alone.report);
                    let found = TissueMask::find(&lattice, &tissue).unwrap();
                    assert_eq!(body.vertices(), found.vertices());
                    let figures = |mask: &TissueMask| (mask.components(), mask.dropped_tets());
                    assert_eq!(figures(&body), figures(&found));
                }
                seen.push(alone);
            }
        }
    }
    // Control: the mode, the axis and the half-spaces change the skin.
    let differ = |a: usize, b: usize| set(&seen[a].triangles) != set(&seen[b].triangles);
    assert!(differ(0, 1) && differ(1, 2) && differ(2, 5) && differ(2, 8) && differ(8, 14));
    let tissue = Tissue { air: &air, cut_away: &[], largest_component: true };
    let invalid = TissueMask::find_with_skin(&lattice, &tissue, SkinMode::Paper, Some(3));
    assert!(matches!(invalid, Err(MeshError::Axis { axis: 3 })));
    let nothing = Tissue { air: &vec![true; air.len()], ..tissue };
    let empty = TissueMask::find_with_skin(&lattice, &nothing, SkinMode::Paper, None);
    assert!(matches!(empty, Err(MeshError::NoTissue { .. })));
}

#[test]
fn topology_counts_open_and_shared_edges() {
    let fan = Topology::of(&[[0, 1, 2], [0, 3, 1], [0, 1, 4], [7, 8, 9]]);
    assert_eq!((fan.vertices, fan.components, fan.non_manifold_edges), (8, 2, 1));
    assert_eq!((fan.open_edges.len(), fan.euler_characteristic), (9, 8 - 10 + 4));
    let tetrahedron = Topology::of(&[[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
    assert_eq!(
        (tetrahedron.open_edges.len(), tetrahedron.euler_characteristic, tetrahedron.components),
        (0, 2, 1)
    );
    assert_eq!(Topology::of(&[]), Topology::default());
}

#[test]
fn air_only_and_tissue_only_have_no_skin() {
    let lattice = lattice([5, 5, 5], [1.0; 3], Split::Kuhn6);
    for value in [false, true] {
        for mode in [SkinMode::Paper, SkinMode::Boundary, SkinMode::Exterior] {
            let skin = detect(&lattice, &[value; 125], mode);
            assert!(skin.triangles.is_empty());
            assert_eq!((skin.report.enclosed_share, skin.report.coverage), (0.0, 1.0));
        }
    }
    let short = skin::detect(&lattice, &[true; 124], SkinMode::Paper, &SkinOptions::default());
    assert!(matches!(short, Err(MeshError::Length { array: "air", expected: 125, found: 124 })));
}
