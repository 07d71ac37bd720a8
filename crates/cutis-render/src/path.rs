//! Paths on the skin, such as those of cuts that are still closed, drawn on a picture of it.

use cutis_volume::Volume;
use nalgebra::Point3;

use crate::annotate::text_scale;
use crate::draw::Stroke;
use crate::field::Field;
use crate::legend::{Entry, draw_legend};
use crate::raymarch::Marcher;
use crate::rays::Rays;
use crate::{Axes, Image, RenderError, Rgb, View};

/// Thickness of a path, in font pixels.
const THICKNESS: f64 = 0.9;
/// Distance between the points at which a path is tested for being seen, pixels.
const SPACING: f64 = 2.0;
/// How far behind the skin of the picture a path may be to be seen, mm. The skin of a lattice is up
/// to a step below it.
const BEHIND_MM: f64 = 12.0;

/// Lines through points of the skin.
#[derive(Clone, Copy, Debug)]
pub struct SkinPaths<'a> {
    /// The points of each path, RAS+ mm.
    pub paths_mm: &'a [Vec<Point3<f64>>],
    /// Color of the lines.
    pub color: Rgb,
    /// Name of the lines in the legend at the bottom right; no legend if it is empty.
    pub label: &'a str,
}

/// Draws paths on a picture of the same volume and view ([`raymarch`](crate::raymarch) without
/// letters), then the legend if the view has letters. Where the body hides a path it is not drawn.
///
/// # Errors
/// [`RenderError::Setting`] for a setting of the view, or a picture of another size.
pub fn draw_paths(
    image: &mut Image,
    volume: &Volume,
    view: &View<'_>,
    paths: &SkinPaths<'_>,
) -> Result<(), RenderError> {
    view.validate()?;
    view.fits(image)?;
    let (axes, field) = (Axes::new(view.side)?, Field::new(volume));
    let rays = Rays::new(&field, view, &axes);
    let marcher = Marcher::new(&field, &rays, view.threshold_hu);
    let is_seen = |point: Point3<f64>| {
        let hit = rays.through(rays.pixel_of(point)).and_then(|ray| marcher.cast(&ray));
        hit.is_some_and(|hit| (field.to_mm(hit.index) - point).dot(&axes.toward) < BEHIND_MM)
    };
    let scale = text_scale(image);
    let thickness = THICKNESS * scale as f64;
    let mut stroke = Stroke::new(image, thickness);
    for pair in paths.paths_mm.iter().flat_map(|path| path.windows(2)) {
        let [from, to] = [pair[0], pair[1]];
        let pixels = (to - from).norm() / rays.pixel_mm;
        let parts = (pixels / SPACING).ceil().clamp(1.0, 1e4) as usize;
        let at = |n: usize| from + (to - from) * (n as f64 / parts as f64);
        for [from, to] in (0..parts).map(|n| [at(n), at(n + 1)]) {
            if is_seen(nalgebra::center(&from, &to)) {
                let [from, to] = [from, to].map(|point| rays.pixel_of(point).map(|c| c - 0.5));
                stroke.segment(from, to, 1.0);
            }
        }
    }
    stroke.draw(image, paths.color);
    if view.annotate {
        let entry = Entry { color: paths.color, opacity: 1.0, thickness, label: paths.label };
        draw_legend(image, &entry, scale);
    }
    Ok(())
}
