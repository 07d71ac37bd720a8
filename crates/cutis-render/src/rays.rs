//! The parallel rays of a picture, from where they enter the volume to where they leave it.

use nalgebra::{Point3, Vector3};

use crate::annotate::frame;
use crate::field::Field;
use crate::{Axes, View};

/// Length of a step in voxels, along the index axis of the fastest change.
const STEP: f64 = 0.5;

/// Parallel rays through a field.
pub struct Rays<'a> {
    field: &'a Field<'a>,
    axes: Axes,
    center_mm: Point3<f64>,
    /// Half the picture's width and height, pixels.
    half: [f64; 2],
    /// Size of a pixel, mm.
    pub pixel_mm: f64,
    /// Change of the index per step.
    pub step: Vector3<f64>,
    /// 1/`step`, and 0 where the step is 0.
    pub steps_per_index: Vector3<f64>,
    /// Faces of the volume in index space. A point is inside if `normal · index ≥ offset`.
    planes: Vec<(Vector3<f64>, f64)>,
    /// Upper limit of the steps of a ray.
    most: f64,
}

/// The part of a ray that is within the volume.
pub struct Ray {
    /// Continuous index in the plane of the picture's center.
    origin: Point3<f64>,
    /// Steps from there to the first sample.
    start: f64,
    /// Steps from the first sample to the end.
    pub length: f64,
}

impl<'a> Rays<'a> {
    pub fn new(field: &'a Field<'a>, view: &View<'_>, axes: &Axes) -> Self {
        let size = [view.width, view.height];
        let (center_mm, pixel_mm) = frame(axes, &field.corners_mm(), view.focus, size);
        let per_mm = field.index_per_mm() * -axes.toward;
        let step = per_mm * (STEP / per_mm.amax());
        let mut planes = Vec::new();
        for axis in 0..3 {
            let mut normal = Vector3::zeros();
            normal[axis] = 1.0;
            planes.push((normal, 0.0));
            planes.push((-normal, -(field.shape()[axis] as f64 - 1.0)));
        }
        let longest = field.shape().into_iter().max().unwrap_or(1);
        let half = size.map(|length| length as f64 / 2.0);
        let steps_per_index = step.map(|x| if x == 0.0 { 0.0 } else { 1.0 / x });
        let most = longest as f64 / STEP;
        Self { field, axes: *axes, center_mm, half, pixel_mm, step, steps_per_index, planes, most }
    }

    /// The ray through a position of the picture, in pixels from its top left corner. `None` if it
    /// misses the volume.
    pub fn through(&self, [x, y]: [f64; 2]) -> Option<Ray> {
        let u = (x - self.half[0]) * self.pixel_mm;
        let v = (self.half[1] - y) * self.pixel_mm;
        let origin = self.field.to_index(self.center_mm + self.axes.right * u + self.axes.up * v);
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
        // Far from the origin, the rounding errors of the two ends may exceed the size of the grid.
        Some(Ray { origin, start, length: (end - start).min(self.most) })
    }

    /// Position of a point in the picture, in pixels from its top left corner.
    pub fn pixel_of(&self, mm: Point3<f64>) -> [f64; 2] {
        let from_center = (mm - self.center_mm) / self.pixel_mm;
        [self.half[0] + from_center.dot(&self.axes.right), self.half[1] - from_center.dot(&self.axes.up)]
    }

    /// Continuous index `n` steps from a ray's start.
    #[inline]
    pub fn at(&self, ray: &Ray, n: f64) -> Point3<f64> {
        ray.origin + self.step * (ray.start + n)
    }
}
