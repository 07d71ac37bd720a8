//! The ray marcher.

use cutis_shaders::render::{self, Albedo};

use crate::{assert_baseline, size_of_struct, validated};

#[test]
fn every_source_is_valid_and_has_its_entry_point() {
    assert_baseline("blocks", &render::largest_per_block(), &[render::LARGEST_PER_BLOCK]);
    for albedo in [Albedo::Skin, Albedo::Wound] {
        assert_baseline(&format!("{albedo:?}"), &render::raymarch(albedo), &[render::RAYMARCH]);
    }
}

#[test]
fn the_view_has_the_stated_size() {
    let bytes = size_of_struct(&render::raymarch(Albedo::Skin), "View");
    assert_eq!(bytes as usize, render::VIEW_BYTES);
}

/// Control: a field that does not exist is an error.
#[test]
fn an_unknown_field_is_rejected() {
    let broken = render::raymarch(Albedo::Wound).replace("view.skin +", "view.skins +");
    assert!(validated(&broken).is_err());
}
