//! The floor of a pocket: a surface at an even depth below the skin around a path.

use nalgebra::{Point3, Vector3};

use super::blade::Shape;
use super::depth::SkinDepth;
use crate::pocket::distance_to;
use crate::skin_surface::Facet;

/// A surface at an even depth below the skin. It cuts what is close enough to a path. Its positive
/// side is the deeper one.
#[derive(Debug)]
pub(crate) struct PocketFloor {
    skin: SkinDepth,
    /// Path at the depth of the surface in local meters.
    path: Vec<Point3<f64>>,
    /// Depth below the skin in m.
    depth: f64,
    /// Distance from the path up to which the surface is known, in m.
    far: f64,
    bounds: [Point3<f64>; 2],
}

impl PocketFloor {
    /// A surface at `depth` around a path, which cuts up to `distance` from it and is known up to
    /// `margin` beyond that, all in m. `facets` are the skin near it, of a lattice with this step.
    pub fn new(
        facets: Vec<Facet>,
        path: &[Point3<f64>],
        [depth, distance, margin]: [f64; 3],
        step: f64,
    ) -> Self {
        let far = distance + margin;
        let fold = |start: f64, least: fn(f64, f64) -> f64| {
            path.iter().fold(Vector3::repeat(start), |bound, p| bound.zip_map(&p.coords, least))
        };
        let low = Point3::from(fold(f64::INFINITY, f64::min) - Vector3::repeat(far));
        let high = Point3::from(fold(f64::NEG_INFINITY, f64::max) + Vector3::repeat(far));
        let skin = SkinDepth::new(facets, depth + margin, step);
        Self { skin, path: path.to_vec(), depth, far, bounds: [low, high] }
    }
}

impl Shape for PocketFloor {
    fn bounds(&self) -> [Point3<f64>; 2] {
        self.bounds
    }

    fn distance(&self, position: Point3<f64>, reach: f64) -> Option<f64> {
        if distance_to(&self.path, position).0 > self.far {
            return None;
        }
        Some(self.skin.at(position)? - self.depth).filter(|distance| distance.abs() <= reach)
    }

    fn place(&self, position: Point3<f64>, _reach: f64) -> Option<[f64; 2]> {
        let (distance, along) = distance_to(&self.path, position);
        Some([distance, along])
    }
}
