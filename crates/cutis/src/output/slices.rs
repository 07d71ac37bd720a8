//! Slices of the CT in the three planes of the patient, before and after, for the report.

use cutis_mesh::Frame;
use cutis_render::{Contour, Plane, Rgb, SliceView, slice};
use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use super::pictures::EDGE_GRAY;
use super::wound_place::{WoundPlace, position};
use crate::Error;

/// Pixels along the longer side of a slice: the first of these with which all slices together have
/// no more than [`MOST_BYTES`]. Six slices of 200 × 200 pixels have at most 0.73 MB.
const PIXELS: [usize; 4] = [600, 450, 300, 200];

/// Bytes of all slices.
const MOST_BYTES: usize = 1_800_000;

/// One plane, before and after.
pub(crate) struct SlicePair {
    pub(crate) plane: Plane,
    /// Position along the normal of the plane, world mm.
    pub(crate) at_mm: f64,
    /// PNG files of the slice before and after.
    pub(crate) png: [Vec<u8>; 2],
}

/// A skin in local meters: positions and triangles.
pub(super) type Skin<'a> = (&'a [Point3<f32>], &'a [[u32; 3]]);

/// Slices through the wound, or through the middle of the body. `volumes` and `skins` are those
/// before and after. The skins are drawn as lines.
///
/// # Errors
/// The errors of the renderer.
pub(super) fn pairs(
    volumes: [&Volume; 2],
    skins: [Skin<'_>; 2],
    colors: [Rgb; 2],
    frame: &Frame,
    place: Option<&WoundPlace>,
) -> Result<Vec<SlicePair>, Error> {
    let through_mm = place.map_or(frame.origin_mm.into(), |place| place.inside_mm);
    let mut pairs = Vec::new();
    for pixels in PIXELS {
        pairs = of_size(pixels, through_mm, volumes, skins, colors, frame, place)?;
        let bytes: usize = pairs.iter().flat_map(|pair| &pair.png).map(Vec::len).sum();
        if bytes <= MOST_BYTES {
            break;
        }
    }
    Ok(pairs)
}

fn of_size(
    pixels: usize,
    through_mm: [f64; 3],
    volumes: [&Volume; 2],
    skins: [Skin<'_>; 2],
    colors: [Rgb; 2],
    frame: &Frame,
    place: Option<&WoundPlace>,
) -> Result<Vec<SlicePair>, Error> {
    let draw = |plane: Plane, n: usize| {
        let (positions, triangles) = skins[n];
        let contour = Contour { origin_mm: frame.origin_mm, positions, triangles, color: colors[n] };
        let view = SliceView {
            contours: &[contour],
            focus: place.map(|place| place.slice),
            edge_gray: EDGE_GRAY,
            long_side: Some(pixels),
            ..SliceView::new(plane, position(plane, through_mm))
        };
        Ok::<_, Error>(slice(volumes[n], &view)?.to_png()?)
    };
    let pair = |plane| {
        let (before, after) = rayon::join(|| draw(plane, 0), || draw(plane, 1));
        Ok(SlicePair { plane, at_mm: position(plane, through_mm), png: [before?, after?] })
    };
    [Plane::Axial, Plane::Coronal, Plane::Sagittal].into_par_iter().map(pair).collect()
}
