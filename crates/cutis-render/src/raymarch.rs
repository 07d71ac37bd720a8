//! Orthographic ray marching of the iso-surface.

use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::annotate::annotate;
use crate::blocks::Blocks;
use crate::expose::{expose, first_spacing};
use crate::field::Field;
use crate::rays::{Ray, Rays};
use crate::shade::{BACKGROUND, Shader, decode};
use crate::{Axes, Image, RenderError, View};

/// Number of bisections of the step that contains the surface.
const HALVINGS: usize = 6;

/// The point where a ray meets the surface.
pub struct Hit {
    /// Continuous index.
    pub index: Point3<f64>,
    /// True if the ray begins inside, at a face of the volume.
    pub on_cut: bool,
}

/// Draws the surface of a volume.
///
/// # Errors
/// [`RenderError::ImageSize`], [`RenderError::Setting`].
pub fn raymarch(volume: &Volume, view: &View<'_>) -> Result<Image, RenderError> {
    view.validate()?;
    let mut image = Image::new(view.width, view.height, BACKGROUND)?;
    let axes = Axes::new(view.side)?;
    let field = Field::new(volume);
    let rays = Rays::new(&field, view, &axes);
    let marcher = Marcher::new(&field, &rays, view.threshold_hu);
    let shader = Shader::new(&field, view, &axes);
    let light = |&place: &[f64; 2]| {
        let hit = rays.through(place).and_then(|ray| marcher.cast(&ray));
        hit.map_or_else(|| decode(BACKGROUND), |hit| shader.color(&hit, &marcher.blocks))
    };
    let spacing = first_spacing(rays.pixel_mm, field.finest_mm());
    expose(&mut image, view.samples, spacing, |places| Ok(places.par_iter().map(light).collect()))?;
    if view.annotate {
        annotate(&mut image, &axes, rays.pixel_mm);
    }
    Ok(image)
}

/// Draws the orientation letters and the scale bar on a picture of [`raymarch`], as the view's
/// `annotate` would.
///
/// # Errors
/// [`RenderError::Setting`].
pub fn draw_annotations(image: &mut Image, volume: &Volume, view: &View<'_>) -> Result<(), RenderError> {
    view.validate()?;
    let (axes, field) = (Axes::new(view.side)?, Field::new(volume));
    annotate(image, &axes, Rays::new(&field, view, &axes).pixel_mm);
    Ok(())
}

/// Finds the surface along rays.
pub struct Marcher<'a> {
    field: &'a Field<'a>,
    rays: &'a Rays<'a>,
    blocks: Blocks,
    threshold_hu: f32,
}

impl<'a> Marcher<'a> {
    pub fn new(field: &'a Field<'a>, rays: &'a Rays<'a>, threshold_hu: f32) -> Self {
        Self { field, rays, blocks: Blocks::new(field, threshold_hu, &rays.bounds()), threshold_hu }
    }

    /// The first point of a ray at or above the threshold.
    pub fn cast(&self, ray: &Ray) -> Option<Hit> {
        let at = |n: f64| self.rays.at(ray, n);
        let mut n = 0.0;
        while n <= ray.length {
            if let Some(free) = self.blocks.skip(at(n), &self.rays.steps_per_index) {
                // The next sample behind the block. Samples stay one step apart.
                n += free.min(ray.length) as u32 as f64 + 1.0;
                continue;
            }
            if self.field.at(at(n)) >= self.threshold_hu {
                return Some(Hit { index: at(self.refine(&at, n)), on_cut: n == 0.0 });
            }
            n += 1.0;
        }
        None
    }

    /// The crossing of the threshold within the step before `n`.
    fn refine(&self, at: &impl Fn(f64) -> Point3<f64>, n: f64) -> f64 {
        if n == 0.0 {
            return 0.0;
        }
        let (mut outside, mut inside) = (n - 1.0, n);
        for _ in 0..HALVINGS {
            let middle = (outside + inside) / 2.0;
            if self.field.at(at(middle)) >= self.threshold_hu { inside = middle } else { outside = middle }
        }
        inside
    }
}
