//! The image of a direction of the skin in a triangle, shared by the three kinds of strips.

use nalgebra::{Point3, Vector3};

use crate::real::cross;
use crate::{Real, SkinStripMaterial};

/// Weights of a strip on a triangle at rest, and their scale.
pub(crate) struct Weights<T: Real> {
    /// Weights of the first two vertices, without unit. The third weight is `−B1 − B2`. The largest
    /// of the three has the magnitude 1, or all are 0 if the triangle has no extent across the
    /// strip.
    pub b: [T; 2],
    /// The extent of the triangle across the strip, in m: the largest `|m·(x_i − x_j)|`.
    pub width: T,
    /// Twice the area of the triangle seen along the normal, in m², and at least
    /// [`LEAST_FACING`](SkinStripMaterial::LEAST_FACING) times its area.
    pub twice_area: T,
    /// Whether the triangle is seen from the front, with at least that area.
    pub faces: T::SimdBool,
}

impl<T: Real> Weights<T> {
    /// Returns the weights for the direction and the normal of `material`.
    pub fn of([x1, x2, x3]: &[Point3<T>; 3], material: &SkinStripMaterial) -> Self {
        let normal = material.normal().map(T::constant);
        let across = material.direction().cross(material.normal()).map(T::constant);
        let [w1, w2, w3] = [x3 - x2, x1 - x3, x2 - x1].map(|edge| across.dot(&edge));
        let width = w1.simd_abs().simd_max(w2.simd_abs()).simd_max(w3.simd_abs());
        let inverse = (T::one() / width).select(width.simd_gt(T::zero()), T::zero());
        let area_vector = cross(&(x2 - x1), &(x3 - x1));
        let least = length(&area_vector) * T::constant(SkinStripMaterial::LEAST_FACING);
        let seen = normal.dot(&area_vector);
        let (faces, twice_area) = (seen.simd_ge(least), seen.simd_max(least));
        Self { b: [w1 * inverse, w2 * inverse], width, twice_area, faces }
    }
}

/// The parameters that the kinds of strips have in common.
pub(crate) struct Rest<T> {
    /// Weights of the first two vertices.
    pub b: [T; 2],
    /// `H = Σ B_i X_i − ℓ d`, in m. Of a triangle that faces the normal it is along the normal, and
    /// zero if the triangle is parallel to the skin.
    pub rise: Vector3<T>,
    /// `F0`, the image of the direction in the scan, in m.
    pub image: Vector3<T>,
    /// `L0 = |F0|` in m.
    pub length: T,
    /// `t0 = L0 τ/T`: how far the strip is stretched in the scan, in m.
    pub stretch: T,
}

impl<T: Real> Rest<T> {
    /// Returns the parameters of a strip with the shape `x` in the scan.
    pub fn of(x: &[Point3<T>; 3], material: &SkinStripMaterial) -> Self {
        let Weights { b, width, twice_area, faces } = Weights::of(x, material);
        let [normal, along] = [material.normal(), material.direction()].map(|axis| axis.map(T::constant));
        let sloped = image(x, b, Vector3::zeros());
        let height = normal * normal.dot(&sloped);
        let level = sloped - along * (twice_area * inverse_or_zero(width));
        let rise = height.zip_map(&level, |height, level| height.select(faces, level));
        // Computed as `eval` does, so that nothing is left in the scan.
        let image = image(x, b, rise);
        let length = length(&image);
        let law = material.law();
        let stretch = length * T::constant(law.tension_n_per_m / law.modulus_n_per_m);
        Self { b, rise, image, length, stretch }
    }
}

/// Returns the image `F = Σ B_i x_i − H` in m.
#[inline(always)]
pub(crate) fn image<T: Real>(
    [x1, x2, x3]: &[Point3<T>; 3],
    [b1, b2]: [T; 2],
    rise: Vector3<T>,
) -> Vector3<T> {
    (x1 - x3) * b1 + (x2 - x3) * b2 - rise
}

/// Returns the length of a vector.
#[inline(always)]
pub(crate) fn length<T: Real>(vector: &Vector3<T>) -> T {
    vector.dot(vector).simd_sqrt()
}

/// Returns `1/x`, or 0 unless `x` is above 0.
#[inline(always)]
pub(crate) fn inverse_or_zero<T: Real>(x: T) -> T {
    (T::one() / x).select(x.simd_gt(T::zero()), T::zero())
}

/// Returns `1/r²` for a reach `r` of four times the larger of the present and the scan's length.
///
/// A vertex of a triangle may have a tiny weight. If the others are fixed, a projection without a
/// limit would throw it far away. The limit never shortens the projection of a triangle whose
/// vertices are all free.
#[inline(always)]
pub(crate) fn inverse_reach_squared<T: Real>(length: T, scan_length: T) -> T {
    let size = length.simd_max(scan_length);
    inverse_or_zero(size * size) * T::constant(1.0 / 16.0)
}

/// Returns the gradients at the vertices, `B_i` times the gradient with respect to `F`.
#[inline(always)]
pub(crate) fn gradients<T: Real>(of_image: Vector3<T>, [b1, b2]: [T; 2]) -> [Vector3<T>; 3] {
    [of_image * b1, of_image * b2, of_image * -(b1 + b2)]
}
