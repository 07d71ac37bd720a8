//! Tests of incisions: the removed elements, the separation of the lips, and the gape.

use std::collections::BTreeSet;

use cutis_mesh::sever::Embedded;
use cutis_mesh::{
    Cut, Incision, Lattice, MeshError, SkinMode, SkinOptions, Slit, Split, TetMesh, WoundGape, skin,
};
use nalgebra::{Point3, Vector3};

use crate::oracle::{air, lattice, mesh, plan, skin_on_mesh};

/// A block of 60 × 40 × 20 mm whose upper face is the skin at z = 20.
fn block(step: f64, split: Split) -> (TetMesh, Vec<[u32; 3]>) {
    let count = |mm: f64| (mm / step).round() as usize + 5;
    let affine = cutis_volume::Affine::from_spacing([step; 3], [-2.0 * step; 3]).unwrap();
    let grid = cutis_volume::Grid { shape: [count(60.0), count(40.0), count(20.0)], affine };
    let lattice = Lattice::new(grid, split).unwrap();
    let within = |v: f64, high: f64| (-1e-9..=high + 1e-9).contains(&v);
    body(&lattice, |p| within(p[0], 60.0) && within(p[1], 40.0) && within(p[2], 20.0))
}

pub fn body(lattice: &Lattice, is_tissue: impl Fn([f64; 3]) -> bool) -> (TetMesh, Vec<[u32; 3]>) {
    let air = air(lattice, is_tissue);
    let mesh = mesh(lattice, &air);
    // The boundary mode also gives the ends of the block in z.
    let skin = skin::detect(lattice, &air, SkinMode::Boundary, &SkinOptions::default()).unwrap();
    let (triangles, dropped) = skin_on_mesh(&mesh, &skin);
    assert_eq!(dropped, 0);
    (mesh, triangles)
}

fn incision(from_mm: [f64; 3], to_mm: [f64; 3], depth_mm: f64, width_mm: f64) -> Incision {
    Incision { path_mm: vec![from_mm, to_mm], depth_mm, width_mm: Some(width_mm) }
}

/// Vertices reached from a vertex through tets whose corners all satisfy a condition.
pub fn reached(mesh: &TetMesh, start: u32, within: impl Fn(Point3<f64>) -> bool) -> BTreeSet<u32> {
    let usable: Vec<&[u32; 4]> = mesh
        .tets
        .iter()
        .filter(|tet| tet.iter().all(|&v| within(mesh.frame.to_mm(mesh.positions[v as usize]))))
        .collect();
    let mut seen = BTreeSet::from([start]);
    loop {
        let before = seen.len();
        for tet in &usable {
            if tet.iter().any(|v| seen.contains(v)) {
                seen.extend(tet.iter());
            }
        }
        if seen.len() == before {
            return seen;
        }
    }
}

/// A cut of no width has lips on both sides, also where its blade runs through lattice points and
/// one side of it has no copies of tets.
#[test]
fn a_cut_through_lattice_points_has_two_lips() {
    for split in [Split::Kuhn6, Split::Five] {
        for place in [20.0, 20.7, 21.0] {
            let (mut mesh, mut triangles) = block(2.0, split);
            let incision =
                Incision { width_mm: None, ..incision([10.0, place, 20.0], [50.0, place, 20.0], 8.0, 2.0) };
            let mut cut = plan(&mesh, &triangles, &[incision]).unwrap();
            cut.apply(&mut mesh, &mut triangles);
            cut.sever(&mut mesh, &mut triangles).unwrap().unwrap();
            let gape = &cut.gapes[0];
            assert!(!gape.left().is_empty() && !gape.right().is_empty(), "{split:?} {place}");
        }
    }
}

/// The mesh that a cut of no width along a path leaves, and the gape of the path.
fn severed(path: &[[f64; 3]], moved: &dyn Fn([f64; 3]) -> [f64; 3]) -> (TetMesh, WoundGape) {
    let (mut mesh, mut triangles) = block(2.0, Split::Five);
    let along = Incision { path_mm: path.to_vec(), depth_mm: 8.0, width_mm: None };
    let mut cut = plan(&mesh, &triangles, &[along]).unwrap();
    cut.apply(&mut mesh, &mut triangles);
    cut.sever(&mut mesh, &mut triangles).unwrap().unwrap();
    let initial = cut.gapes[0].measure(&mesh.positions);
    assert!(initial.mean_distance_mm < 1e-6, "{initial:?}");
    // The virtual nodes move and the others stay.
    let mut positions = mesh.positions.clone();
    for position in &mut positions[mesh.real_vertices()..] {
        let mm = mesh.frame.to_mm(*position);
        *position = mesh.frame.to_local(moved(mm.into()).into());
    }
    (mesh, cut.gapes[0].measure(&positions))
}

/// A further point on a straight path changes nothing. Control: a point next to it does.
#[test]
fn a_point_on_a_straight_path_changes_nothing() {
    let still = |mm| mm;
    let ends = [[12.3, 20.7, 20.0], [47.1, 20.7, 20.0]];
    let middle = |y| [ends[0], [30.2, y, 20.0], ends[1]];
    let (straight, _) = severed(&ends, &still);
    let (through, _) = severed(&middle(20.7), &still);
    assert_eq!(straight.tets, through.tets);
    let (bent, _) = severed(&middle(26.0), &still);
    assert_ne!(straight.tets, bent.tets);
}

/// The gape of a bent path is across each of its segments: a ring of tissue around the path that is
/// lifted out of the plane has none, and lips that move along the normals of the segments have it.
#[test]
fn the_gape_of_a_bent_path_is_across_its_segments() {
    let path = [[15.0, 15.0, 20.0], [30.3, 26.0, 20.0], [46.0, 15.0, 20.0]];
    let (mesh, lifted) = severed(&path, &|[x, y, z]| [x, y, z + 3.0]);
    assert!(mesh.positions.len() > mesh.real_vertices());
    assert!(lifted.mean_mm.abs() < 1e-3 && lifted.mean_distance_mm > 0.5, "{lifted:?}");
    let (_, apart) = severed(&path, &|[x, y, z]| [x, y - 2.0, z]);
    // The virtual nodes are on both sides, so that only a part of the lips moves.
    assert!(apart.mean_mm.abs() < apart.mean_distance_mm, "{apart:?}");
}

#[test]
fn a_cut_removes_the_vertices_in_the_slit() {
    for split in [Split::Kuhn6, Split::Five] {
        let (mesh, triangles) = block(2.0, split);
        let cut =
            plan(&mesh, &triangles, &[incision([20.0, 20.0, 20.0], [40.0, 20.0, 20.0], 6.5, 4.5)]).unwrap();
        for (v, &removed) in cut.removed.iter().enumerate() {
            let mm = mesh.frame.to_mm(mesh.positions[v]);
            let inside = (19.99..=40.01).contains(&mm.x) && (mm.y - 20.0).abs() < 2.26 && mm.z >= 13.4;
            assert_eq!(removed, inside, "{mm}");
        }
        let (mut opened, mut skin) = (mesh.clone(), triangles.clone());
        let removed = cut.apply(&mut opened, &mut skin);
        assert_eq!(opened.tets.len() + removed.tets.len(), mesh.tets.len());
        assert_eq!(opened.edges.len() + removed.edges.len(), mesh.edges.len());
        assert_eq!(skin.len() + removed.triangles.len(), triangles.len());
        let is_removed = |v: &u32| cut.removed[*v as usize];
        assert!(
            !opened.tets.iter().flatten().any(is_removed) && !opened.edges.iter().flatten().any(is_removed)
        );
        assert!(!skin.iter().flatten().any(is_removed));
        // The rest is a valid mesh: each edge has a volume, and the surface is closed.
        assert!(opened.edge_volumes().iter().all(|&share| share > 0.0));
        assert_eq!(cutis_mesh::Topology::of(&opened.boundary()).open_edges.len(), 0);
        // The width is 4.5 mm and the rows are 2 mm apart. Rows 18, 20 and 22 are removed, and rows
        // 16 and 24 are the lips.
        let gape = cut.gapes[0].measure(&mesh.positions);
        assert!((gape.mean_mm - 8.0).abs() < 1e-4 && (gape.mid_mm - 8.0).abs() < 1e-4, "{gape:?}");
        assert!((gape.mean_distance_mm - 8.0).abs() < 0.3, "{gape:?}");
        let row = |v: u32| mesh.frame.to_mm(mesh.positions[v as usize]).y.round() as i32;
        let sides = |lip: &[Embedded]| lip.iter().map(|p| row(p.nodes[0])).collect::<BTreeSet<_>>();
        assert_eq!(&sides(cut.gapes[0].left()) | &sides(cut.gapes[0].right()), BTreeSet::from([16, 24]));
    }
}

#[test]
fn lips_of_thin_and_oblique_slits_are_separate() {
    let (mesh, triangles) = block(2.0, Split::Kuhn6);
    for (from, to) in
        [([12.0, 20.0], [48.0, 20.0]), ([12.3, 12.1], [47.7, 28.9]), ([20.0, 8.0], [39.0, 33.0])]
    {
        let (from, to) = ([from[0], from[1], 20.0], [to[0], to[1], 20.0]);
        let along = (Point3::from(to) - Point3::from(from)).normalize();
        let lateral = Vector3::z().cross(&along);
        for width in [0.01, 1.0, 3.0] {
            let (mut opened, mut skin) = (mesh.clone(), triangles.clone());
            let cut = plan(&mesh, &triangles, &[incision(from, to, 8.0, width)]).unwrap();
            // In a window inside the slit, the two sides are not connected. Before the cut they
            // are.
            let window = |mm: Point3<f64>| {
                let from_start = mm - Point3::from(from);
                let s = from_start.dot(&along);
                let length = (Point3::from(to) - Point3::from(from)).norm();
                mm.z > 13.0 && s > 4.0 && s < length - 4.0 && from_start.dot(&lateral).abs() < 7.0
            };
            let vertices = |lip: &[Embedded]| lip.iter().map(|p| p.nodes[0]).collect::<Vec<u32>>();
            let lip = vertices(cut.gapes[0].left());
            let start = lip[lip.len() / 2];
            let other: BTreeSet<u32> = vertices(cut.gapes[0].right()).into_iter().collect();
            assert!(!reached(&mesh, start, window).is_disjoint(&other));
            cut.apply(&mut opened, &mut skin);
            assert!(reached(&opened, start, window).is_disjoint(&other), "{from:?} {to:?} {width}");
            // Each vertex that is not removed has a tet, and each edge has a volume.
            let masses = opened.masses(&|_| 1000.0);
            assert!(cut.removed.iter().zip(&masses).all(|(&removed, &mass)| removed == (mass == 0.0)));
            assert!(opened.edge_volumes().iter().all(|&share| share > 0.0));
            let joined: BTreeSet<[u32; 2]> = opened.edges.iter().copied().collect();
            let both = |a: u32, b: u32| joined.contains(&[a.min(b), a.max(b)]);
            assert!(!lip.iter().any(|&a| other.iter().any(|&b| both(a, b))));
        }
    }
}

#[test]
fn gape_is_the_lateral_opening() {
    let (mesh, triangles) = block(2.0, Split::Kuhn6);
    let cut = plan(&mesh, &triangles, &[incision([15.0, 20.0, 20.0], [45.0, 20.0, 20.0], 8.0, 3.0)]).unwrap();
    let gape = &cut.gapes[0];
    let rest = gape.measure(&mesh.positions);
    let side = cut.slits[0].lateral().cast::<f32>();
    let along = Vector3::new(1.0, 0.0, 0.0);
    let right: BTreeSet<u32> = gape.right().iter().map(|lip| lip.nodes[0]).collect();
    // The right lip opens by 6 mm in the middle and less towards the ends, and slides along the
    // slit by 2 mm.
    let moved: Vec<Point3<f32>> = mesh
        .positions
        .iter()
        .enumerate()
        .map(|(v, p)| {
            let s = (mesh.frame.to_mm(*p).x - 30.0).abs() / 15.0;
            let open = if right.contains(&(v as u32)) { 0.006 * (1.0 - s as f32) } else { 0.0 };
            p + side * open + along * if open > 0.0 { 0.002 } else { 0.0 }
        })
        .collect();
    let now = gape.measure(&moved);
    assert!((now.mid_mm - rest.mid_mm - 6.0).abs() < 0.5, "{rest:?} {now:?}");
    let mean = now.mean_mm - rest.mean_mm;
    assert!(mean > 2.5 && mean < 4.0, "{rest:?} {now:?}");
    assert!(now.mid_distance_mm > now.mid_mm + 0.1);
    // A translation of the whole body does not change the gape.
    let shifted: Vec<Point3<f32>> =
        mesh.positions.iter().map(|p| p + Vector3::new(0.01, 0.02, 0.03)).collect();
    let shift = gape.measure(&shifted);
    assert!((shift.mean_mm - rest.mean_mm).abs() < 1e-3 && (shift.mid_mm - rest.mid_mm).abs() < 1e-3);
}

#[test]
fn curved_skin_is_cut_to_an_even_depth() {
    // A cylinder along x with a radius of 40 mm, cut across its axis over an arc of 60°. The chord
    // is far below the skin.
    let lattice = lattice([12, 49, 49], [2.0; 3], Split::Kuhn6);
    let (cy, cz) = (28.0, 58.0);
    let radius = |p: [f64; 3]| ((p[1] - cy).powi(2) + (p[2] - cz).powi(2)).sqrt();
    let (mesh, triangles) = body(&lattice, |p| radius(p) <= 40.0);
    let (sin, cos) = (30f64.to_radians().sin(), 30f64.to_radians().cos());
    let end = |sign: f64| [41.0, cy + sign * 40.0 * sin, cz + 40.0 * cos];
    let cut = plan(&mesh, &triangles, &[incision(end(-1.0), end(1.0), 8.0, 5.0)]).unwrap();
    let mut deepest = f64::INFINITY;
    for (v, _) in cut.removed.iter().enumerate().filter(|(_, removed)| **removed) {
        deepest = deepest.min(radius(mesh.frame.to_mm(mesh.positions[v]).into()));
    }
    // Depth is measured along one axis, so at 30° it is 8·cos 30° mm across the skin. The lattice
    // rounds it.
    assert!(deepest > 40.0 - 8.0 - 2.5 && deepest < 40.0 - 8.0 + 2.5, "{deepest}");
    // The skin is removed along the whole arc.
    let removed_skin: Vec<f64> = cut
        .removed
        .iter()
        .enumerate()
        .filter(|(_, removed)| **removed)
        .map(|(v, _)| mesh.frame.to_mm(mesh.positions[v]))
        .filter(|mm| radius((*mm).into()) > 37.5)
        .map(|mm| mm.y - cy)
        .collect();
    assert!(
        (-18..=18).all(|y| removed_skin.iter().any(|at| (at - f64::from(y)).abs() <= 2.0)),
        "{removed_skin:?}"
    );
    assert!(cut.gapes[0].measure(&mesh.positions).bins >= 10);
}

/// A limb along x, of radius 40 mm around y = 28, z = 58 mm.
fn limb() -> (TetMesh, Vec<[u32; 3]>) {
    let lattice = lattice([12, 49, 49], [2.0; 3], Split::Kuhn6);
    body(&lattice, |p| (p[1] - 28.0).hypot(p[2] - 58.0) <= 40.0)
}

/// A segment between two places on a limb, at these angles from its top.
fn chord([from, to]: [f64; 2]) -> Incision {
    let at = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [41.0, 28.0 + 40.0 * sin, 58.0 + 40.0 * cos]
    };
    incision(at(from), at(to), 45.0, 4.0)
}

/// A straight segment from one side of a limb to the other is refused with its depth below the
/// skin, also if the incision is deeper than that. Control: a chord of 60° follows the skin.
#[test]
fn a_segment_through_a_limb_is_refused() {
    let (mesh, triangles) = limb();
    let shallow = |angles| Incision { depth_mm: 8.0, ..chord(angles) };
    let find = |one: Incision| plan(&mesh, &triangles, &[shallow([-30.0, 30.0]), one]).map(|_| ());
    find(shallow([40.0, 100.0])).unwrap();
    for (angles, depth) in [([-90.0, 90.0], 40.0), ([-70.0, 70.0], 26.3), ([-60.0, 60.0], 20.0)] {
        let error = find(chord(angles)).unwrap_err();
        let MeshError::IncisionThroughBody { incision: 1, below_mm, at_mm, .. } = error else {
            panic!("{angles:?}: {error}")
        };
        assert!((below_mm - depth).abs() < 4.0, "{angles:?}: {below_mm} mm, not {depth}");
        assert!((at_mm[1] - 28.0).abs() < 6.0, "{angles:?}: {at_mm:?}");
        assert!(error.to_string().contains("add points along the skin"), "{error}");
    }
    // One end is on the skin, and the other one inside the body.
    let pierces = incision([41.0, 0.0, 86.5], [41.0, 28.0, 65.0], 20.0, 4.0);
    assert!(matches!(find(pierces), Err(MeshError::IncisionThroughBody { incision: 1, .. })));
    // A path that follows the skin below it is placed on the skin.
    let below = incision([34.0, 28.0, 92.0], [48.0, 28.0, 92.0], 10.0, 4.0);
    find(below).unwrap();
}

#[test]
fn several_incisions_each_have_their_gape() {
    let (mesh, triangles) = block(2.0, Split::Kuhn6);
    let first = incision([10.0, 12.0, 20.0], [30.0, 12.0, 20.0], 6.0, 1.0);
    let second = incision([40.0, 10.0, 20.0], [40.0, 30.0, 20.0], 6.0, 7.0);
    let cut = plan(&mesh, &triangles, &[first, second]).unwrap();
    let gapes: Vec<f64> = cut.gapes.iter().map(|gape| gape.measure(&mesh.positions).mean_mm).collect();
    // The first slit removes the row at y = 12. Columns 38, 40 and 42 are within 3.5 mm of x = 40.
    assert!((gapes[0] - 4.0).abs() < 1e-3 && (gapes[1] - 8.0).abs() < 1e-3, "{gapes:?}");
    let at = |x: f64, y: f64, z: f64| mesh.frame.to_local(Point3::new(x, y, z));
    assert!((cut.distance_mm(at(20.0, 15.0, 18.0)) - 3.0).abs() < 1e-4);
    assert!((cut.distance_mm(at(40.0, 33.0, 18.0)) - 3.0).abs() < 1e-4);
    let none = plan(&mesh, &triangles, &[]).unwrap();
    let (mut same, mut skin) = (mesh.clone(), triangles.clone());
    assert_eq!(none.apply(&mut same, &mut skin), cutis_mesh::Removed::default());
    assert!(
        same.edges == mesh.edges && skin == triangles && none.distance_mm(at(0.0, 0.0, 0.0)).is_infinite()
    );
}

#[test]
fn invalid_incisions_are_refused() {
    let (mesh, triangles) = block(2.0, Split::Kuhn6);
    let (a, b) = ([20.0, 20.0, 20.0], [40.0, 20.0, 20.0]);
    let refuse = |one: Incision| plan(&mesh, &triangles, &[incision(a, b, 6.0, 4.0), one]).unwrap_err();
    for (depth, width, key) in [
        (0.0, 4.0, "depth_mm"),
        (-1.0, 4.0, "depth_mm"),
        (6.0, f64::NAN, "width_mm"),
        (6.0, f64::INFINITY, "width_mm"),
    ] {
        let error = refuse(incision(a, b, depth, width));
        assert!(error.to_string().contains(key) && error.to_string().contains("incision 1"), "{error}");
    }
    for (from, why) in [(b, "points 0 and 1 are the same"), ([f64::NAN; 3], "finite")] {
        let error = refuse(incision(from, b, 6.0, 4.0));
        assert!(matches!(error, MeshError::IncisionPath { incision: 1, .. }), "{error}");
        assert!(error.to_string().contains(why), "{error}");
    }
    let off = refuse(incision([20.0, 20.0, 70.0], [40.0, 20.0, 70.0], 6.0, 4.0));
    assert!(
        matches!(off, MeshError::IncisionOffSkin { distance_mm, .. } if (distance_mm - 50.0).abs() < 1.0),
        "{off}"
    );
    // One end is on the skin, the other far outside the block. Most of the segment runs through
    // air.
    let mostly_off = refuse(incision([50.0, 20.0, 20.0], [150.0, 20.0, 20.0], 6.0, 4.0));
    assert!(
        matches!(mostly_off, MeshError::IncisionOffSkin { distance_mm, .. } if distance_mm > 80.0),
        "{mostly_off}"
    );
    let through = refuse(incision([20.0, 20.0, 24.0], [20.0, 20.0, 16.0], 6.0, 4.0));
    assert!(matches!(through, MeshError::IncisionThroughSkin { .. }), "{through}");
    let empty = refuse(incision([20.5, 20.6, 20.0], [20.6, 20.6, 20.0], 0.1, 0.1));
    assert!(matches!(empty, MeshError::IncisionEmpty { .. }), "{empty}");
    let all = refuse(incision(a, b, 6.0, 400.0));
    assert!(matches!(all, MeshError::IncisionWithoutLips { left: 0, right: 0, .. }), "{all}");
    // A huge length is refused quickly.
    let long = plan(&mesh, &triangles, &[incision([-1e12, 20.0, 20.0], [1e12, 20.0, 20.0], 6.0, 4.0)]);
    assert!(long.is_err());
    let wrong_index = [[0, 1, u32::MAX]];
    for error in [
        Cut::of_slits(&mesh, &wrong_index, Vec::new()).unwrap_err(),
        Slit::on_lattice(&mesh.lattice, &wrong_index, &[]).unwrap_err(),
    ] {
        assert!(matches!(error, MeshError::VertexIndex { position: 0, vertex: u32::MAX, .. }), "{error}");
    }
    let without_skin = plan(&mesh, &[], &[incision(a, b, 6.0, 4.0)]).unwrap_err();
    assert!(matches!(without_skin, MeshError::IncisionWithoutSkin { incision: 0 }), "{without_skin}");
}

#[test]
fn vertices_without_a_tet_are_removed() {
    // Two slits cross at a sharp angle. Near the crossing they remove every tet between them.
    let (mesh, triangles) = block(2.0, Split::Kuhn6);
    let rising = incision([10.0, 17.0, 20.0], [50.0, 23.0, 20.0], 8.0, 0.1);
    let falling = incision([10.0, 23.0, 20.0], [50.0, 17.0, 20.0], 8.0, 0.1);
    let cut = plan(&mesh, &triangles, &[rising, falling]).unwrap();
    let (mut opened, mut skin) = (mesh.clone(), triangles.clone());
    cut.apply(&mut opened, &mut skin);
    let masses = opened.masses(&|_| 1000.0);
    let between = mesh
        .positions
        .iter()
        .map(|p| mesh.frame.to_mm(*p))
        .map(|mm| (mm.y - 20.0).abs() < 1e-3 && (mm.x - 34.0).abs() < 1e-3 && mm.z > 13.0);
    assert!(between.zip(&cut.removed).any(|(between, removed)| between && *removed));
    assert!(cut.removed.iter().zip(&masses).all(|(&removed, &mass)| removed == (mass == 0.0)));
}
