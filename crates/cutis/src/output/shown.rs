//! The part of the CT that the pictures show, so that the rest need not be resampled.

use cutis_render::{Focus, Plane, Side, View};
use nalgebra::{Point3, Vector3};

use super::wound_place::{WoundPlace, position};

/// Voxels beyond those on a ray that its values and gradients need.
const VOXELS: f64 = 3.0;
/// Half the diagonal of a square over its side.
const HALF_DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The rays of the pictures around a wound.
pub(super) struct Shown {
    /// A point on the middle ray of the close-up of the skin, the direction of all its rays, and
    /// the distance of the farthest one from it, mm.
    close_up: (Point3<f64>, Vector3<f64>, f64),
    /// Plane and position of each slice, mm.
    slices: [(Plane, f64); 4],
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
        let inside = |plane| (plane, position(plane, place.inside_mm));
        let across = place.plane_across();
        // A picture of the skin looks beyond its rays as far as its shadows reach.
        let shadow_mm = View::new(Side::Anterior).occlusion_mm;
        Some(Self {
            close_up: (
                place.close_up.center_mm.into(),
                Vector3::from(place.outward).normalize(),
                reach(&place.close_up) + shadow_mm + VOXELS * voxel_mm,
            ),
            slices: [
                inside(Plane::Axial),
                inside(Plane::Coronal),
                inside(Plane::Sagittal),
                (across, position(across, place.middle_mm)),
            ],
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
        let near_slice = |&(plane, at): &(Plane, f64)| {
            let along = position(plane, center.into()) - position(plane, middle.into());
            let in_plane = ((center - middle).norm_squared() - along * along).max(0.0).sqrt();
            let from_slice = (position(plane, center.into()) - at).abs();
            from_slice <= self.thickness_mm + radius && in_plane <= corner + radius
        };
        across.norm() <= reach + radius || self.slices.iter().any(near_slice)
    }
}
