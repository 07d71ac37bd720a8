//! Depth below the skin as a smooth field.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

use crate::skin_surface::Facet;

/// Radius over which the skin is averaged, beyond the distance to it, in lattice steps.
pub(super) const SPREAD_STEPS: f64 = 2.5;

/// The skin near a cut, for depths below it.
///
/// The skin of a lattice is a staircase. The depth of a position is its distance to a plane that
/// averages the triangles near it: its normal is the mean of theirs by area, and it passes through
/// the mean of their centers by the area seen along the normal. The weights fall smoothly to zero
/// at a distance of [`SPREAD_STEPS`] beyond the closest triangle, so the depth has no steps.
#[derive(Debug)]
pub(super) struct SkinDepth {
    facets: Vec<Facet>,
    /// Numbers of the facets in each cubic cell.
    cells: HashMap<[i64; 3], Vec<u32>>,
    /// Edge of a cell in m.
    edge: f64,
    /// Largest distance from the skin at which a depth is known, in m.
    most: f64,
    /// Width of the weights in m.
    spread: f64,
}

impl SkinDepth {
    /// Depths up to `most` from these triangles of a skin with this lattice step. Both are in m.
    pub fn new(facets: Vec<Facet>, most: f64, step: f64) -> Self {
        let spread = SPREAD_STEPS * step;
        let edge = most + spread;
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for (number, facet) in (0..).zip(&facets) {
            cells.entry(cell(facet.center, edge)).or_default().push(number);
        }
        Self { facets, cells, edge, most, spread }
    }

    /// Depth of a position in m, negative above the skin. None if it is too far from the skin.
    pub fn at(&self, position: Point3<f64>) -> Option<f64> {
        let [i, j, k] = cell(position, self.edge);
        let mut near: Vec<(f64, &Facet)> = Vec::new();
        for n in 0..27 {
            let around = [i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1];
            let Some(held) = self.cells.get(&around) else { continue };
            near.extend(held.iter().map(|&number| {
                let facet = &self.facets[number as usize];
                ((facet.center - position).norm(), facet)
            }));
        }
        let closest = near.iter().map(|(distance, _)| *distance).fold(f64::INFINITY, f64::min);
        if closest > self.most {
            return None;
        }
        let weighted = near.iter().filter_map(|&(distance, facet)| {
            let part = (distance - closest) / self.spread;
            (part < 1.0).then(|| ((1.0 - part * part).powi(2), facet))
        });
        let sum = weighted.clone().fold(Vector3::zeros(), |sum, (w, facet)| sum + facet.area_vector * w);
        let outward = sum.try_normalize(0.0)?;
        let (mut height, mut area) = (0.0, 0.0);
        for (weight, facet) in weighted {
            let seen = weight * facet.area_vector.dot(&outward).max(0.0);
            height += seen * (facet.center - position).dot(&outward);
            area += seen;
        }
        (area > 0.0).then(|| height / area)
    }
}

fn cell(position: Point3<f64>, edge: f64) -> [i64; 3] {
    [0, 1, 2].map(|axis| (position[axis] / edge).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The staircase of a plane that rises by one step in `run` steps: treads and risers, each of
    /// two triangles per step of width.
    fn stairs(run: i32, step: f64) -> Vec<Facet> {
        let p = |x: i32, y: i32, z: i32| {
            Point3::new(f64::from(x) * step, f64::from(y) * step, f64::from(z) * step).cast::<f32>()
        };
        let mut facets = Vec::new();
        let mut quad = |a, b, c, d| facets.extend([Facet::of([a, b, c]), Facet::of([a, c, d])]);
        for x in -20_i32..20 {
            let z = x.div_euclid(run);
            for y in -20..20 {
                quad(p(x, y, z), p(x + 1, y, z), p(x + 1, y + 1, z), p(x, y + 1, z));
                let next = (x + 1).div_euclid(run);
                if next > z {
                    quad(p(x + 1, y, z), p(x + 1, y, next), p(x + 1, y + 1, next), p(x + 1, y + 1, z));
                }
            }
        }
        facets
    }

    /// Below a staircase the depth is that of the plane through it, within a small part of a step.
    /// Control: the distance to the closest triangle is not.
    #[test]
    fn the_depth_below_a_staircase_has_no_steps() {
        for run in [1, 2, 3] {
            let step = 1e-3;
            let depth = SkinDepth::new(stairs(run, step), 8e-3, step);
            let slope = 1.0 / f64::from(run);
            let normal = Vector3::new(-slope, 0.0, 1.0).normalize();
            let facets = stairs(run, step);
            let (mut errors, mut plain) = (Vec::new(), Vec::new());
            for n in 0..40 {
                let along = (0.1 * f64::from(n) - 2.0) * step;
                let on_plane = Point3::new(along, 0.3 * step, along * slope);
                for below in [2e-3, 4e-3] {
                    let found = depth.at(on_plane - normal * below).unwrap();
                    errors.push((found - below) / step);
                    let to = |facet: &Facet| (facet.center - (on_plane - normal * below)).norm();
                    plain.push((facets.iter().map(to).fold(f64::INFINITY, f64::min) - below) / step);
                }
            }
            let statistics = |errors: &[f64]| {
                let mean = errors.iter().sum::<f64>() / errors.len() as f64;
                (mean, errors.iter().map(|error| (error - mean).abs()).fold(0.0, f64::max))
            };
            let (mean, spread) = statistics(&errors);
            assert!(mean.abs() < 0.8 && spread < 0.03, "1 in {run}: {mean} ± {spread} steps");
            assert!(statistics(&plain).1 > 10.0 * spread, "1 in {run}: {:?}", statistics(&plain));
        }
        let depth = SkinDepth::new(stairs(1, 1e-3), 8e-3, 1e-3);
        assert_eq!(depth.at(Point3::new(0.0, 0.0, 30e-3)), None);
        assert!(depth.at(Point3::new(0.0, 0.0, 2e-3)).unwrap() < 0.0);
    }
}
