//! The skin of a half-space: the staircase of a random plane on a lattice of whole tetrahedra.

use std::f64::consts::PI;

use cutis_mesh::{Lattice, MeshError, SkinMode, SkinOptions, Split, skin};
use cutis_test_kit::Random;
use cutis_volume::{Affine, Grid};
use nalgebra::{Point3, Vector3};

use crate::kit::Failure;

/// Lattice points along each axis.
const POINTS: usize = 33;
/// Lattice step in mm.
const STEP_MM: f64 = 2.0;
/// Radius of the window in steps. It leaves the sides of the block outside for every plane.
const RADIUS: f64 = 13.0;

/// Triangles of the staircase near the middle of a plane, with weights that fade to zero at the
/// edge of a window. A sum over the triangles times their weights is an integral over the plane,
/// with little error from the edge.
pub struct PlaneSkin {
    /// Outward unit normal of the plane.
    pub normal: Vector3<f64>,
    /// A unit vector in the plane.
    pub along: Vector3<f64>,
    /// Triangles in m, counterclockwise as seen from outside.
    pub triangles: Vec<[Point3<f64>; 3]>,
    /// Weights of the triangles, from 0 to 1.
    pub weights: Vec<f64>,
    /// Integral of the weight over the plane, in m².
    pub area: f64,
}

impl PlaneSkin {
    /// The skin under a plane of random orientation and place.
    ///
    /// # Errors
    /// The lattice is refused.
    pub fn random(random: &mut Random) -> Result<Self, Failure> {
        let normal = direction(random);
        let along = normal.cross(&direction(random)).normalize();
        let offset = random.between(-0.5, 0.5);
        Ok(Self::new(normal, along, offset)?)
    }

    /// The skin under a plane. `offset` is its distance from the middle of the block, in steps.
    ///
    /// # Errors
    /// The lattice is refused.
    pub fn new(normal: Vector3<f64>, along: Vector3<f64>, offset: f64) -> Result<Self, MeshError> {
        let affine = Affine::from_spacing([STEP_MM; 3], [0.0; 3]).map_err(MeshError::Volume)?;
        let lattice = Lattice::new(Grid { shape: [POINTS; 3], affine }, Split::Kuhn6)?;
        let step = STEP_MM * 1e-3;
        let middle = Vector3::repeat((POINTS - 1) as f64 / 2.0 * step) + normal * (offset * step);
        let place = |point: usize| lattice.mm(lattice.grid().point(point)).coords * 1e-3 - middle;
        let air: Vec<bool> = (0..lattice.grid().len()).map(|point| place(point).dot(&normal) > 0.0).collect();
        let found = skin::detect(&lattice, &air, SkinMode::Boundary, &SkinOptions::default())?;
        let radius = RADIUS * step;
        let mut skin = Self {
            normal,
            along,
            triangles: Vec::new(),
            weights: Vec::new(),
            area: PI * radius * radius / 3.0,
        };
        for triangle in found.triangles {
            let x = triangle.map(|point| place(point as usize));
            let center = (x[0] + x[1] + x[2]) / 3.0;
            let in_plane = center - normal * center.dot(&normal);
            let inside = 1.0 - in_plane.norm_squared() / (radius * radius);
            if inside > 0.0 {
                skin.triangles.push(x.map(Point3::from));
                skin.weights.push(inside * inside);
            }
        }
        Ok(skin)
    }

    /// The unit vector in the plane across [`along`](Self::along).
    pub fn across(&self) -> Vector3<f64> {
        self.normal.cross(&self.along)
    }

    /// Weighted sum over the triangles, divided by the area of the plane.
    pub fn mean(&self, mut value: impl FnMut(&[Point3<f64>; 3]) -> f64) -> f64 {
        self.triangles.iter().zip(&self.weights).map(|(x, weight)| weight * value(x)).sum::<f64>() / self.area
    }
}

/// The area vector of a triangle in m²: along its normal, as long as its area.
pub fn area_vector([x1, x2, x3]: &[Point3<f64>; 3]) -> Vector3<f64> {
    (x2 - x1).cross(&(x3 - x1)) * 0.5
}

/// A random unit vector, evenly distributed.
pub fn direction(random: &mut Random) -> Vector3<f64> {
    loop {
        let vector = random.vector();
        if (0.01..1.0).contains(&vector.norm_squared()) {
            return vector.normalize();
        }
    }
}
