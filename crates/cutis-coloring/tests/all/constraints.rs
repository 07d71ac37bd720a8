//! The greedy coloring of constraints equals first-fit by definition, and invalid lists are
//! refused.

use cutis_coloring::{ColoringError, Groups, greedy};
use proptest::prelude::*;

/// First-fit by its definition, in quadratic time: each constraint takes the lowest color that no
/// earlier neighbor has.
fn first_fit_by_definition<const N: usize>(constraints: &[[u32; N]]) -> Vec<usize> {
    let mut colors: Vec<usize> = Vec::new();
    for (i, a) in constraints.iter().enumerate() {
        let neighbors: Vec<usize> =
            (0..i).filter(|&j| constraints[j].iter().any(|v| a.contains(v))).map(|j| colors[j]).collect();
        let lowest = (0..=i).find(|color| !neighbors.contains(color));
        colors.push(lowest.expect("i earlier constraints cannot take i + 1 colors"));
    }
    colors
}

/// One color per constraint, from the groups.
fn colors_of(groups: &Groups) -> Vec<usize> {
    let mut colors = vec![usize::MAX; groups.order.len()];
    for (color, group) in groups.iter().enumerate() {
        for &i in group {
            colors[i as usize] = color;
        }
    }
    colors
}

fn check<const N: usize>(constraints: &[[u32; N]], vertex_count: usize) -> Groups {
    let groups = greedy(constraints, vertex_count).unwrap();
    groups.verify(constraints, vertex_count).unwrap();
    assert_eq!(colors_of(&groups), first_fit_by_definition(constraints));
    for group in groups.iter() {
        assert!(!group.is_empty() && group.is_sorted());
    }
    groups
}

/// Up to `len` constraints of `N` distinct vertices below `vertex_count`.
fn constraints<const N: usize>(vertex_count: u32, len: usize) -> impl Strategy<Value = Vec<[u32; N]>> {
    let distinct = |vertices: &[u32; N]| (1..N).all(|a| !vertices[..a].contains(&vertices[a]));
    let one = proptest::array::uniform::<_, N>(0..vertex_count).prop_filter("distinct vertices", distinct);
    prop::collection::vec(one, 0..len)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn edges_equal_first_fit(edges in constraints::<2>(40, 300)) {
        check(&edges, 40);
    }

    #[test]
    fn tets_equal_first_fit(tets in constraints::<4>(60, 200)) {
        check(&tets, 60);
    }

    /// Few vertices and many constraints need several rounds of 64 colors.
    #[test]
    fn crowded_triangles_equal_first_fit(triangles in constraints::<3>(6, 400)) {
        check(&triangles, 6);
    }

    #[test]
    fn five_vertices_equal_first_fit(constraints in constraints::<5>(30, 100)) {
        check(&constraints, 30);
    }

    /// Any list gives a result or a typed error, never a panic.
    #[test]
    fn any_list_gives_a_result_or_an_error(edges in prop::collection::vec(any::<[u32; 2]>(), 0..20), count in 0usize..50) {
        if let Ok(groups) = greedy(&edges, count) {
            groups.verify(&edges, count).unwrap();
        }
    }

    /// Any groups give a result or a typed error, never a panic. Groups that pass are a coloring.
    #[test]
    fn any_groups_give_a_result_or_an_error(
        order in prop::collection::vec(0u32..4, 0..5),
        offsets in prop::collection::vec(0u32..5, 0..5),
    ) {
        let edges = [[0, 1], [1, 2], [2, 3], [3, 0]];
        let groups = Groups { order, offsets };
        if groups.verify(&edges, 4).is_ok() {
            for group in groups.iter() {
                let mut vertices: Vec<u32> = group.iter().flat_map(|&i| edges[i as usize]).collect();
                vertices.sort_unstable();
                prop_assert!(vertices.windows(2).all(|pair| pair[0] != pair[1]));
            }
        }
    }
}

/// The edges of a star share the hub, so each needs its own color: below, at and above the 64
/// colors of a round.
#[test]
fn a_star_needs_a_color_per_edge() {
    for spokes in [63, 64, 65, 128, 129, 1000] {
        let edges: Vec<[u32; 2]> = (1..=spokes).map(|v| [0, v]).collect();
        let groups = check(&edges, spokes as usize + 1);
        assert_eq!(groups.len(), spokes as usize);
    }
}

/// A deferred constraint leaves its other vertices free for the constraints after it.
#[test]
fn a_deferred_constraint_takes_no_color_of_its_round() {
    let mut edges: Vec<[u32; 2]> = (1..=65).map(|v| [0, v]).collect();
    edges.push([65, 66]);
    let groups = check(&edges, 67);
    assert_eq!(colors_of(&groups)[65], 0);
}

#[test]
fn empty_lists_are_colored() {
    assert!(check::<2>(&[], 0).is_empty());
    assert!(check::<4>(&[], 100).is_empty());
    assert_eq!(greedy::<0>(&[[], []], 0).unwrap().group(0), [0, 1]);
    assert_eq!(check(&[[3], [3], [1]], 4).len(), 2);
}

#[test]
fn a_vertex_out_of_range_is_named() {
    let error = greedy(&[[0, 1], [1, 7]], 7).unwrap_err();
    assert_eq!(error, ColoringError::VertexOutOfRange { constraint: 1, vertex: 7, vertex_count: 7 });
    assert!(error.to_string().contains("constraint 1 names vertex 7"));
}

#[test]
fn a_repeated_vertex_is_named() {
    let error = greedy(&[[0, 1, 2], [2, 1, 2]], 3).unwrap_err();
    assert_eq!(error, ColoringError::RepeatedVertex { constraint: 1, vertex: 2 });
}

/// A list of empty arrays needs no memory for any length.
#[test]
fn too_many_constraints_are_refused_before_allocating() {
    let many = vec![[0u32; 0]; u32::MAX as usize + 1];
    assert!(matches!(greedy(&many, 0), Err(ColoringError::TooManyConstraints { .. })));
}

#[test]
fn too_many_vertices_are_refused_before_allocating() {
    assert!(matches!(greedy(&[[0, 1]], usize::MAX), Err(ColoringError::TooManyVertices { .. })));
}

#[test]
fn verify_names_the_clash() {
    let edges = [[0, 1], [2, 3], [4, 5], [3, 6]];
    let groups = Groups::from_colors(&[0, 0, 0, 0]).unwrap();
    let clash = ColoringError::Clash { group: 0, first: 1, second: 3, vertex: 3 };
    assert_eq!(groups.verify(&edges, 7), Err(clash));
    let groups = Groups::from_colors(&[0, 0, 0, 1]).unwrap();
    assert_eq!(groups.verify(&edges, 7), Ok(()));
    // The first constraint of a later group clashes with the next one, not with the previous group.
    let groups = Groups::from_colors(&[0, 1, 0, 1]).unwrap();
    let clash = ColoringError::Clash { group: 1, first: 1, second: 3, vertex: 3 };
    assert_eq!(groups.verify(&edges, 7), Err(clash));
}

#[test]
fn verify_refuses_invalid_groups() {
    let edges = [[0, 1], [2, 3], [1, 2]];
    let verify = |order: &[u32], offsets: &[u32]| {
        Groups { order: order.to_vec(), offsets: offsets.to_vec() }.verify(&edges, 4)
    };
    assert_eq!(verify(&[0, 1, 2], &[0, 2, 3]), Ok(()));
    assert_eq!(verify(&[0, 1], &[0, 2]), Err(ColoringError::WrongLength { order_len: 2, count: 3 }));
    for (offsets, position) in
        [(&[1, 2, 3][..], 0), (&[0, 3, 2, 3], 2), (&[0, 2], 1), (&[0, 2, 4], 2), (&[], 0)]
    {
        let broken = ColoringError::BrokenOffsets { position, order_len: 3 };
        assert_eq!(verify(&[0, 1, 2], offsets), Err(broken));
    }
    for (order, position) in [([0, 1, 1], 2), ([0, 9, 2], 1)] {
        let constraint = order[position];
        let twice = ColoringError::NotAPermutation { position, constraint, count: 3 };
        assert_eq!(verify(&order, &[0, 2, 3]), Err(twice));
    }
    let groups = Groups::from_colors(&[0, 0, 1]).unwrap();
    assert!(matches!(groups.verify(&edges, 3), Err(ColoringError::VertexOutOfRange { vertex: 3, .. })));
    assert!(matches!(
        groups.verify(&[[0, 1], [2, 2], [1, 2]], 4),
        Err(ColoringError::RepeatedVertex { vertex: 2, .. })
    ));
}
