//! Mean normals of the facets around a skin triangle.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::BodySkin;
use crate::vertices::SkinVertices;

/// Number of times that each triangle takes the sum over the triangles around it.
const ROUNDS: usize = 2;

/// Unit mean of the facet normals around each skin triangle, weighted by area and nearness. If they
/// cancel, it is the normal of the facet itself.
pub(super) fn means(skin: &BodySkin<'_>, vertices: &SkinVertices) -> Vec<Vector3<f64>> {
    let areas: Vec<Vector3<f64>> =
        skin.triangles().par_iter().map(|triangle| skin.area_vector_mm2(triangle)).collect();
    let mut sums = areas.clone();
    for _ in 0..ROUNDS {
        let at_vertices = vertices.gather(Vector3::zeros(), &sums);
        let around = |triangle: &[u32; 3]| triangle.iter().map(|&v| at_vertices[v as usize]).sum();
        sums = vertices.triangles.par_iter().map(around).collect();
    }
    let mean = |(sum, area): (&Vector3<f64>, &Vector3<f64>)| {
        // Each round multiplies the weights by about the number of triangles around a triangle.
        let cancels = sum.norm() <= area.norm();
        if cancels { area.normalize() } else { sum.normalize() }
    };
    sums.par_iter().zip(&areas).map(mean).collect()
}
