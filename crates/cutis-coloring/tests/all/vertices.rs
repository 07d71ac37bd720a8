//! Greedy coloring of vertices is valid, skips fixed vertices, and invalid groups are refused.

use cutis_coloring::{ColoringError, Groups, Incidence, Tuples, greedy_vertices};
use proptest::prelude::*;

fn colored(edges: &[[u32; 2]], tets: &[[u32; 4]], moves: &[bool]) -> (Groups, Result<(), ColoringError>) {
    let kinds = [Tuples::of(edges), Tuples::of(tets)];
    let incidences = kinds.map(|kind| Incidence::new(kind, moves.len()).unwrap());
    let groups = greedy_vertices(&kinds, &incidences, moves).unwrap();
    let valid = groups.verify_vertices(&kinds, moves);
    (groups, valid)
}

#[test]
fn vertices_of_a_constraint_differ_and_fixed_ones_are_skipped() {
    let (groups, valid) =
        colored(&[[0, 1], [1, 2], [3, 4]], &[[1, 2, 3, 5]], &[true, true, true, true, false, true]);
    valid.unwrap();
    assert_eq!(groups.iter().collect::<Vec<_>>(), [[0, 2].as_slice(), &[1], &[3], &[5]]);
}

#[test]
fn more_than_64_colors_are_found() {
    let edges: Vec<[u32; 2]> = (0..70).flat_map(|b| (0..b).map(move |a| [a, b])).collect();
    let (groups, valid) = colored(&edges, &[], &[true; 70]);
    valid.unwrap();
    assert_eq!(groups.len(), 70);
}

#[test]
fn invalid_groups_are_refused() {
    let kinds = [Tuples::of(&[[0, 1], [1, 2]])];
    let moves = [true, true, true, false];
    let verify = |order: &[u32], offsets: &[u32]| {
        Groups { order: order.to_vec(), offsets: offsets.to_vec() }.verify_vertices(&kinds, &moves)
    };
    verify(&[0, 2, 1], &[0, 2, 3]).unwrap();
    let clash = ColoringError::VertexClash { group: 0, first: 1, second: 2, constraint: 1 };
    assert_eq!(verify(&[1, 2, 0], &[0, 2, 3]), Err(clash));
    assert_eq!(verify(&[0, 2], &[0, 2]), Err(ColoringError::WrongVertex { vertex: 1 }));
    assert_eq!(verify(&[0, 2, 1, 3], &[0, 2, 4]), Err(ColoringError::WrongVertex { vertex: 3 }));
    assert_eq!(verify(&[0, 2, 1, 1], &[0, 2, 3, 4]), Err(ColoringError::WrongVertex { vertex: 1 }));
    assert_eq!(verify(&[0, 2, 9], &[0, 2, 3]), Err(ColoringError::WrongVertex { vertex: 9 }));
    assert!(matches!(verify(&[0, 2, 1], &[0, 2]), Err(ColoringError::BrokenOffsets { .. })));
}

proptest! {
    #[test]
    fn any_body_is_colored_validly(
        tets in proptest::collection::vec(proptest::sample::subsequence((0u32..40).collect::<Vec<_>>(), 4), 0..80),
        moves in proptest::collection::vec(any::<bool>(), 40),
    ) {
        let tets: Vec<[u32; 4]> = tets.iter().map(|t| [t[3], t[0], t[2], t[1]]).collect();
        let (_, valid) = colored(&[], &tets, &moves);
        prop_assert_eq!(valid, Ok(()));
    }
}
