//! The relaxation of the ChainMail model.

use cutis_shaders::chainmail;

use crate::{assert_baseline, size_of_struct, validated};

#[test]
fn the_source_is_valid_and_has_its_entry_point() {
    assert_baseline("relax", &chainmail::relax(), &[chainmail::RELAX]);
}

#[test]
fn uniforms_are_whole_blocks_of_sixteen_bytes() {
    for (name, bytes) in [("Slab", 32), ("Half", 16)] {
        assert_eq!(size_of_struct(&chainmail::relax(), name), bytes, "{name}");
    }
}

#[test]
fn the_shader_has_the_same_number_of_words() {
    let source = chainmail::relax();
    let has = |text: String| assert!(source.contains(&text), "{text}");
    has(format!("const SWEEP: u32 = {}u;", chainmail::SWEEP_WORDS));
    has(format!("const HALVES: u32 = {}u;", chainmail::SWEEP_HALVES));
    has(format!("array<atomic<u32>, {}>", 2 * chainmail::SWEEP_WORDS));
}

/// Control: invalid changes of the source are errors.
#[test]
fn invalid_changes_are_rejected() {
    let broken = |from: &str, to: &str| {
        let source = chainmail::relax();
        assert!(source.contains(from), "{from}");
        validated(&source.replace(from, to)).is_err()
    };
    assert!(broken("bound.x, -bound.y", "bound.x, -bound.z"));
    assert!(broken("atomicLoad(&moved_here)", "moved_here"));
}
