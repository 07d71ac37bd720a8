//! Lines along a field of directions on a surface, drawn on a picture of the surface.

mod evenly_spaced;
mod visible;

use cutis_volume::Volume;
use nalgebra::Point3;

use crate::annotate::{annotate, text_scale};
use crate::contour::check_corners;
use crate::draw::Stroke;
use crate::field::Field;
use crate::legend::{Entry, draw_legend};
use crate::rays::Rays;
use crate::{Axes, Image, RenderError, Rgb, View};
use evenly_spaced::{LinePoint, evenly_spaced};
use visible::VisibleField;

/// Distance between neighboring lines, in font pixels.
const SPACING: f64 = 9.0;
/// Thickness of a line, in font pixels.
const THICKNESS: f64 = 0.75;
/// Opacity of a line where the weight is 1.
const OPACITY: f32 = 0.85;

/// Directions on a triangle surface. Positions are in local meters: `world_mm = origin_mm + 1000 ·
/// local`.
#[derive(Clone, Copy, Debug)]
pub struct LineField<'a> {
    /// World position of the surface's local origin, mm, RAS+.
    pub origin_mm: Point3<f64>,
    /// Positions of the vertices in local meters.
    pub positions: &'a [Point3<f32>],
    /// Corners of the triangles, counterclockwise as seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Unit vectors along the lines, one per triangle, RAS+. The sign has no meaning.
    pub directions: &'a [[f32; 3]],
    /// How much each direction counts, from 0 (no line is drawn) to 1, one per triangle.
    pub weights: &'a [f32],
    /// Color of the lines.
    pub color: Rgb,
    /// Name of the lines in the legend at the bottom right; no legend if it is empty.
    pub label: &'a str,
}

/// Draws evenly spaced lines along a field of directions on a picture of the same volume and view
/// ([`raymarch`](crate::raymarch) without letters), then the legend, letters and scale bar if the
/// view has them.
///
/// A line appears where the surface of the field lies at the surface of the volume that the view
/// shows: it ends where the body hides it and where the volume is open. With [`View::depth`] no
/// line crosses tissue that was below the skin. A line is as opaque as its weight. The work is
/// done on the CPU, and the bits do not depend on the number of threads.
///
/// # Errors
/// [`RenderError::Setting`] for a setting of the view, or a picture of another size.
/// [`RenderError::VertexOutOfRange`] and [`RenderError::FieldLength`] for a field that is not
/// consistent.
pub fn draw_lines(
    image: &mut Image,
    volume: &Volume,
    view: &View<'_>,
    lines: &LineField<'_>,
) -> Result<(), RenderError> {
    view.validate()?;
    lines.validate()?;
    view.fits(image)?;
    let axes = Axes::new(view.side)?;
    let field = Field::new(volume);
    let rays = Rays::new(&field, view, &axes);
    let scale = text_scale(image);
    let visible = VisibleField::new(&field, &rays, view, &axes, lines, scale as f64);
    let size = [image.width, image.height].map(|length| length as f64);
    let mut stroke = Stroke::new(image, THICKNESS * scale as f64);
    for line in evenly_spaced(|place| visible.at(place), size, SPACING * scale as f64) {
        for pair in line.windows(2) {
            let [from, to] = [&pair[0], &pair[1]].map(|LinePoint { place, .. }| place.map(|c| c - 0.5));
            stroke.segment(from, to, (pair[0].opacity + pair[1].opacity) / 2.0 * OPACITY);
        }
    }
    stroke.draw(image, lines.color);
    if view.annotate {
        let thickness = THICKNESS * scale as f64;
        let entry = Entry { color: lines.color, opacity: OPACITY, thickness, label: lines.label };
        draw_legend(image, &entry, scale);
        annotate(image, &axes, rays.pixel_mm);
    }
    Ok(())
}

impl LineField<'_> {
    fn validate(&self) -> Result<(), RenderError> {
        check_corners(0, self.triangles, self.positions.len())?;
        let expected = self.triangles.len();
        for (array, found) in [("directions", self.directions.len()), ("weights", self.weights.len())] {
            if found != expected {
                return Err(RenderError::FieldLength { array, expected, found });
            }
        }
        Ok(())
    }
}
