//! The distance constraint: an edge keeps its length.

use nalgebra::Point3;

use crate::{Constraint, Eval, Real, UnitGradients};

/// A constraint that keeps the length of an edge.
///
/// ```text
/// C   = |x1 − x2| − L                      [m]
/// ∇1C = (x1 − x2)/|x1 − x2|,  ∇2C = −∇1C   [1]
/// ```
///
/// The parameters are `[L]`, the rest length in m. The gradient is zero where the points coincide.
/// The compliance is [`distance_compliance`](crate::distance_compliance), in m/N. Source: Müller et
/// al. 2007, §3.3.
#[derive(Clone, Copy, Debug)]
pub struct Distance;

/// The rest length of a [`Distance`] relative to its initial length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceMaterial {
    /// Rest length divided by initial length, above 0. Below 1 the edge pulls from the start.
    pub rest_scale: f64,
}

impl Default for DistanceMaterial {
    /// The initial length is the rest length.
    fn default() -> Self {
        Self { rest_scale: 1.0 }
    }
}

impl Constraint<2> for Distance {
    const NAME: &'static str = "distance";
    const WGSL: &'static str = cutis_shaders::constraints::DISTANCE;
    type Params<T: Real> = [T; 1];
    type Material = DistanceMaterial;

    fn from_rest<T: Real>([x1, x2]: &[Point3<T>; 2], material: &DistanceMaterial) -> [T; 1] {
        let d = x1 - x2;
        [d.dot(&d).simd_sqrt() * T::constant(material.rest_scale)]
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; 2], params: &[T; 1]) -> Eval<T, 2> {
        difference(x, params).eval()
    }

    #[inline(always)]
    fn unit_gradients<T: Real>(x: &[Point3<T>; 2], params: &[T; 1]) -> Option<UnitGradients<T, 2>> {
        Some(difference(x, params))
    }

    fn rest_size<T: Real>(&[rest_length]: &[T; 1]) -> T {
        rest_length
    }
}

/// The gradients are along the difference of the points.
#[inline(always)]
fn difference<T: Real>([x1, x2]: &[Point3<T>; 2], &[rest_length]: &[T; 1]) -> UnitGradients<T, 2> {
    let d = x1 - x2;
    let length = d.dot(&d).simd_sqrt();
    UnitGradients { c: length - rest_length, along: [d, -d], length }
}
