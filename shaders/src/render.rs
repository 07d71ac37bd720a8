//! Ray marching: the largest HU per block of a volume, and the light along rays, with or without
//! wounds.

use crate::link;

const FIELD: &str = include_str!("../wgsl/render/field.wgsl");
const BLOCK: &str = include_str!("../wgsl/render/block.wgsl");

/// Name of the entry point of [`largest_per_block`].
pub const LARGEST_PER_BLOCK: &str = "largest_per_block";
/// Name of the entry point of [`raymarch`].
pub const RAYMARCH: &str = "raymarch";
/// Size in bytes of the uniform `View` that [`raymarch`] reads.
pub const VIEW_BYTES: usize = 848;

/// The color of surface points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Albedo {
    /// The whole surface is skin.
    Skin,
    /// Tissue by HU where the surface was deep inside the body, according to a depth volume at
    /// binding 6.
    Wound,
}

/// Returns the source that computes the largest HU of each block. Bindings of group 0: 0 the
/// volume, 1 its slope and intercept, 2 the blocks.
pub fn largest_per_block() -> String {
    link(&[FIELD, BLOCK, include_str!("../wgsl/render/largest.wgsl")])
}

/// Returns the source that computes the light along rays. Bindings of group 0: 0 and 1 as for
/// [`largest_per_block`], 2 the view, 3 the blocks, 4 the rays, 5 the results, and 6 the depth
/// volume for [`Albedo::Wound`].
pub fn raymarch(albedo: Albedo) -> String {
    let albedo = match albedo {
        Albedo::Skin => include_str!("../wgsl/render/skin.wgsl"),
        Albedo::Wound => include_str!("../wgsl/render/wound.wgsl"),
    };
    link(&[
        FIELD,
        BLOCK,
        include_str!("../wgsl/render/view.wgsl"),
        include_str!("../wgsl/render/march.wgsl"),
        albedo,
        include_str!("../wgsl/render/shade.wgsl"),
        include_str!("../wgsl/render/raymarch.wgsl"),
    ])
}
