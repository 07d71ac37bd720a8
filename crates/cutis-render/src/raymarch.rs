//! Orthographic ray marching of the iso-surface.

use cutis_volume::Volume;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::annotate::{annotate, frame};
use crate::blocks::Blocks;
use crate::field::Field;
use crate::shade::{BACKGROUND, Shader, encode};
use crate::{Axes, Image, RenderError, View};

/// Length of a step in voxels, along the index axis in which it moves most.
const STEP: f64 = 0.5;
/// Halvings of the step in which the surface lies.
const HALVINGS: usize = 6;
/// Difference between neighbouring pixels that calls for more rays.
const EDGE: u8 = 12;

/// Where a ray met the surface.
pub struct Hit {
    /// Continuous index.
    pub index: Point3<f64>,
    /// True if the ray began inside: at a face of the volume or of a clip plane.
    pub on_cut: bool,
}

/// The picture of a volume's surface.
///
/// # Errors
/// [`RenderError::ImageSize`], [`RenderError::Setting`] with the key.
pub fn raymarch(volume: &Volume, view: &View<'_>) -> Result<Image, RenderError> {
    view.validate()?;
    let field = Field::new(volume);
    let mut image = Image::new(view.width, view.height, BACKGROUND)?;
    let axes = Axes::new(view.side)?;
    let (centre, pixel_mm) = frame(&axes, &field.corners_mm(), view.focus, [view.width, view.height]);
    let marcher = Marcher::new(&field, view, &axes);
    let shader = Shader::new(&field, view, &axes);
    // The light at a point of the picture, in pixels from its top left corner.
    let light = |x: f64, y: f64| {
        let u = (x - view.width as f64 / 2.0) * pixel_mm;
        let v = (view.height as f64 / 2.0 - y) * pixel_mm;
        let hit = marcher.cast(centre + axes.right * u + axes.up * v);
        hit.map_or_else(|| shader.background(), |hit| shader.color(&hit))
    };
    let row_bytes = 3 * view.width;
    image.rgb.par_chunks_mut(row_bytes).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
            pixel.copy_from_slice(&encode(light(x as f64 + 0.5, y as f64 + 0.5)));
        }
    });
    if view.samples > 1 {
        // More rays where the picture has an edge: elsewhere they would find the same.
        let first = image.rgb.clone();
        image.rgb.par_chunks_mut(row_bytes).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                if on_edge(&first, [view.width, view.height], x, y) {
                    let place =
                        |at: usize, part: usize| at as f64 + (part as f64 + 0.5) / view.samples as f64;
                    let count = view.samples * view.samples;
                    let sum: Vector3<f32> = (0..count)
                        .map(|sample| light(place(x, sample % view.samples), place(y, sample / view.samples)))
                        .sum();
                    pixel.copy_from_slice(&encode(sum / count as f32));
                }
            }
        });
    }
    if view.annotate {
        annotate(&mut image, &axes, pixel_mm);
    }
    Ok(image)
}

/// True if a neighbour's colour differs by more than [`EDGE`] in a channel.
fn on_edge(rgb: &[u8], [width, height]: [usize; 2], x: usize, y: usize) -> bool {
    let pixel = |x: usize, y: usize| &rgb[3 * (y * width + x)..][..3];
    let differs =
        |x: usize, y: usize, other: &[u8]| pixel(x, y).iter().zip(other).any(|(a, b)| a.abs_diff(*b) > EDGE);
    let here = pixel(x, y);
    (x > 0 && differs(x - 1, y, here))
        || (x + 1 < width && differs(x + 1, y, here))
        || (y > 0 && differs(x, y - 1, here))
        || (y + 1 < height && differs(x, y + 1, here))
}

/// Rays of one direction through one field.
struct Marcher<'a> {
    field: &'a Field<'a>,
    blocks: Blocks,
    threshold_hu: f32,
    /// Index per step.
    step: Vector3<f64>,
    /// Planes in index space: kept where `normal · index ≥ offset`.
    planes: Vec<(Vector3<f64>, f64)>,
}

impl<'a> Marcher<'a> {
    fn new(field: &'a Field<'a>, view: &View<'_>, axes: &Axes) -> Self {
        let per_mm = field.index_per_mm() * -axes.toward;
        let step = per_mm * (STEP / per_mm.amax());
        let mut planes = Vec::new();
        for axis in 0..3 {
            let mut normal = Vector3::zeros();
            normal[axis] = 1.0;
            planes.push((normal, 0.0));
            planes.push((-normal, -(field.shape()[axis] as f64 - 1.0)));
        }
        for clip in view.clip {
            // A plane of world space is one of index space: n · to_mm(x) = n·to_mm(0) + (Aᵀn) · x.
            let keep = Vector3::from(clip.keep);
            let zero = field.to_mm(Point3::origin());
            let normal = Vector3::from_fn(|axis, _| {
                let mut one = Point3::origin();
                one[axis] = 1.0;
                keep.dot(&(field.to_mm(one) - zero))
            });
            planes.push((normal, keep.dot(&(Point3::from(clip.point_mm) - zero))));
        }
        let blocks = Blocks::new(field, view.threshold_hu);
        Self { field, blocks, threshold_hu: view.threshold_hu, step, planes }
    }

    /// First point of the ray through `through_mm` that is at or above the threshold.
    fn cast(&self, through_mm: Point3<f64>) -> Option<Hit> {
        let origin = self.field.to_index(through_mm);
        let (mut start, mut end) = (f64::NEG_INFINITY, f64::INFINITY);
        for (normal, offset) in &self.planes {
            let rate = normal.dot(&self.step);
            let inside = normal.dot(&origin.coords) - offset;
            if rate > 0.0 {
                start = start.max(-inside / rate);
            } else if rate < 0.0 {
                end = end.min(-inside / rate);
            } else if inside < 0.0 {
                return None;
            }
        }
        if !(start <= end && (end - start).is_finite()) {
            return None;
        }
        let at = |n: f64| origin + self.step * (start + n);
        let length = end - start;
        let mut n = 0.0;
        while n <= length {
            if let Some(free) = self.blocks.skip(at(n), &self.step) {
                // The next sample behind the block's wall; the samples stay a step apart.
                n = (n + free).floor().max(n) + 1.0;
                continue;
            }
            if self.field.at(at(n)) >= self.threshold_hu {
                return Some(Hit { index: at(self.refine(&at, n)), on_cut: n == 0.0 });
            }
            n += 1.0;
        }
        None
    }

    /// The crossing within the step before `n`.
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
