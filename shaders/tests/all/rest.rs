//! The equations of a search for the state of rest.

use cutis_shaders::rest::{self, Unknowns};

use crate::{assert_baseline, size_of_struct, validated};

const BOTH: [Unknowns; 2] = [Unknowns::Three, Unknowns::Six];

#[test]
fn every_source_is_valid_and_has_its_entry_points() {
    for rows in BOTH {
        let stages = [rest::START, rest::FIRST, rest::SECOND, rest::THIRD, rest::PRODUCT];
        let of_patches = [rest::GATHER, rest::SCATTER, rest::RESIDUAL];
        let stages = [&stages[..], &of_patches].concat();
        assert_baseline(&format!("smooth {rows:?}"), &rest::smooth(rows), &stages);
        for columns in BOTH {
            let source = rest::transfer(rows, columns);
            assert_baseline(&format!("{rows:?} by {columns:?}"), &source, &[rest::RESTRICT, rest::PROLONG]);
        }
    }
    assert_baseline("dense", &rest::dense(), &[rest::TIMES]);
    let steps = [rest::BEGIN, rest::ADVANCE, rest::MEASURE, rest::TURN];
    assert_baseline("vectors", &rest::vectors(), &steps);
}

#[test]
fn uniforms_are_whole_blocks_of_sixteen_bytes() {
    let smooth = rest::smooth(Unknowns::Six);
    let (dense, vectors) = (rest::dense(), rest::vectors());
    let found = [(&smooth, "Chunk"), (&smooth, "Factors"), (&dense, "Dense"), (&vectors, "Factor")];
    for (source, name) in found {
        assert_eq!(size_of_struct(source, name), 16, "{name}");
    }
}

#[test]
fn the_shaders_have_the_same_constants() {
    for unknowns in BOTH {
        let source = rest::smooth(unknowns);
        let has = |text: String| assert!(source.contains(&text), "{text}");
        has(format!("const ROW_UNKNOWNS: u32 = {}u;", unknowns.count()));
        has(format!("const ROW_LANES: u32 = {}u;", unknowns.lanes()));
        has(format!("const COLUMN_UNKNOWNS: u32 = {}u;", unknowns.count()));
    }
    let of_thread = format!("const NODES_OF_THREAD: u32 = {}u;", rest::NODES / 64);
    assert!(rest::vectors().contains(&of_thread), "{of_thread}");
}

/// Control: invalid changes of a source are errors.
#[test]
fn invalid_changes_are_rejected() {
    let broken = |source: String, from: &str, to: &str| {
        assert!(source.contains(from), "{from}");
        validated(&source.replace(from, to)).is_err()
    };
    assert!(broken(rest::smooth(Unknowns::Three), "x[node].xyz", "x[node].xy"));
    assert!(broken(rest::smooth(Unknowns::Six), "place.slice", "place.slices"));
    assert!(broken(rest::vectors(), "shares[group] = sums[0]", "shares[group] = 0.0"));
}
