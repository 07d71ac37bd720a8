//! Cuts that grow: their elements at each stage, compared with wounds from scratch.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use cutis_mesh::sever::{Blade, Growth, Severing, Stage, Wound};
use cutis_mesh::{Split, TetMesh};
use nalgebra::Vector3;
use proptest::prelude::*;

use crate::sever::{RandomBlades, blade, blades, block, colors_are_valid, random_cut};

/// The finished wound of some blades, and its growth. The skin is the surface of the mesh.
fn grow(mesh: &TetMesh, blades: &[Blade]) -> (Wound, Growth) {
    let mut severing = Severing::new(mesh);
    blades.iter().for_each(|blade| {
        severing.add(mesh, blade);
    });
    severing.grow(mesh, &mesh.boundary()).unwrap()
}

/// The wound from scratch after blades have cut some share of their lengths.
fn from_scratch(mesh: &TetMesh, blades: &[Blade], share: f64) -> Wound {
    let mut severing = Severing::new(mesh);
    for blade in blades {
        let (number, _) = severing.add(mesh, blade);
        severing.cut_to(number, share * blade.length());
    }
    severing.wound(mesh).unwrap()
}

fn stage(growth: &Growth, share: f64) -> Stage {
    let reached: Vec<f64> = growth.lengths().iter().map(|length| share * length).collect();
    growth.stage(&reached)
}

/// Whether two lists of tuples have the same nodes up to their names.
fn same_up_to_names<'a>(pairs: impl Iterator<Item = (&'a [u32], &'a [u32])>) -> bool {
    let (mut forth, mut back) = (HashMap::new(), HashMap::new());
    pairs
        .flat_map(|(a, b)| a.iter().zip(b))
        .all(|(a, b)| *forth.entry(a).or_insert(b) == b && *back.entry(b).or_insert(a) == a)
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-5 * a.abs().max(b.abs()).max(1e-12)
}

/// What must hold at each stage: elements fill the body, have valid colors, and have no node that
/// follows another one.
fn check_stage(mesh: &TetMesh, wound: &Wound, stage: &Stage) -> Result<(), TestCaseError> {
    let mut divided = mesh.clone();
    divided.divide(wound);
    let colors: Vec<u16> = stage.tets.iter().map(|t| divided.tet_color(&t.nodes, t.number)).collect();
    let tets: Vec<[u32; 4]> = stage.tets.iter().map(|tet| tet.nodes).collect();
    prop_assert!(colors_are_valid(&tets, &colors));
    let colors: Vec<u16> = stage.edges.iter().map(|e| divided.edge_color(e.nodes, e.number)).collect();
    let edges: Vec<[u32; 2]> = stage.edges.iter().map(|edge| edge.nodes).collect();
    prop_assert!(colors_are_valid(&edges, &colors));
    let mut of_tet: BTreeMap<u32, f64> = BTreeMap::new();
    stage.tets.iter().for_each(|tet| *of_tet.entry(tet.tet).or_default() += f64::from(tet.share));
    prop_assert!(of_tet.keys().copied().eq(wound.split.iter().map(|split| split.tet)));
    prop_assert!(of_tet.values().all(|share| near(*share, 1.0)), "{of_tet:?}");
    let mut of_triangle: BTreeMap<u32, f64> = BTreeMap::new();
    for triangle in &stage.triangles {
        *of_triangle.entry(triangle.triangle).or_default() += f64::from(triangle.share);
    }
    prop_assert!(of_triangle.values().all(|share| near(*share, 1.0)), "{of_triangle:?}");
    let volume = |edges: &[cutis_mesh::sever::EdgeCopy]| -> f64 {
        edges.iter().map(|edge| f64::from(edge.volume)).sum()
    };
    prop_assert!(near(volume(&stage.edges), volume(&wound.edges)));
    let follow: BTreeSet<u32> = stage.follows.iter().map(|[node, _]| *node).collect();
    let triangles = stage.triangles.iter().flat_map(|triangle| &triangle.nodes);
    let mut used = tets.iter().flatten().chain(edges.iter().flatten()).chain(triangles);
    prop_assert!(used.all(|node| !follow.contains(node)));
    // A node follows one at the same place, with a lower number.
    let place = |node: u32| divided.lattice_index[node as usize];
    prop_assert!(stage.follows.iter().all(|&[node, of]| of < node && place(of) == place(node)));
    Ok(())
}

/// With one blade each stage is the wound from scratch, up to the names of the nodes.
fn check_one_blade(mesh: &TetMesh, blades: &[Blade], share: f64) -> Result<(), TestCaseError> {
    let (wound, growth) = grow(mesh, blades);
    let stage = stage(&growth, share);
    check_stage(mesh, &wound, &stage)?;
    let scratch = from_scratch(mesh, blades, share);
    let cut: BTreeSet<u32> = scratch.split.iter().map(|split| split.tet).collect();
    let grown: Vec<_> = stage.tets.iter().filter(|tet| !tet.whole || tet.share < 1.0).collect();
    prop_assert_eq!(grown.len(), scratch.copies.len());
    for (grown, scratch) in grown.iter().zip(&scratch.copies) {
        prop_assert_eq!(grown.tet, scratch.tet);
        prop_assert!(near(f64::from(grown.share), f64::from(scratch.share)));
    }
    let of_copies = grown.iter().zip(&scratch.copies).map(|(a, b)| (&a.nodes[..], &b.nodes[..]));
    let whole = stage.tets.iter().filter(|tet| !cut.contains(&tet.tet));
    let of_whole = whole.map(|tet| (&tet.nodes[..], &mesh.tets[tet.tet as usize][..]));
    prop_assert!(same_up_to_names(of_copies.chain(of_whole)));
    // Nodes only come apart.
    let follow = |stage: &Stage| -> BTreeSet<u32> { stage.follows.iter().map(|[node, _]| *node).collect() };
    let later = growth.stage(&[growth.lengths()[0] * (0.5 + 0.5 * share)]);
    prop_assert!(follow(&later).is_subset(&follow(&stage)));
    Ok(())
}

fn check_growth(mesh: &TetMesh, random: &RandomBlades, share: f64) -> Result<(), TestCaseError> {
    let blades = blades(random);
    check_one_blade(mesh, &blades[..1], share)?;
    let (wound, growth) = grow(mesh, &blades);
    // Before it begins, nothing is cut.
    let start = stage(&growth, 0.0);
    check_stage(mesh, &wound, &start)?;
    prop_assert!(start.tets.iter().all(|tet| tet.whole && tet.nodes == mesh.tets[tet.tet as usize]));
    prop_assert!(start.edges.iter().map(|edge| edge.nodes).eq(wound.split_edges.iter().copied()));
    // At the end it is the finished wound.
    let end = stage(&growth, 1.0);
    prop_assert_eq!(&end.follows, &Vec::<[u32; 2]>::new());
    prop_assert_eq!(&end.tets, &wound.copies);
    prop_assert_eq!(end.edges.len(), wound.edges.len());
    for (a, b) in end.edges.iter().zip(&wound.edges) {
        prop_assert!((a.nodes, a.number) == (b.nodes, b.number) && near(a.volume.into(), b.volume.into()));
    }
    let skin = wound.skin(mesh, &mesh.boundary());
    let nodes = |copies: &[cutis_mesh::sever::TriangleCopy]| -> Vec<_> {
        copies.iter().map(|copy| (copy.nodes, copy.part, copy.share)).collect()
    };
    prop_assert_eq!(nodes(&end.triangles), nodes(&skin));
    // In between it is a body.
    check_stage(mesh, &wound, &stage(&growth, share))?;
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn random_cuts_grow_through_valid_stages((mesh, random) in random_cut(), share in 0.0..1.0_f64) {
        check_growth(&mesh, &random, share)?;
    }

    #[test]
    fn virtual_nodes_come_apart_from_their_vertices((mesh, random) in random_cut()) {
        check_virtual_nodes(&mesh, &random)?;
    }
}

/// Two nodes that a cut will separate are one until it reaches them.
#[test]
fn nodes_come_apart_behind_the_tip() {
    for split in [Split::Kuhn6, Split::Five] {
        let mesh = block([12, 8, 6], split);
        let path = [[-0.012, 0.0007, 0.015], [0.012, 0.0007, 0.015]];
        let (wound, growth) = grow(&mesh, &[blade(&path, [0.0, 0.0, -1.0], 0.012)]);
        assert!(!wound.virtual_nodes.is_empty());
        let tip = 0.012;
        let stage = growth.stage(&[tip]);
        let first = mesh.positions.len() as u32;
        let x =
            |node: u32| f64::from(mesh.positions[wound.virtual_nodes[(node - first) as usize] as usize].x);
        let follow: BTreeSet<u32> = stage.follows.iter().map(|[node, _]| *node).collect();
        let all = first..first + wound.virtual_nodes.len() as u32;
        let (behind, ahead): (Vec<u32>, Vec<u32>) = all.partition(|&node| x(node) < -0.012 + tip);
        assert!(behind.iter().any(|node| !follow.contains(node)), "{split:?}");
        assert!(ahead.iter().filter(|&&node| x(node) > 0.006).all(|node| follow.contains(node)));
    }
}

/// Virtual nodes for a model that moves only vertices of the mesh: at each stage those that no
/// blade has separated are with the vertices at their places, and the others follow vertices on
/// their side.
fn check_virtual_nodes(mesh: &TetMesh, random: &RandomBlades) -> Result<(), TestCaseError> {
    let blades = &blades(random)[..1];
    let (wound, growth) = grow(mesh, blades);
    let first = mesh.positions.len() as u32;
    for step in 0..=10 {
        let reached = growth.lengths()[0] * f64::from(step) / 10.0;
        let nodes = growth.virtual_nodes(&[reached]);
        prop_assert!(nodes.iter().map(|node| node.node).eq(first..first + wound.virtual_nodes.len() as u32));
        prop_assert!(nodes.iter().map(|node| node.vertex).eq(wound.virtual_nodes.iter().copied()));
        let stage = growth.stage(&[reached]);
        let with_real: BTreeSet<u32> =
            stage.follows.iter().filter(|[_, of]| *of < first).map(|[node, _]| *node).collect();
        for node in &nodes {
            prop_assert_eq!(node.share == 0.0, with_real.contains(&node.node));
            prop_assert_eq!(node.share == 0.0, node.own_side.is_empty());
            prop_assert!((0.0..=1.0).contains(&node.share), "{}", node.share);
            // The copies with the node have these vertices.
            let root = stage.follows.iter().find(|[n, _]| *n == node.node).map_or(node.node, |[_, of]| *of);
            let copies = stage.tets.iter().filter(|copy| !copy.whole && copy.nodes.contains(&root));
            let around: BTreeSet<u32> = copies.flat_map(|copy| copy.nodes).collect();
            prop_assert!(node.own_side.iter().all(|v| *v < first && around.contains(v)));
            prop_assert!(!node.own_side.contains(&node.vertex));
            // All are on the side of the blade on which the vertex of the node is not.
            let severed = |&v: &u32| {
                wound.split.iter().any(|split| {
                    let corners = &mesh.tets[split.tet as usize];
                    let of = |v: u32| corners.iter().position(|&c| c == v).map(|n| split.parts[n]);
                    of(v).zip(of(node.vertex)).is_some_and(|(a, b)| a != b)
                })
            };
            prop_assert!(node.own_side.iter().all(severed));
        }
    }
    // Edges along the axes are those that the blade crosses, in its order.
    let edges = &growth.axis_edges()[0];
    prop_assert!(edges.is_sorted_by(|a, b| a.at <= b.at));
    let all: BTreeSet<[u32; 2]> = mesh.edges.iter().copied().collect();
    for edge in edges {
        let [p, q] = edge.ends.map(|v| mesh.point(v));
        let apart: usize = (0..3).map(|axis| p[axis].abs_diff(q[axis])).sum();
        prop_assert!(apart == 1 && all.contains(&edge.ends), "{edge:?}");
        prop_assert!((0.0..=growth.lengths()[0]).contains(&edge.at));
    }
    Ok(())
}

/// A node moves with the vertex at its place, then in part, then with its own side. If all vertices
/// move alike by whole steps of a chain, it does too, exactly. It comes apart without a jump.
#[test]
fn a_virtual_node_moves_with_its_own_side() {
    let mesh = block([12, 8, 6], Split::Kuhn6);
    let path = [[-0.012, 0.0007, 0.015], [0.012, 0.0007, 0.015]];
    let (_, growth) = grow(&mesh, &[blade(&path, [0.0, 0.0, -1.0], 0.012)]);
    assert!(growth.axis_edges()[0].len() > 10);
    let left = |v: u32| mesh.positions[v as usize].y < 0.0007;
    let of = |left: bool| if left { Vector3::new(0.0, -1.0, 0.25) } else { Vector3::zeros() };
    let by = |v: u32| of(left(v));
    let (mut whole, mut in_part) = (0, 0);
    let mut before = vec![0.0; growth.virtual_nodes(&[0.0]).len()];
    for step in 0..=240 {
        let reached = 1e-4 * f64::from(step);
        for (node, before) in growth.virtual_nodes(&[reached]).into_iter().zip(&mut before) {
            // Shares below 1 % and above 99 % count as 0 and as 1. A border is as wide as a step of
            // 3 mm, so that a share grows by at most a thirtieth here.
            let grown = node.share - *before;
            assert!((-1e-12..0.06).contains(&grown), "{grown} at {reached}");
            *before = node.share;
            let expected = by(node.vertex).lerp(&of(!left(node.vertex)), node.share);
            assert!((node.displacement(by) - expected).norm() < 1e-12, "{node:?}");
            let alike = Vector3::new(0.5, 3.25, -0.125);
            assert_eq!(node.displacement(|_| alike), alike);
            whole += usize::from(node.share == 1.0);
            in_part += usize::from(node.share > 0.0 && node.share < 1.0);
        }
        assert!(step > 0 || whole + in_part == 0, "{whole} {in_part}");
    }
    assert!(whole > 10 && in_part > 10, "{whole} {in_part}");
}
