//! Cuts of no width: invariants of severed edges, copies and nodes, and an independent program.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use cutis_mesh::sever::{Blade, Severing, SplitTet, Station, TetCopy, TriangleCopy, Wound};
use cutis_mesh::{Lattice, Split, TetMesh};
use cutis_volume::{Affine, Grid};
use nalgebra::{Matrix4, Point3, Vector3, Vector4};
use proptest::prelude::*;

use crate::oracle::mesh;

const SPLITS: [Split; 2] = [Split::Kuhn6, Split::Five];
/// Longest edge of the lattices of these tests, in m.
const MARGIN: f64 = 0.012;

/// A block of tissue with steps of 3, 4 and 5 mm.
pub fn block(cells: [usize; 3], split: Split) -> TetMesh {
    let affine = Affine::from_spacing([3.0, 4.0, 5.0], [0.0; 3]).unwrap();
    let lattice = Lattice::new(Grid { shape: cells.map(|n| n + 1), affine }, split).unwrap();
    mesh(&lattice, &vec![false; lattice.grid().len()])
}

/// A blade along stations in local meters, all with one inward direction.
pub fn blade(path: &[[f64; 3]], inward: [f64; 3], depth: f64) -> Blade {
    let inward = Vector3::from(inward).normalize();
    let stations: Vec<Station> = path.iter().map(|&p| Station { skin: p.into(), inward }).collect();
    Blade::along(&stations, depth, MARGIN, 2.0 * MARGIN).unwrap()
}

/// A plane through a point that cuts the whole block.
pub fn plane(at: [f64; 3], along: [f64; 3], inward: [f64; 3]) -> Blade {
    let along = Vector3::from(along).normalize();
    let inward = Vector3::from(inward);
    let inward = (inward - along * inward.dot(&along)).normalize();
    let middle = Vector3::from(at) - inward * 0.1;
    blade(&[(middle - along * 0.1).into(), (middle + along * 0.1).into()], inward.into(), 0.2)
}

pub fn cut(mesh: &TetMesh, blades: &[Blade]) -> Wound {
    let mut severing = Severing::new(mesh);
    blades.iter().for_each(|blade| {
        severing.add(mesh, blade);
    });
    severing.cut_all();
    severing.wound(mesh).unwrap()
}

/// All tets of the cut body, in nodes.
pub fn tets(mesh: &TetMesh, wound: &Wound) -> Vec<[u32; 4]> {
    let split: BTreeSet<u32> = wound.split.iter().map(|split| split.tet).collect();
    let whole = (0..).zip(&mesh.tets).filter(|(n, _)| !split.contains(n)).map(|(_, tet)| *tet);
    whole.chain(wound.copies.iter().map(|copy| copy.nodes)).collect()
}

/// Sets of nodes that tets connect.
pub fn pieces(tets: &[[u32; 4]]) -> Vec<BTreeSet<u32>> {
    let mut piece_of: HashMap<u32, usize> = HashMap::new();
    let mut pieces: Vec<BTreeSet<u32>> = Vec::new();
    for tet in tets {
        let touched: BTreeSet<usize> = tet.iter().filter_map(|node| piece_of.get(node).copied()).collect();
        let target = touched.first().copied().unwrap_or_else(|| {
            pieces.push(BTreeSet::new());
            pieces.len() - 1
        });
        for &other in touched.iter().skip(1) {
            let moved = std::mem::take(&mut pieces[other]);
            moved.iter().for_each(|node| {
                piece_of.insert(*node, target);
            });
            pieces[target].extend(moved);
        }
        for &node in tet {
            piece_of.insert(node, target);
            pieces[target].insert(node);
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

#[test]
fn a_plane_through_the_body_makes_two_pieces() {
    for split in SPLITS {
        let mesh = block([6, 5, 4], split);
        let blade = plane([0.0003, 0.0011, -0.0007], [0.2, 1.0, 0.3], [0.1, -0.2, 1.0]);
        let wound = cut(&mesh, &[blade]);
        let pieces = pieces(&tets(&mesh, &wound));
        assert_eq!(pieces.len(), 2, "{split:?}");
        // Every vertex of the mesh is in one piece, and no piece has two nodes at one place.
        let n = mesh.positions.len() as u32;
        for piece in &pieces {
            let places: BTreeSet<u32> = piece
                .iter()
                .map(|&node| if node < n { node } else { wound.virtual_nodes[(node - n) as usize] })
                .collect();
            assert_eq!(places.len(), piece.len());
        }
        let all: usize = pieces.iter().map(BTreeSet::len).sum();
        assert_eq!(all, mesh.positions.len() + wound.virtual_nodes.len());
    }
}

#[test]
fn two_planes_that_cross_make_four_pieces_and_three_make_eight() {
    for split in SPLITS {
        let mesh = block([7, 6, 5], split);
        let planes = || {
            vec![
                plane([0.0002, 0.0, 0.0], [0.1, 1.0, 0.2], [0.0, 0.1, 1.0]),
                plane([0.0, 0.0007, 0.0], [1.0, 0.2, 0.0], [0.0, 0.1, 1.0]),
                plane([0.0, 0.0, 0.0009], [1.0, 0.1, 0.1], [0.0, 1.0, 0.2]),
            ]
        };
        for count in 1..=3 {
            let wound = cut(&mesh, &planes()[..count]);
            assert_eq!(pieces(&tets(&mesh, &wound)).len(), 1 << count, "{split:?}");
        }
    }
}

/// A blade on a plane of lattice points: no part is thinner than a cell.
#[test]
fn a_blade_on_lattice_points_cuts_once() {
    for split in SPLITS {
        let mesh = block([6, 4, 4], split);
        let at = f64::from(mesh.positions[3].x);
        let wound = cut(&mesh, &[plane([at, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])]);
        let pieces = pieces(&tets(&mesh, &wound));
        assert_eq!(pieces.len(), 2, "{split:?}");
        assert!(wound.copies.iter().all(|copy| (copy.share - 1.0).abs() < 1e-6), "{split:?}");
    }
}

/// A cut that ends in the body leaves it in one piece. Farther from its end than a cell and the
/// blur of the border, nothing is divided.
#[test]
fn a_blade_that_ends_in_the_body_leaves_one_piece() {
    let mesh = block([8, 8, 8], Split::Kuhn6);
    let path = [[0.0004, -0.03, -0.03], [0.0004, 0.0021, -0.03]];
    let wound = cut(&mesh, &[blade(&path, [0.0, 0.0, 1.0], 0.033)]);
    assert!(!wound.copies.is_empty());
    assert_eq!(pieces(&tets(&mesh, &wound)).len(), 1);
    for copy in &wound.copies {
        for &v in &mesh.tets[copy.tet as usize] {
            let p = mesh.positions[v as usize];
            assert!(p.y < 0.0021 + 0.003 + 0.004 && p.z < 0.003 + 0.003 + 0.005, "{p}");
        }
    }
}

/// The part that a copy holds.
fn part_of(split: &SplitTet, copy: &TetCopy) -> u8 {
    (0..4).filter(|part| split.kept >> part & 1 == 1).nth(usize::from(copy.number)).unwrap_or(u8::MAX)
}

fn kept_volume(mesh: &TetMesh, copies: &[TetCopy]) -> f64 {
    let volumes = mesh.tet_volumes();
    copies.iter().map(|copy| f64::from(copy.share) * f64::from(volumes[copy.tet as usize])).sum()
}

/// The paths of a random blade: a polyline in the block, with an inward direction and a depth.
fn random_blade() -> impl Strategy<Value = (Vec<[f64; 3]>, [f64; 3], f64)> {
    let place = || prop::array::uniform3(-0.015..0.015_f64);
    let path = prop::collection::vec(place(), 2..5);
    let direction =
        prop::array::uniform3(-1.0..1.0_f64).prop_filter("a direction", |d| Vector3::from(*d).norm() > 0.2);
    (path, direction, 0.002..0.03_f64)
}

pub type RandomBlades = Vec<(Vec<[f64; 3]>, [f64; 3], f64)>;

pub fn blades(random: &RandomBlades) -> Vec<Blade> {
    random.iter().map(|(path, inward, depth)| blade(path, *inward, *depth)).collect()
}

fn air_of(mesh: &TetMesh, seed: &[bool]) -> TetMesh {
    crate::oracle::mesh(&mesh.lattice, seed)
}

/// A block with holes, and blades.
pub fn random_cut() -> impl Strategy<Value = (TetMesh, RandomBlades)> {
    let shape = [5, 4, 4];
    let points = 6 * 5 * 5;
    let air = prop::collection::vec(prop::bool::weighted(0.05), points);
    (any::<bool>(), air, prop::collection::vec(random_blade(), 1..5)).prop_map(move |(five, air, blades)| {
        let whole = block(shape, if five { Split::Five } else { Split::Kuhn6 });
        (air_of(&whole, &air), blades)
    })
}

/// The nodes by a program that knows only the parts of each tet: all tets of the mesh, faces by
/// their vertices, and repeated merging.
fn nodes_by_merging(mesh: &TetMesh, wound: &Wound) -> Vec<[usize; 4]> {
    let split: HashMap<u32, usize> = wound.split.iter().enumerate().map(|(n, s)| (s.tet, n)).collect();
    // Copies: tet and the corners that it holds.
    let mut copies: Vec<(u32, Vec<u32>)> = Vec::new();
    // Copies of whole tets that stand for what is not cut. They join nothing across faces.
    let mut uncut: Vec<usize> = Vec::new();
    for (n, tet) in (0..).zip(&mesh.tets) {
        match split.get(&n) {
            None => copies.push((n, tet.to_vec())),
            Some(&s) => {
                let split = &wound.split[s];
                for part in (0..4).filter(|part| split.kept >> part & 1 == 1) {
                    let held = (0..4).filter(|&c| split.parts[c] == part).map(|c| tet[c]).collect();
                    copies.push((n, held));
                }
                if split.cut < 1.0 {
                    uncut.push(copies.len());
                    copies.push((n, tet.to_vec()));
                }
            }
        }
    }
    let mut faces: BTreeMap<Vec<u32>, Vec<usize>> = BTreeMap::new();
    for (number, (tet, _)) in copies.iter().enumerate() {
        for opposite in 0..4 {
            let mut face = mesh.tets[*tet as usize].to_vec();
            face.remove(opposite);
            face.sort_unstable();
            faces.entry(face).or_default().push(number);
        }
    }
    // Names of the nodes of each copy, merged until nothing changes.
    let mut names: Vec<[usize; 4]> = (0..copies.len()).map(|n| [0, 1, 2, 3].map(|c| 4 * n + c)).collect();
    let place = |copy: usize, vertex: u32| {
        mesh.tets[copies[copy].0 as usize].iter().position(|&v| v == vertex).unwrap()
    };
    let mut by_vertex: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (number, (_, held)) in copies.iter().enumerate() {
        held.iter().for_each(|&v| by_vertex.entry(v).or_default().push(number));
    }
    loop {
        let before = names.clone();
        let mut merge = |a: usize, b: usize, vertex: u32| {
            let (p, q) = (place(a, vertex), place(b, vertex));
            let low = names[a][p].min(names[b][q]);
            names[a][p] = low;
            names[b][q] = low;
        };
        for (&vertex, holding) in &by_vertex {
            holding.iter().for_each(|&copy| merge(holding[0], copy, vertex));
        }
        for (face, around) in &faces {
            for &a in around {
                for &b in around {
                    let both = |v: &&u32| copies[a].1.contains(v) && copies[b].1.contains(v);
                    if uncut.contains(&a) || uncut.contains(&b) {
                        continue;
                    }
                    if copies[a].0 != copies[b].0 && face.iter().any(|v| both(&v)) {
                        face.iter().for_each(|&v| merge(a, b, v));
                    }
                }
            }
        }
        if names == before {
            break;
        }
    }
    let in_wound = |n: &usize| split.contains_key(&copies[*n].0);
    (0..copies.len()).filter(in_wound).map(|n| names[n]).collect()
}

fn same_classes(a: &[[usize; 4]], b: &[TetCopy]) -> bool {
    let (mut forth, mut back) = (HashMap::new(), HashMap::new());
    a.iter()
        .flatten()
        .zip(b.iter().flat_map(|copy| copy.nodes))
        .all(|(&a, b)| *forth.entry(a).or_insert(b) == b && *back.entry(b).or_insert(a) == a)
}

/// No two constraints of one color share a node.
pub fn colors_are_valid<const N: usize>(tuples: &[[u32; N]], colors: &[u16]) -> bool {
    let mut seen = BTreeSet::new();
    tuples.iter().zip(colors).all(|(nodes, color)| nodes.iter().all(|&node| seen.insert((*color, node))))
}

fn check_cut(mesh: &TetMesh, random: &RandomBlades) -> Result<(), TestCaseError> {
    let blades = blades(random);
    let wound = cut(mesh, &blades);
    // Nodes are those of an independent program.
    prop_assert!(same_classes(&nodes_by_merging(mesh, &wound), &wound.copies));
    // A corner in its own part is the vertex of the mesh.
    let n = mesh.positions.len() as u32;
    for copy in &wound.copies {
        let split = wound.split[wound.split.binary_search_by_key(&copy.tet, |split| split.tet).unwrap()];
        for (corner, &node) in copy.nodes.iter().enumerate() {
            let vertex = mesh.tets[copy.tet as usize][corner];
            prop_assert!(!(copy.whole || split.parts[corner] == part_of(&split, copy)) || node == vertex);
            prop_assert!(node == vertex || wound.virtual_nodes[(node - n) as usize] == vertex);
        }
    }
    // Shares sum to the whole, for tets, edges and masses.
    let volumes = mesh.tet_volumes();
    let split: f64 = wound.split.iter().map(|split| f64::from(volumes[split.tet as usize])).sum();
    prop_assert!((kept_volume(mesh, &wound.copies) - split).abs() <= 1e-6 * split.max(1e-9));
    let of_edges = |edges: &[[u32; 2]], volumes: &[f32]| -> f64 {
        let chosen = edges.iter().map(|edge| f64::from(volumes[mesh.edges.binary_search(edge).unwrap()]));
        chosen.sum()
    };
    let before = of_edges(&wound.split_edges, &mesh.edge_volumes());
    let after: f64 = wound.edges.iter().map(|edge| f64::from(edge.volume)).sum();
    prop_assert!((before - after).abs() <= 1e-5 * before.max(1e-9), "{before} {after}");
    // Closed-form colors with the number of the copy are valid, without it they may not be.
    let mut divided = mesh.clone();
    divided.divide(&wound);
    prop_assert!(colors_are_valid(&divided.tets, &divided.tet_colors()));
    prop_assert!(colors_are_valid(&divided.edges, &divided.edge_colors()));
    // Colors of vertices are valid for the copies too: two nodes at one point are never in one tet.
    let of_vertices = divided.vertex_colors();
    for tet in &divided.tets {
        let colors: BTreeSet<u16> = tet.iter().map(|&v| of_vertices[v as usize]).collect();
        prop_assert_eq!(colors.len(), 4);
    }
    // The divided mesh has the volumes and masses of the mesh, and each edge of a tet once.
    let sum = |values: Vec<f32>| values.into_iter().map(f64::from).sum::<f64>();
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-5 * b;
    prop_assert!(near(sum(divided.tet_volumes()), sum(mesh.tet_volumes())));
    prop_assert!(near(sum(divided.edge_volumes()), sum(mesh.edge_volumes())));
    prop_assert!(near(sum(divided.masses(&|_| 1000.0)), sum(mesh.masses(&|_| 1000.0))));
    let mut of_tets = BTreeSet::new();
    for tet in &divided.tets {
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            of_tets.insert([tet[a].min(tet[b]), tet[a].max(tet[b])]);
        }
    }
    let of_edges: BTreeSet<[u32; 2]> = divided.edges.iter().map(|[a, b]| [*a.min(b), *a.max(b)]).collect();
    prop_assert_eq!(of_edges.len(), divided.edges.len());
    prop_assert_eq!(of_edges, of_tets);
    Ok(())
}

/// In any number of increments the wound is the same at the end. Control: without the last one
/// nothing may be cut.
fn check_increments(mesh: &TetMesh, random: &RandomBlades) -> Result<(), TestCaseError> {
    let blades = blades(random);
    let wound = cut(mesh, &blades);
    for increments in [1, 7, 50] {
        let mut growing = Severing::new(mesh);
        blades.iter().for_each(|blade| {
            growing.add(mesh, blade);
        });
        for step in 1..increments {
            for (number, blade) in blades.iter().enumerate() {
                growing.cut_to(number, blade.length() * f64::from(step) / f64::from(increments));
            }
        }
        let nothing_yet = increments == 1 && !wound.copies.is_empty();
        prop_assert!(!nothing_yet || growing.wound(mesh).unwrap() != wound);
        growing.cut_all();
        prop_assert!(growing.wound(mesh).unwrap() == wound, "{} increments", increments);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn random_cuts_keep_all_invariants((mesh, random) in random_cut()) {
        check_cut(&mesh, &random)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn any_number_of_increments_makes_the_same_cut((mesh, random) in random_cut()) {
        check_increments(&mesh, &random)?;
    }
}

/// Control: where a blade ends, copies of one tet share nodes. Without the number of the copy they
/// have one color.
#[test]
fn colors_without_the_number_of_the_copy_collide() {
    let mesh = block([8, 8, 8], Split::Kuhn6);
    let mut collisions = 0;
    for turn in 0..20 {
        let (sin, cos) = (0.3 * f64::from(turn)).sin_cos();
        let path = [[0.0004, -0.03, -0.03], [0.003 * sin, 0.0021 + 0.004 * cos, -0.03]];
        let wound = cut(&mesh, &[blade(&path, [0.3 * cos, 0.5 * sin, 1.0], 0.033)]);
        let mut divided = mesh.clone();
        divided.divide(&wound);
        let colors = divided.tet_colors();
        assert!(colors_are_valid(&divided.tets, &colors));
        let without: Vec<u16> = colors.iter().map(|color| color % 24).collect();
        collisions += usize::from(!colors_are_valid(&divided.tets, &without));
    }
    assert!(collisions > 0);
}

/// Barycentric coordinates of a point in a tet.
fn barycentric(mesh: &TetMesh, tet: u32, point: Point3<f64>) -> [f64; 4] {
    let corners = mesh.tets[tet as usize].map(|v| mesh.positions[v as usize].cast::<f64>());
    let columns: [Vector4<f64>; 4] = corners.map(|p| p.to_homogeneous());
    let found = Matrix4::from_columns(&columns).lu().solve(&point.to_homogeneous()).unwrap();
    found.into()
}

/// Each point belongs to the copy on its side of a plane. With the other side as a control.
#[test]
fn points_belong_to_the_copy_on_their_side() {
    for split in SPLITS {
        let mesh = block([6, 5, 4], split);
        let (along, inward) = (Vector3::new(0.2, 1.0, 0.3).normalize(), Vector3::new(0.1, -0.2, 1.0));
        let inward = (inward - along * inward.dot(&along)).normalize();
        let normal = inward.cross(&along);
        let wound = cut(&mesh, &[plane([0.0003, 0.0011, -0.0007], along.into(), inward.into())]);
        let n = mesh.positions.len() as u32;
        let (mut right, mut all) = (0, 0);
        for split in &wound.split {
            let corners = mesh.tets[split.tet as usize].map(|v| mesh.positions[v as usize].cast::<f64>());
            for seed in 0..40 {
                let weights =
                    [1, 2, 3, 4].map(|k| (f64::from(k) * f64::from(seed) * 0.731).sin().abs() + 1e-3);
                let sum: f64 = weights.iter().sum();
                let point = corners
                    .iter()
                    .zip(weights)
                    .fold(Vector3::zeros(), |at, (p, w)| at + p.coords * (w / sum));
                let lambda = barycentric(&mesh, split.tet, point.into());
                let copy = &wound.copies[wound.owner(split, &lambda).unwrap()];
                let side = |p: Vector3<f64>| (p - Vector3::new(0.0003, 0.0011, -0.0007)).dot(&normal) > 0.0;
                // A real corner of the copy is on the same side.
                let held = copy.nodes.iter().zip(&corners).find(|(node, _)| **node < n).unwrap();
                all += 1;
                right += usize::from(side(held.1.coords) == side(point));
            }
        }
        assert!(all > 1000 && right == all, "{split:?}: {right} of {all}");
    }
}

/// Sums of the shares of the copies of each triangle.
fn shares(copies: &[TriangleCopy]) -> BTreeMap<u32, f64> {
    let mut shares: BTreeMap<u32, f64> = BTreeMap::new();
    copies.iter().for_each(|copy| *shares.entry(copy.triangle).or_default() += f64::from(copy.share));
    shares
}

/// Where a blade ends in the skin, the copies and what is not cut have the area of the skin too.
#[test]
fn copies_of_partly_cut_skin_have_its_area() {
    let mesh = block([6, 5, 4], Split::Kuhn6);
    let skin = mesh.boundary();
    let path = [[0.0004, -0.03, -0.03], [0.0004, 0.0021, -0.03]];
    let copies = cut(&mesh, &[blade(&path, [0.0, 0.0, 1.0], 0.033)]).skin(&mesh, &skin);
    assert!(copies.iter().any(|copy| copy.part.is_none()));
    assert!(shares(&copies).values().all(|share| (share - 1.0).abs() < 1e-5));
}

/// Copies of skin triangles have the area of the skin, and a wall carries none.
#[test]
fn copies_of_the_skin_have_its_area() {
    for split in SPLITS {
        let mesh = block([6, 5, 4], split);
        let skin = mesh.boundary();
        let wound = cut(&mesh, &[plane([0.0003, 0.0011, -0.0007], [0.2, 1.0, 0.3], [0.1, -0.2, 1.0])]);
        let copies = wound.skin(&mesh, &skin);
        assert!(copies.len() > 20);
        for (triangle, share) in &shares(&copies) {
            assert!((share - 1.0).abs() < 1e-5, "{triangle}: {share}");
        }
        // A triangle with corners on both sides has two copies without a common node.
        let two: Vec<_> =
            copies.chunk_by(|a, b| a.triangle == b.triangle).filter(|same| same.len() == 2).collect();
        assert!(!two.is_empty());
        assert!(two.iter().all(|same| same[0].nodes.iter().all(|node| !same[1].nodes.contains(node))));
    }
}
