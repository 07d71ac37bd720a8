//! Sampling on a grid that is turned against the volume: a tent of trilinear samples along the grid's own axes.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::{IndexMap, Stop};
use crate::{AIR_HU, Volume};

/// Samples along one axis around a point: offset in voxels and weight.
type Tent = Vec<(Vector3<f64>, f64)>;

/// HU at the stops along the axes of a grid, whose indices `map` takes to voxels.
pub(super) fn sample(volume: &Volume, map: &IndexMap, stops: &[Vec<Stop>; 3]) -> Vec<f32> {
    // Samples no more than a voxel apart, over the tent's half-width on either side.
    let tent = |step: Vector3<f64>| -> Tent {
        let parts = step.amax().ceil().max(1.0) as i64;
        let part = move |n: i64| n as f64 / parts as f64;
        (1 - parts..parts).map(|n| (step * part(n), 1.0 - part(n).abs())).collect()
    };
    let tents: [Vec<Tent>; 3] = std::array::from_fn(|axis| {
        stops[axis].iter().map(|stop| tent(map.steps[axis] * stop.reach)).collect()
    });
    let [nx, ny, nz] = stops.each_ref().map(Vec::len);
    let mut out = vec![0.0; nx * ny * nz];
    out.par_iter_mut().enumerate().with_min_len(256).for_each(|(n, hu)| {
        let stop = [n % nx, n / nx % ny, n / (nx * ny)];
        let [i, j, k] = std::array::from_fn(|axis| stops[axis][stop[axis]].at);
        let center = map.origin + map.steps[0] * i + map.steps[1] * j + map.steps[2] * k;
        *hu = at(volume, center, std::array::from_fn(|axis| &tents[axis][stop[axis]]));
    });
    out
}

fn at(volume: &Volume, center: Point3<f64>, along: [&Tent; 3]) -> f32 {
    // Half a voxel beyond the last center is still that voxel.
    let inside = |index: &Point3<f64>| {
        (0..3).all(|axis| (-0.5..=volume.grid().shape[axis] as f64 - 0.5).contains(&index[axis]))
    };
    if !inside(&center) {
        return AIR_HU;
    }
    let (mut sum, mut total) = (0.0, 0.0);
    for (z, weight_z) in along[2] {
        for (y, weight_y) in along[1] {
            for (x, weight_x) in along[0] {
                let index = center + x + y + z;
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
