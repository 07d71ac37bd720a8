//! The rays of a picture: parallel, a step apart from sample to sample, from where they enter what is shown to where they
//! leave it.

use nalgebra::{Point3, Vector3};

use crate::annotate::frame;
use crate::field::Field;
use crate::{Axes, View};

/// Length of a step in voxels, along the index axis in which it moves most.
const STEP: f64 = 0.5;

/// Rays of one direction through one field.
pub struct Rays<'a> {
    field: &'a Field<'a>,
    axes: Axes,
    center_mm: Point3<f64>,
    /// Half the picture's width and height, pixels.
    half: [f64; 2],
    /// Size of a pixel, mm.
    pub pixel_mm: f64,
    /// Index per step.
    pub step: Vector3<f64>,
    /// Planes in index space: kept where `normal · index ≥ offset`.
    planes: Vec<(Vector3<f64>, f64)>,
    /// No ray has more steps.
    most: f64,
}

/// A ray's part that is shown: not empty.
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
        let longest = field.shape().into_iter().max().unwrap_or(1);
        let half = size.map(|length| length as f64 / 2.0);
        Self { field, axes: *axes, center_mm, half, pixel_mm, step, planes, most: longest as f64 / STEP }
    }

    /// The ray through a place of the picture, in pixels from its top left corner, if it meets anything that is shown.
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
        // Far from the origin the rounding of the two ends may be more than the grid.
        Some(Ray { origin, start, length: (end - start).min(self.most) })
    }

    /// Continuous index `n` steps from a ray's start.
    #[inline]
    pub fn at(&self, ray: &Ray, n: f64) -> Point3<f64> {
        ray.origin + self.step * (ray.start + n)
    }
}
