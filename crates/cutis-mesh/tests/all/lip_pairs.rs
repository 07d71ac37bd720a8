//! Pairs of points on both sides of cuts: where they are, on which nodes, and for how much area
//! they stand.

use std::collections::{BTreeSet, HashMap};

use cutis_mesh::sever::{Blade, Growth, LipPair, Severing, Wound};
use cutis_mesh::{Split, TetMesh};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::sever::{RandomBlades, blade, blades, block, colors_are_valid, pieces, plane, random_cut, tets};

const SPLITS: [Split; 2] = [Split::Kuhn6, Split::Five];

/// The finished wound of some blades and its pairs.
fn cut(mesh: &TetMesh, blades: &[Blade]) -> (Wound, Vec<LipPair>) {
    let mut severing = Severing::new(mesh);
    blades.iter().for_each(|blade| {
        severing.add(mesh, blade);
    });
    severing.cut_all();
    let wound = severing.wound(mesh).unwrap();
    let pairs = severing.lip_pairs(mesh, &wound);
    (wound, pairs)
}

fn grow(mesh: &TetMesh, blades: &[Blade]) -> (Wound, Growth) {
    let mut severing = Severing::new(mesh);
    blades.iter().for_each(|blade| {
        severing.add(mesh, blade);
    });
    severing.grow(mesh, &mesh.boundary()).unwrap()
}

/// The points on the positive and on the negative side at rest.
fn points(mesh: &TetMesh, wound: &Wound, pair: &LipPair) -> [Point3<f32>; 2] {
    let virtual_positions = wound.positions(mesh);
    let at = |node: u32| {
        let node = node as usize;
        mesh.positions.get(node).copied().unwrap_or_else(|| virtual_positions[node - mesh.positions.len()])
    };
    let [a, b, c, d] = pair.nodes.map(|node| at(node).coords);
    [(a, b), (c, d)].map(|(a, b)| Point3::from(a * (1.0 - pair.part) + b * pair.part))
}

/// What holds for the pairs of any cut. `tets` are the tetrahedra at its stage.
fn check_pairs(
    mesh: &TetMesh,
    wound: &Wound,
    tets: &[[u32; 4]],
    pairs: &[LipPair],
) -> Result<(), TestCaseError> {
    let mut divided = mesh.clone();
    divided.divide(wound);
    let place = |node: u32| divided.lattice_index[node as usize];
    let used: BTreeSet<u32> = tets.iter().flatten().copied().collect();
    for pair in pairs {
        let [plus, minus] = points(mesh, wound, pair);
        prop_assert_eq!(plus, minus);
        let [low, high] = pair.edge.map(place);
        prop_assert_eq!(pair.nodes.map(place), [low, high, low, high]);
        prop_assert_eq!(pair.nodes.iter().collect::<BTreeSet<_>>().len(), 4);
        prop_assert!(pair.nodes.iter().all(|node| used.contains(node)));
        prop_assert!((0.0..=1.0).contains(&pair.part) && pair.area > 0.0);
        prop_assert!((Vector3::from(pair.normal).norm() - 1.0).abs() < 1e-5);
    }
    let nodes: Vec<[u32; 4]> = pairs.iter().map(|pair| pair.nodes).collect();
    let colors: Vec<u16> = pairs.iter().map(|pair| divided.edge_color(pair.edge, pair.number)).collect();
    prop_assert!(colors_are_valid(&nodes, &colors));
    Ok(())
}

/// The tetrahedra at a stage of a growing cut. A copy whose node is still one with another has that
/// node.
fn tets_at(mesh: &TetMesh, wound: &Wound, growth: &Growth, reached: &[f64]) -> Vec<[u32; 4]> {
    let all = tets(mesh, wound);
    let whole = all[..all.len() - wound.copies.len()].iter().copied();
    whole.chain(growth.stage(reached).tets.iter().map(|copy| copy.nodes)).collect()
}

fn area(pairs: &[LipPair]) -> f64 {
    pairs.iter().map(|pair| f64::from(pair.area)).sum()
}

/// A plane through the whole body: the pairs lie on it, have its normal, share its area, and join
/// the piece on the negative side with the piece on the positive one.
#[test]
fn pairs_of_a_plane_lie_on_it() {
    for split in SPLITS {
        let mesh = block([6, 5, 4], split);
        let (along, inward) = (Vector3::new(0.2, 1.0, 0.0).normalize(), Vector3::new(0.0, 0.0, 1.0));
        let at = Point3::new(0.0003, 0.0011, -0.0007);
        let (wound, pairs) = cut(&mesh, &[plane(at.into(), along.into(), inward.into())]);
        check_pairs(&mesh, &wound, &tets(&mesh, &wound), &pairs).unwrap();
        let normal = inward.cross(&along);
        let right = |p: Point3<f64>| (p - at).dot(&normal);
        let pieces = pieces(&tets(&mesh, &wound));
        let is_right = |piece: &BTreeSet<u32>| {
            let own = |v: &&u32| (**v as usize) < mesh.positions.len();
            let sides = piece.iter().filter(own).map(|&v| right(mesh.positions[v as usize].cast()));
            sides.sum::<f64>() > 0.0
        };
        let [right_piece, left_piece] = match &pieces[..] {
            [a, b] if is_right(a) && !is_right(b) => [a, b],
            [a, b] if is_right(b) && !is_right(a) => [b, a],
            _ => panic!("{split:?}: {} pieces", pieces.len()),
        };
        for pair in &pairs {
            let [a, b, c, d] = pair.nodes;
            assert!(right_piece.contains(&a) && right_piece.contains(&b), "{split:?}");
            assert!(left_piece.contains(&c) && left_piece.contains(&d), "{split:?}");
            assert!(Vector3::from(pair.normal).cast::<f64>().dot(&normal) > 0.9999, "{split:?}");
            let [plus, _] = points(&mesh, &wound, pair);
            assert!(right(plus.cast()).abs() < 1e-7, "{split:?}");
        }
        // The sides of the block are 20 mm long.
        let whole = 0.02 * 0.02 / normal.x.abs();
        assert!((area(&pairs) / whole - 1.0).abs() < 1e-3, "{split:?}: {} of {whole}", area(&pairs));
        // Every severed edge of the body has a pair.
        let edges: BTreeSet<[u32; 2]> = pairs.iter().map(|pair| pair.edge).collect();
        let side = |v: u32| right(mesh.positions[v as usize].cast()) >= 0.0;
        let severed = mesh.edges.iter().filter(|[a, b]| side(*a) != side(*b)).count();
        assert_eq!((edges.len(), pairs.len()), (severed, severed), "{split:?}");
    }
}

/// A blade along lattice points leaves no tissue of the tets on one side. The pairs then join the
/// copies with the whole tets behind the blade.
#[test]
fn pairs_of_a_blade_on_lattice_points_share_its_area() {
    for split in SPLITS {
        let mesh = block([6, 4, 4], split);
        let at = f64::from(mesh.positions[3].x);
        for offset in [0.0, 1e-9, -1e-9, 1e-4] {
            let blade = plane([at + offset, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
            let (wound, pairs) = cut(&mesh, &[blade]);
            check_pairs(&mesh, &wound, &tets(&mesh, &wound), &pairs).unwrap();
            let whole = 0.016 * 0.02;
            assert!((area(&pairs) / whole - 1.0).abs() < 0.02, "{split:?} {offset}: {}", area(&pairs));
            assert!(pairs.iter().all(|pair| pair.normal[0] < -0.9999), "{split:?} {offset}");
        }
    }
}

/// Nothing is paired before a cut begins or ahead of its tip, and pairs stay when it grows.
#[test]
fn pairs_come_behind_the_tip() {
    for split in SPLITS {
        let mesh = block([12, 8, 6], split);
        let path = [[-0.012, 0.0007, 0.015], [0.012, 0.0007, 0.015]];
        let (wound, growth) = grow(&mesh, &[blade(&path, [0.0, 0.0, -1.0], 0.012)]);
        assert_eq!(growth.lip_pairs(&[0.0]), []);
        let mut before = BTreeSet::new();
        for tip in [0.004, 0.008, 0.012, 0.018, 0.024] {
            let pairs = growth.lip_pairs(&[tip]);
            check_pairs(&mesh, &wound, &tets(&mesh, &wound), &pairs).unwrap();
            let edges: BTreeSet<[u32; 2]> = pairs.iter().map(|pair| pair.edge).collect();
            assert!(edges.is_superset(&before) && edges.len() > before.len(), "{split:?}");
            before = edges;
            // The border is blurred over a step.
            let farthest = pairs.iter().map(|pair| points(&mesh, &wound, pair)[0].x).fold(-1.0, f32::max);
            assert!(f64::from(farthest) < -0.012 + tip + 0.004, "{split:?}: {farthest} at {tip}");
        }
    }
}

/// Pairs of a growing cut depend only on how far it has come, and are those of a wound from
/// scratch, up to the names of the nodes.
fn check_growth(mesh: &TetMesh, random: &RandomBlades, share: f64) -> Result<(), TestCaseError> {
    let all = blades(random);
    let (wound, pairs) = cut(mesh, &all);
    check_pairs(mesh, &wound, &tets(mesh, &wound), &pairs)?;
    let (grown, growth) = grow(mesh, &all);
    let reached: Vec<f64> = growth.lengths().iter().map(|length| share * length).collect();
    check_pairs(mesh, &grown, &tets_at(mesh, &grown, &growth, &reached), &growth.lip_pairs(&reached))?;
    prop_assert_eq!(&growth.lip_pairs(&growth.lengths()), &pairs);

    let (grown, growth) = grow(mesh, &all[..1]);
    let reached = share * growth.lengths()[0];
    let part = growth.lip_pairs(&[reached]);
    check_pairs(mesh, &grown, &tets_at(mesh, &grown, &growth, &[reached]), &part)?;
    let mut severing = Severing::new(mesh);
    severing.add(mesh, &all[0]);
    severing.cut_to(0, reached);
    let scratch = severing.lip_pairs(mesh, &severing.wound(mesh).unwrap());
    prop_assert_eq!(part.len(), scratch.len());
    let mut names = HashMap::new();
    for (a, b) in part.iter().zip(&scratch) {
        prop_assert_eq!((a.edge, a.number, a.part), (b.edge, b.number, b.part));
        prop_assert!((a.area - b.area).abs() <= 1e-5 * a.area);
        prop_assert!(a.nodes.iter().zip(b.nodes).all(|(a, b)| *names.entry(*a).or_insert(b) == b));
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn pairs_of_random_cuts((mesh, random) in random_cut(), share in 0.0..1.0_f64) {
        check_growth(&mesh, &random, share)?;
    }
}
