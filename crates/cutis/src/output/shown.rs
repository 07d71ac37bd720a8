//! The part of the CT that the pictures show, so that the rest need not be resampled.

use cutis_render::{Focus, Plane};
use nalgebra::{Point3, Vector3};

use super::wound_place::{WoundPlace, position};

/// How far beyond its rays a picture of the skin looks, mm: the reach of its shadows
/// ([`View::occlusion_mm`](cutis_render::View)).
const SHADOW_MM: f64 = 12.0;
/// Voxels beyond those on a ray that its values and gradients need.
const VOXELS: f64 = 3.0;
/// Half the diagonal of a square over its side.
const HALF_DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The rays of the pictures around a wound.
pub(super) struct Shown {
    /// A point on the middle ray of the close-up of the skin, the direction of all its rays, and
    /// the distance of the farthest one from it, mm.
    close_up: (Point3<f64>, Vector3<f64>, f64),
    /// Axis and position of each slice, mm.
    slices: Vec<(usize, f64)>,
    /// The middle of the slices and the distance of their corners from it, mm.
    in_slices: (Point3<f64>, f64),
    /// Thickness of a slice on either side, mm.
    thickness_mm: f64,
}

impl Shown {
    /// What is shown of a wound in a CT with these steps between voxels in mm. None without a
    /// wound: then the whole CT is shown.
    pub(super) fn of(place: Option<&WoundPlace>, spacing_mm: [f64; 3]) -> Option<Self> {
        let place = place?;
        let voxel_mm = spacing_mm.into_iter().fold(0.0, f64::max);
        let reach = |focus: &Focus| focus.size_mm * HALF_DIAGONAL;
        let through = |plane: Plane, mm| {
            let axis = match plane {
                Plane::Sagittal => 0,
                Plane::Coronal => 1,
                Plane::Axial => 2,
            };
            (axis, position(plane, mm))
        };
        let planes = [Plane::Axial, Plane::Coronal, Plane::Sagittal];
        let mut slices: Vec<_> = planes.map(|plane| through(plane, place.inside_mm)).into();
        slices.push(through(place.plane_across(), place.middle_mm));
        Some(Self {
            close_up: (
                place.close_up.center_mm.into(),
                Vector3::from(place.outward).normalize(),
                reach(&place.close_up) + SHADOW_MM + VOXELS * voxel_mm,
            ),
            slices,
            in_slices: (place.slice.center_mm.into(), reach(&place.slice) + VOXELS * voxel_mm),
            thickness_mm: VOXELS * voxel_mm,
        })
    }

    /// Whether the pictures show a part of a ball in the world, mm.
    pub(super) fn shows(&self, center: Point3<f64>, radius: f64) -> bool {
        let (on_ray, direction, reach) = &self.close_up;
        let from_ray = center - on_ray;
        let across = from_ray - direction * direction.dot(&from_ray);
        let (middle, corner) = self.in_slices;
        let near_slice = |&(axis, at): &(usize, f64)| {
            let mut from_middle = center - middle;
            from_middle[axis] = 0.0;
            (center[axis] - at).abs() <= self.thickness_mm + radius && from_middle.norm() <= corner + radius
        };
        across.norm() <= reach + radius || self.slices.iter().any(near_slice)
    }
}
