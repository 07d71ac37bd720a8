//! Moves that put the skin vertices of a lattice body on a smooth surface.

use std::f64::consts::{PI, SQRT_2};

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::BodySkin;
use crate::around::largest_around;
use crate::blur::Blurred;
use crate::vertices::SkinVertices;

/// Standard deviation of the blur in lattice steps. A wider blur rounds the skin off, and a
/// narrower one leaves more of the steps.
const SIGMA: f64 = SQRT_2;

/// Depth of the smooth surface below the skin of the CT in lattice steps. It is the mean depth of
/// the vertices of a flat skin.
const DEPTH: f64 = 0.5;

/// Range of depths in lattice steps at which skin vertices of a flat skin can be.
const RANGE: [f64; 2] = [-0.6, 1.7];

/// Smallest gradient of the share of tissue, as a part of that at a flat skin. It is less where
/// tissue is thinner than about two and a half lattice steps, so that its other side counts too.
const LEAST_GRADIENT: f64 = 0.6;

/// HU of air.
const AIR_HU: f32 = -1000.0;

/// Lowest and highest HU of tissue: fat and water.
const TISSUE_HU: [f32; 2] = [-100.0, 0.0];

/// Moves of the skin vertices of a lattice body, for [`Lattice::with_moves`].
///
/// The skin of a lattice body is a staircase. Its vertices lie up to about one step below the skin
/// of the CT, each at another depth. The moves put them half a step below the skin of the CT:
///
/// ```text
/// u = n (q − ½) h,   q = σ Φ⁻¹(s)
/// ```
///
/// `q` is the depth of the vertex in lattice steps and `h` the step along the outward normal `n`.
/// `s` is the share of tissue, `clamp((HU + 1000)/(T + 1000), 0, 1)`, blurred with a standard
/// deviation `σ` of √2 steps. `T` is the HU of the tissue there: the largest HU of the vertices of
/// the body at the point and its 26 neighbors, clamped to −100 (fat) and 0. `Φ` is the normal
/// distribution function, which is what the blur makes of a flat skin. `n` is along `−∇s`. A point
/// outside the body has a share only next to a vertex of the body, and at most ½, so that the
/// scanner table does not count.
///
/// A vertex stays where it is if `q` is not a depth that a skin vertex can have, or if `∇s` does
/// not fit a flat skin. This happens where tissue is thinner than about two and a half steps. A
/// vertex on the border of the lattice stays on the border.
///
/// # Accuracy
///
/// Depth of the skin vertices below the exact skin in lattice steps: mean and standard deviation,
/// as they are and moved. *CT* is a body with partial volume, sampled from voxels of a third of a
/// step. *Mask* is a body of lattice points at 40 HU in air, whose steps the HU do not resolve.
///
/// | body | CT | CT, moved | mask | mask, moved |
/// |---|---|---|---|---|
/// | half-spaces | 0.65, 0.36 | 0.52, 0.07 | 0.62, 0.36 | 0.52, 0.08 |
/// | half-spaces, tilted by 2° | 0.60, 0.26 | 0.51, 0.02 | 0.55, 0.27 | 0.56, 0.22 |
/// | half-spaces, tilted by 5° | 0.52, 0.28 | 0.50, 0.02 | 0.49, 0.28 | 0.50, 0.17 |
/// | half-spaces, tilted by 10° | 0.54, 0.29 | 0.50, 0.02 | 0.49, 0.29 | 0.50, 0.09 |
/// | spheres, radius 4 steps | 0.64, 0.38 | 1.01, 0.13 | 0.56, 0.38 | 0.96, 0.15 |
/// | spheres, radius 9 steps | 0.79, 0.41 | 0.74, 0.08 | 0.75, 0.41 | 0.73, 0.09 |
/// | half-spaces, rotated and mirrored axes | 0.57, 0.30 | 0.52, 0.07 | 0.55, 0.30 | 0.54, 0.07 |
///
/// The blur takes a round skin for a deeper one. In a graded lattice with a growth of 1.3 the depth
/// of a flat skin is off by up to a quarter of a step. `cargo test --release -p cutis-skin --test
/// all depths_below -- --nocapture` prints these figures.
///
/// [`Lattice::with_moves`]: cutis_mesh::Lattice::with_moves
#[derive(Clone, Debug)]
pub struct SkinMoves {
    /// Flat lattice indices of the skin vertices, ascending.
    pub points: Vec<u32>,
    /// Displacement of each in world mm.
    pub mm: Vec<Vector3<f64>>,
    /// Number of vertices that stay where they are.
    pub unmoved: usize,
}

impl SkinMoves {
    /// Computes the moves. The work is parallel, and the bits do not depend on the number of
    /// threads.
    pub fn of(skin: &BodySkin<'_>) -> Self {
        let vertices = SkinVertices::of(skin);
        let share = Blurred::new(skin.lattice(), tissue_shares(skin), SIGMA);
        let areas: Vec<_> = skin.triangles().iter().map(|triangle| skin.area_vector_mm2(triangle)).collect();
        let outwards = vertices.gather(Vector3::zeros(), &areas);
        let found: Vec<Option<Vector3<f64>>> = vertices
            .points
            .par_iter()
            .zip(&outwards)
            .map(|(&point, outward)| of_vertex(skin, &share, point, outward))
            .collect();
        let unmoved = found.iter().filter(|of_vertex| of_vertex.is_none()).count();
        let mm = found.into_iter().map(Option::unwrap_or_default).collect();
        Self { points: vertices.points, mm, unmoved }
    }
}

/// The share of tissue at each lattice point.
fn tissue_shares(skin: &BodySkin<'_>) -> Vec<f32> {
    let grid = skin.lattice().grid();
    let in_body = |(point, hu): (usize, &f32)| if skin.vertices()[point] { *hu } else { f32::NEG_INFINITY };
    let largest = largest_around(skin.hu().par_iter().enumerate().map(in_body).collect(), grid.shape);
    let [low, high] = TISSUE_HU;
    let share = |point: usize| {
        // The HU outside the body may be NaN.
        let above_air = (skin.hu()[point] - AIR_HU).max(0.0);
        let most = if skin.vertices()[point] { 1.0 } else { 0.5 };
        // Nothing if no vertex of the body is here or next to here.
        match above_air > 0.0 && largest[point] > f32::NEG_INFINITY {
            true => (above_air / (largest[point].max(low).min(high) - AIR_HU)).min(most),
            false => 0.0,
        }
    };
    (0..grid.len()).into_par_iter().map(share).collect()
}

/// The move of a skin vertex in world mm. None if its depth is not known.
fn of_vertex(
    skin: &BodySkin<'_>,
    share: &Blurred,
    point: u32,
    outward: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let grid = skin.lattice().grid();
    let at = grid.point(point as usize);
    let derivatives = share.derivatives(at);
    let normal = (-share.direction(&derivatives)).try_normalize(0.0)?;
    let gaps =
        [0, 1, 2].map(|axis| 0.5 * (share.gap(axis, at[axis]) + share.gap(axis, at[axis].saturating_sub(1))));
    let per_step = Vector3::from_fn(|axis, _| derivatives[axis] * gaps[axis]);
    let across = -per_step.try_normalize(0.0)?;
    let variances = share.variances();
    let sigma = (0..3).map(|axis| across[axis].powi(2) * variances[axis]).sum::<f64>().sqrt();
    let [low, high] = RANGE.map(|depth| distribution(depth / sigma));
    let here = share.at(at);
    let is_flat = |depth: f64| per_step.norm() >= LEAST_GRADIENT * density(depth / sigma) / sigma;
    let depth =
        (low..high).contains(&here).then(|| sigma * quantile(here)).filter(|&depth| is_flat(depth))?;
    // Lattice steps per mm along the normal.
    let index = |mm: Vector3<f64>| grid.affine.to_index(Point3::from(mm));
    let steps_per_mm = index(normal) - index(Vector3::zeros());
    let per_mm: f64 = (0..3).map(|axis| across[axis] * steps_per_mm[axis] / gaps[axis]).sum();
    let mut mm = normal * ((depth - DEPTH) / per_mm);
    for axis in 0..3 {
        if at[axis] == 0 || at[axis] + 1 == grid.shape[axis] {
            let steps = index(mm)[axis] - index(Vector3::zeros())[axis];
            mm -= grid.affine.step_mm(axis) * steps;
        }
    }
    (outward.dot(&normal) > 0.0 && mm.iter().all(|c| c.is_finite())).then_some(mm)
}

/// The density of the standard normal distribution.
fn density(x: f64) -> f64 {
    (-0.5 * x * x).exp() / (2.0 * PI).sqrt()
}

/// The standard normal distribution function, for arguments of a few units: the series `½ + φ(x) (x
/// + x³/3 + x⁵/15 + …)`.
fn distribution(x: f64) -> f64 {
    let (mut term, mut sum) = (x, x);
    for n in 1..100 {
        term *= x * x / f64::from(2 * n + 1);
        sum += term;
    }
    0.5 + density(x) * sum
}

/// The inverse of [`distribution`], by Newton's method. It converges from 0, because the function
/// is concave on the side where the root is, or mirrored.
fn quantile(share: f64) -> f64 {
    let mut x = 0.0;
    for _ in 0..30 {
        x -= (distribution(x) - share) / density(x);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values from tables of the normal distribution.
    #[test]
    fn quantiles_are_those_of_the_normal_distribution() {
        for (share, x) in
            [(0.5, 0.0), (0.841_344_746_1, 1.0), (0.158_655_253_9, -1.0), (0.977_249_868_1, 2.0)]
        {
            assert!((quantile(share) - x).abs() < 1e-9, "{share}: {}", quantile(share));
            assert!((distribution(x) - share).abs() < 1e-10, "{x}: {}", distribution(x));
        }
    }
}
