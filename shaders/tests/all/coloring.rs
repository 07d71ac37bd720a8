//! The coloring of constraints.

use cutis_shaders::coloring::{
    CHOOSE, CLEAR_HIGHEST, CLEAR_MASKS, LEFT, MASK_COLORS, PROPOSE, RESUME, clear, color, priority,
};

use crate::{assert_baseline, size_of_struct, validated};

#[test]
fn the_sources_are_valid_and_have_their_entry_points() {
    assert_baseline("color", &color(), &[PROPOSE, CHOOSE, RESUME]);
    assert_baseline("clear", &clear(), &[CLEAR_HIGHEST, CLEAR_MASKS]);
    assert_eq!(size_of_struct(&color(), "Settings"), 16);
    let broken = color().replace("atomicLoad(&highest", "(highest");
    assert!(broken != color() && validated(&broken).is_err());
}

#[test]
fn the_shader_has_the_same_constants() {
    assert!(color().contains(&format!("const LEFT = {LEFT:#x}u;")));
    assert_eq!(MASK_COLORS, 4 * u32::BITS);
}

/// Both steps of the priority can be undone, so no two numbers share one.
#[test]
fn priorities_differ() {
    let mut all: Vec<u32> =
        (0..1 << 16).map(priority).chain((u32::MAX - 4096..=u32::MAX).map(priority)).collect();
    let count = all.len();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), count);
}
