//! The resampler.

use cutis_shaders::resample;

use crate::{assert_baseline, size_of_struct, validated};

/// Returns the name, the source and the entry points of each pass.
fn sources() -> [(&'static str, String, Vec<&'static str>); 6] {
    let walks = || vec![resample::WALK_ALL, resample::WALK_LARGE];
    [
        ("place", resample::place(), vec![resample::PLACE]),
        ("span", resample::span(), vec![resample::SPAN, resample::SPAN_REMOVED]),
        ("clear", resample::clear(), vec![resample::CLEAR]),
        ("claim", resample::claim(), walks()),
        ("vacate", resample::vacate(), walks()),
        ("gather", resample::gather(), vec![resample::GATHER]),
    ]
}

#[test]
fn every_pass_is_valid_and_has_its_entry_points() {
    for (name, source, entries) in sources() {
        assert_baseline(name, &source, &entries);
    }
}

#[test]
fn uniforms_are_whole_blocks_of_sixteen_bytes() {
    for (name, bytes) in [("Grid", 128), ("Slab", 32), ("Chunk", 16)] {
        assert_eq!(size_of_struct(&resample::claim(), name), bytes, "{name}");
    }
}

/// Control: invalid changes of a source are errors.
#[test]
fn invalid_changes_are_rejected() {
    let broken = |source: String, from: &str, to: &str| {
        assert!(source.contains(from), "{from}");
        validated(&source.replace(from, to)).is_err()
    };
    assert!(broken(resample::claim(), "tet.rounding", "tet.roundings"));
    assert!(broken(resample::gather(), "texture_3d<i32>", "texture_2d<i32>"));
    assert!(broken(resample::span(), "vec2u(0u, left)", "vec3u(0u, left)"));
}
