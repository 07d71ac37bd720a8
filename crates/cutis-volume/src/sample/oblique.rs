//! Sampling on a grid that is turned against the volume: a tent of trilinear samples along the grid's own axes.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::IndexMap;
use crate::{AIR_HU, Grid, Volume};

/// HU at the points of `grid`, whose indices `map` takes to voxels.
pub(super) fn sample(volume: &Volume, grid: &Grid, map: &IndexMap) -> Vec<f32> {
    // Per axis of the grid, samples no more than a voxel apart, over a step on either side: offset in voxels and weight.
    let along = map.steps.map(|step| {
        let parts = step.amax().ceil().max(1.0) as i64;
        let part = move |n: i64| n as f64 / parts as f64;
        (1 - parts..parts).map(|n| (step * part(n), 1.0 - part(n).abs())).collect::<Vec<_>>()
    });
    let mut out = vec![0.0; grid.len()];
    out.par_iter_mut().enumerate().with_min_len(256).for_each(|(n, hu)| {
        let [i, j, k] = grid.point(n).map(|index| index as f64);
        *hu = at(volume, map.origin + map.steps[0] * i + map.steps[1] * j + map.steps[2] * k, &along);
    });
    out
}

fn at(volume: &Volume, centre: Point3<f64>, along: &[Vec<(Vector3<f64>, f64)>; 3]) -> f32 {
    // Half a voxel beyond the last centre is still that voxel.
    let inside = |index: &Point3<f64>| {
        (0..3).all(|axis| (-0.5..=volume.grid().shape[axis] as f64 - 0.5).contains(&index[axis]))
    };
    if !inside(&centre) {
        return AIR_HU;
    }
    let (mut sum, mut total) = (0.0, 0.0);
    for (z, weight_z) in &along[2] {
        for (y, weight_y) in &along[1] {
            for (x, weight_x) in &along[0] {
                let index = centre + x + y + z;
                if inside(&index) {
                    let weight = weight_x * weight_y * weight_z;
                    sum += weight * f64::from(volume.trilinear(index).max(AIR_HU));
                    total += weight;
                }
            }
        }
    }
    (sum / total) as f32
}
