//! The parallel rays of a picture, from where they enter the volume to where they leave it.

use std::ops::Range;

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
    /// Reach of the ambient occlusion along each index axis.
    reach: Vector3<f64>,
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
        let index_per_mm = field.index_per_mm();
        let per_mm = index_per_mm * -axes.toward;
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
        let reach = Vector3::from_fn(|axis, _| index_per_mm.row(axis).norm() * view.occlusion_mm);
        Self { field, axes: *axes, center_mm, half, pixel_mm, step, steps_per_index, planes, most, reach }
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

    /// A box of continuous indices that holds the picture's rays inside the volume, and what the
    /// ambient occlusion looks at around them. Its ranges are reversed if there are none.
    pub fn bounds(&self) -> [Range<f64>; 3] {
        let [w, h] = self.half.map(|half| half * self.pixel_mm);
        let corners = [(-w, -h), (w, -h), (-w, h), (w, h)]
            .map(|(u, v)| self.field.to_index(self.center_mm + self.axes.right * u + self.axes.up * v));
        let (low, high) =
            corners.iter().fold((corners[0], corners[0]), |(low, high), p| (low.inf(p), high.sup(p)));
        // Steps between which any of the rays is inside the volume.
        let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
        let ends = self.field.shape().map(|n| n as f64 - 1.0);
        for axis in (0..3).filter(|&axis| self.step[axis] != 0.0) {
            let steps = [-high[axis], ends[axis] - low[axis]].map(|way| way / self.step[axis]);
            (first, last) = (first.max(steps[0].min(steps[1])), last.min(steps[0].max(steps[1])));
        }
        std::array::from_fn(|axis| {
            let ways = [first * self.step[axis], last * self.step[axis]];
            let margin = self.reach[axis] + 2.0;
            let [start, end] = [low[axis] + ways[0].min(ways[1]), high[axis] + ways[0].max(ways[1])];
            if first <= last { start - margin..end + margin } else { f64::INFINITY..f64::NEG_INFINITY }
        })
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

#[cfg(test)]
mod tests {
    use cutis_test_kit::Random;
    use cutis_volume::{Affine, Grid, Volume};

    use super::*;
    use crate::{Focus, Side};

    /// All rays of a picture are within its bounds. Those of a close-up are a part of the volume.
    #[test]
    fn rays_stay_within_their_bounds() {
        let affine = Affine::from_spacing([0.7, 1.0, 2.5], [-10.0, 4.0, 30.0]).unwrap();
        let grid = Grid { shape: [50, 40, 30], affine };
        let volume = Volume::new(grid, vec![0; grid.len()], 1.0, 0.0).unwrap();
        let field = Field::new(&volume);
        let mut random = Random::new(6);
        let mut number = |low: f64, high: f64| low + (high - low) * random.below(10_000) as f64 / 1e4;
        let (mut inside, mut smaller) = (0, 0);
        for n in 0..60 {
            let mut direction: [f64; 3] = std::array::from_fn(|_| number(-1.0, 1.0));
            if n < 6 {
                direction = [0.0; 3];
                direction[n % 3] = if n < 3 { 1.0 } else { -1.0 };
            }
            let center_mm = [number(-30.0, 40.0), number(-10.0, 60.0), number(0.0, 130.0)];
            let focus = (n % 4 > 0).then(|| Focus { center_mm, size_mm: number(1.0, 60.0) });
            let view =
                View { width: 30, height: 20, focus, occlusion_mm: 0.0, ..View::new(Side::From(direction)) };
            let rays = Rays::new(&field, &view, &Axes::new(view.side).unwrap());
            let bounds = rays.bounds();
            let all = (0..=30).flat_map(|x| (0..=20).map(move |y| [f64::from(x), f64::from(y)]));
            for ray in all.filter_map(|place| rays.through(place)) {
                for part in 0..=8 {
                    let at = rays.at(&ray, ray.length * f64::from(part) / 8.0);
                    let within = (0..3).all(|axis| bounds[axis].contains(&at[axis]));
                    assert!(within, "{at} is not within {bounds:?} from {direction:?} at {focus:?}");
                    inside += 1;
                }
            }
            smaller += usize::from((0..3).any(|axis| bounds[axis].end - bounds[axis].start < 20.0));
        }
        assert!(inside > 1000 && smaller > 10, "the control: {inside} places, {smaller} small boxes");
    }
}
