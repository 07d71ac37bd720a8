//! Resampling by brute force in `f64`, with bounds for the rounding of `f32`. For each voxel it
//! gives the allowed values, and for each count the smallest and the largest allowed value. Not a
//! single voxel may be outside.

use std::ops::RangeInclusive;

use cutis_resample::ResampleReport;
use cutis_volume::Volume;
use nalgebra::{Matrix3, Point3, Vector3};

use super::scenes::Scene;

/// A tet in voxel indices, with bounds of its `f32` errors.
struct Tet {
    corners: [Point3<f64>; 4],
    /// Unit normals that point inwards.
    normals: [Vector3<f64>; 4],
    /// Height of each corner over its face.
    heights: [f64; 4],
    /// Error of a corner's place.
    place_error: f64,
    /// Error of a distance to each face, for exact corners.
    rounding: [f64; 4],
    /// Total error of a distance to each face: both errors above, and the margin that the kernels
    /// add.
    errors: [f64; 4],
    /// False if `f32` cannot distinguish the volume from zero, because the tet is too flat or a
    /// corner too far away. Such a tet may be ignored, and may hold any voxel that it comes near.
    is_firm: bool,
}

impl Tet {
    /// `largest` is the largest place in the volume. A corner may be farther away, and is less
    /// exact then.
    fn new(corners: [Point3<f64>; 4], center: Vector3<f64>, largest: f64) -> Self {
        let place = |c: &Point3<f64>| (c.coords - center).amax();
        let place_error = PLACE_ERROR * corners.iter().map(place).fold(largest, f64::max);
        let middle = corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / 4.0;
        let size: f64 = (0..3)
            .map(|axis| {
                let along = corners.map(|c| c[axis]);
                along.iter().copied().fold(f64::MIN, f64::max)
                    - along.iter().copied().fold(f64::MAX, f64::min)
            })
            .sum();
        let (mut normals, mut heights) = ([Vector3::zeros(); 4], [0.0; 4]);
        let (mut rounding, mut errors) = ([0.0; 4], [0.0; 4]);
        for (c, [p, q, r]) in FACES.map(|face| face.map(|n| corners[n])).into_iter().enumerate() {
            let normal = (q - p).cross(&(r - p));
            let inwards = (middle - p.coords).dot(&normal).signum();
            normals[c] = normal.normalize() * inwards;
            heights[c] = (corners[c] - p).dot(&normals[c]);
            rounding[c] = 10.0 * ROUNDING * (q - p).norm() * (r - p).norm() * size / normal.norm();
            errors[c] = 2.0 * place_error + 2.6 * rounding[c];
        }
        let is_firm = (0..4).all(|c| heights[c] > errors[c]);
        Self { corners, normals, heights, place_error, rounding, errors, is_firm }
    }

    fn distances(&self, p: Point3<f64>) -> [f64; 4] {
        std::array::from_fn(|c| (p - self.corners[FACES[c][0]]).dot(&self.normals[c]))
    }

    /// True if every distance is at least `slack` plus `errors` times its error.
    fn holds(&self, distances: &[f64; 4], slack: f64, errors: f64) -> bool {
        (self.is_firm || errors < 0.0) && (0..4).all(|c| distances[c] >= slack + errors * self.errors[c])
    }
}

/// Corners of the faces; each face is opposite the corner with its number. Distances are measured
/// from the first corner.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];
/// One rounding of `f32`.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;
/// Relative error of a place. Coefficients, positions, the offset, the product and three sums are
/// rounded, of terms of up to √3 places in three axes.
const PLACE_ERROR: f64 = 21.0 * ROUNDING;

/// The allowed results of a scene.
pub struct Oracle {
    /// Intervals of the allowed values of each voxel.
    pub allowed: Vec<Vec<RangeInclusive<f64>>>,
    /// Number of voxels with several intervals that do not overlap.
    pub ambiguous: usize,
    least: ResampleReport,
    most: ResampleReport,
}

impl Oracle {
    pub fn new(scene: &Scene) -> Self {
        let Scene { volume, mesh, deformed, body_tets, removed, .. } = scene;
        let grid = volume.grid();
        let index = |positions: &[Point3<f32>]| -> Vec<Point3<f64>> {
            let mm = |p: &Point3<f32>| mesh.origin_mm + p.coords.map(f64::from) * 1000.0;
            positions.iter().map(|p| grid.affine.to_index(mm(p))).collect()
        };
        let (rest, now) = (index(&mesh.rest), index(deformed));
        let shape = grid.shape.map(|n| n as f64 - 1.0);
        let middle = |axis: usize| {
            let along = || rest.iter().map(|p| p[axis]);
            (along().fold(f64::MIN, f64::max) + along().fold(f64::MAX, f64::min)) / 2.0
        };
        let center = Vector3::from_fn(|axis, _| middle(axis).clamp(0.0, shape[axis]));
        // Half a voxel, because the center on the GPU is a whole voxel.
        let largest = rest
            .iter()
            .map(|p| p.coords)
            .chain([Vector3::zeros(), Vector3::from(shape)])
            .fold(0.0, |most, p| (p - center).amax().max(most))
            + 0.5;
        let tolerance = 2.0 * 16.0 * ROUNDING * largest;
        let pick = |positions: &[Point3<f64>], tet: &[u32; 4]| tet.map(|v| positions[v as usize]);
        let moved = |tet: &[u32; 4]| tet.iter().any(|&v| mesh.rest[v as usize] != deformed[v as usize]);
        let tets = |positions: &[Point3<f64>], list: &[[u32; 4]]| {
            list.iter().map(|tet| Tet::new(pick(positions, tet), center, largest)).collect::<Vec<_>>()
        };
        let current = tets(&now, &mesh.tets);
        let left: Vec<[u32; 4]> = mesh.tets.iter().filter(|tet| moved(tet)).chain(removed).copied().collect();
        let left = tets(&rest, &left);
        let sampler = Sampler::new(volume);

        let mut oracle = Self {
            allowed: Vec::with_capacity(grid.len()),
            ambiguous: 0,
            least: ResampleReport::default(),
            most: ResampleReport::default(),
        };
        for voxel in 0..grid.len() {
            let center = Point3::from(grid.point(voxel).map(|n| n as f64));
            let mut allowed = Vec::new();
            let (mut is_sure, mut strict, mut may_be_moved, mut may_be_at_rest) =
                (false, [[0; 2]; 2], false, false);
            for (t, tet) in current.iter().enumerate() {
                let distances = tet.distances(center);
                let all = |slack: f64, errors: f64| tet.holds(&distances, slack, errors);
                if !all(-tolerance, -1.0) {
                    continue;
                }
                if t < *body_tets {
                    for (errors, [all_tets, of_moved]) in [1.0, -1.0].into_iter().zip(&mut strict) {
                        let holds = usize::from(all(tolerance, errors));
                        *all_tets += holds;
                        *of_moved += holds * usize::from(moved(&mesh.tets[t]));
                    }
                }
                if is_sure {
                    continue;
                }
                is_sure = all(0.0, 1.0);
                if moved(&mesh.tets[t]) {
                    may_be_moved = true;
                    let corners = pick(&rest, &mesh.tets[t]);
                    if !tet.is_firm {
                        allowed.push(f64::MIN..=f64::MAX);
                        continue;
                    }
                    sampler.allow(tet, &distances, &corners, tolerance, &mut allowed);
                } else {
                    may_be_at_rest = true;
                    let value = f64::from(volume.voxels()[voxel]);
                    allowed.push(value..=value);
                }
            }
            let may_be_covered = !allowed.is_empty();
            let reach = |slack: f64, errors: f64| {
                left.iter().any(|tet| tet.holds(&tet.distances(center), slack, errors))
            };
            let (mut may_be_vacated, mut is_vacated) = (false, false);
            if !is_sure {
                may_be_vacated = reach(-tolerance, -1.0);
                let surely_left = reach(0.0, 1.0);
                is_vacated = surely_left && !may_be_covered;
                if may_be_vacated {
                    allowed.push(sampler.air..=sampler.air);
                }
                if !surely_left {
                    let value = f64::from(volume.voxels()[voxel]);
                    allowed.push(value..=value);
                }
            }
            let apart =
                |a: &RangeInclusive<f64>, b: &RangeInclusive<f64>| a.start() > b.end() || b.start() > a.end();
            oracle.ambiguous += usize::from(allowed.iter().any(|a| allowed.iter().any(|b| apart(a, b))));
            oracle.allowed.push(allowed);
            let add = |report: &mut ResampleReport, moved, vacated, fold| {
                report.moved_voxels += usize::from(moved);
                report.vacated_voxels += usize::from(vacated);
                report.folds += usize::from(fold);
            };
            let is_fold = strict.map(|[all, moved]: [usize; 2]| all > 1 && moved > 0);
            add(&mut oracle.least, is_sure && !may_be_at_rest, is_vacated, is_fold[0]);
            add(&mut oracle.most, may_be_moved, may_be_vacated, is_fold[1]);
        }
        oracle
    }

    /// Describes the first voxel or count that is not allowed. `None` if all are.
    pub fn objection(&self, volume: &Volume, report: &ResampleReport) -> Option<String> {
        for (voxel, (&value, allowed)) in volume.voxels().iter().zip(&self.allowed).enumerate() {
            if !allowed.iter().any(|range| range.contains(&f64::from(value))) {
                return Some(format!("{value} at {:?}, allowed: {allowed:?}", volume.grid().point(voxel)));
            }
        }
        let counts = |r: &ResampleReport| [r.moved_voxels, r.vacated_voxels, r.folds];
        let (least, most) = (counts(&self.least), counts(&self.most));
        let wrong = (0..3).any(|n| !(least[n]..=most[n]).contains(&counts(report)[n]));
        wrong.then(|| format!("{report:?}, allowed: {least:?} to {most:?}"))
    }
}

/// The volume and its rule for padding.
struct Sampler<'a> {
    volume: &'a Volume,
    air: f64,
}

impl<'a> Sampler<'a> {
    fn new(volume: &'a Volume) -> Self {
        let exact = (-1024.0 - f64::from(volume.intercept())) / f64::from(volume.slope());
        let all = || volume.voxels().iter().map(|&v| f64::from(v));
        let air = exact.round().max(all().fold(f64::MAX, f64::min)).min(all().fold(f64::MIN, f64::max));
        Self { volume, air }
    }

    /// Adds the values around the rest position of a point with the given distances to the faces.
    fn allow(
        &self,
        tet: &Tet,
        distances: &[f64; 4],
        rest: &[Point3<f64>; 4],
        tolerance: f64,
        allowed: &mut Vec<RangeInclusive<f64>>,
    ) {
        let held: Vec<f64> = (0..4).map(|c| (distances[c] / tet.heights[c]).max(0.0)).collect();
        let sum: f64 = held.iter().sum();
        let place: Vector3<f64> = (0..4).map(|c| rest[c].coords * (held[c] / sum)).sum();
        // The gradient of the map from deformed to rest positions transforms errors.
        let edges =
            |corners: &[Point3<f64>; 4]| Matrix3::from_columns(&[1, 2, 3].map(|c| corners[c] - corners[0]));
        let gradient =
            edges(&tet.corners).try_inverse().map_or(f64::MAX, |inverse| (edges(rest) * inverse).norm());
        let outside = distances.iter().any(|&distance| distance < 2.0 * tolerance);
        let error = (gradient + 1.0) * tet.place_error
            + (1..4).map(|c| tet.rounding[c] / tet.heights[c] * (rest[c] - rest[0]).norm()).sum::<f64>()
            + if outside { gradient * 2.0 * tolerance } else { 0.0 };
        let change = error * self.steepness(place, error);
        // The rule for padding is not continuous, so that it is evaluated on all sides of the
        // position.
        for corner in 0..9 {
            let side = |axis: usize| {
                if corner == 8 {
                    0.0
                } else if corner >> axis & 1 == 1 {
                    error
                } else {
                    -error
                }
            };
            for value in self.at(place + Vector3::new(side(0), side(1), side(2)), error) {
                allowed.push(value - 0.5 - change..=value + 0.5 + change);
            }
        }
    }

    fn voxel(&self, point: [i64; 3]) -> f64 {
        let shape = self.volume.grid().shape;
        let held = std::array::from_fn(|axis| point[axis].clamp(0, shape[axis] as i64 - 1) as usize);
        f64::from(self.volume.voxels()[self.volume.grid().index(held)])
    }

    fn is_padding(&self, value: f64) -> bool {
        if self.volume.slope() > 0.0 { value < self.air } else { value > self.air }
    }

    fn clamped(&self, p: Vector3<f64>) -> Vector3<f64> {
        let shape = self.volume.grid().shape;
        Vector3::from_fn(|axis, _| p[axis].clamp(0.0, shape[axis] as f64 - 1.0))
    }

    /// The trilinear value, and the value of the voxel itself if the position may be its center.
    fn at(&self, p: Vector3<f64>, error: f64) -> Vec<f64> {
        let p = self.clamped(p);
        let low: [i64; 3] = std::array::from_fn(|axis| p[axis].floor() as i64);
        let corners: [f64; 8] = std::array::from_fn(|n| {
            self.voxel(std::array::from_fn(|axis| low[axis] + (n >> axis & 1) as i64))
        });
        let padding = corners.iter().filter(|&&v| self.is_padding(v)).count();
        let sum: f64 = corners
            .iter()
            .enumerate()
            .map(|(n, &v)| {
                let v = if padding < 8 && self.is_padding(v) { self.air } else { v };
                let weight = |axis: usize| {
                    let f = p[axis] - low[axis] as f64;
                    if n >> axis & 1 == 1 { f } else { 1.0 - f }
                };
                v * weight(0) * weight(1) * weight(2)
            })
            .sum();
        let nearest = p.map(f64::round);
        let mut values = vec![sum];
        if (p - nearest).amax() <= 2.0 * error {
            values.push(self.voxel(std::array::from_fn(|axis| nearest[axis] as i64)));
        }
        values
    }

    /// Bound of the change of the value per voxel near a position.
    fn steepness(&self, p: Vector3<f64>, error: f64) -> f64 {
        let p = self.clamped(p);
        let (mut least, mut most) = (f64::MAX, f64::MIN);
        let reach = |axis: usize| (p[axis] - error).floor() as i64..=(p[axis] + error).floor() as i64 + 1;
        for k in reach(2) {
            for j in reach(1) {
                for i in reach(0) {
                    let value = self.voxel([i, j, k]);
                    let held = if self.is_padding(value) { self.air } else { value };
                    least = least.min(value).min(held);
                    most = most.max(value).max(held);
                }
            }
        }
        3.0 * (most - least)
    }
}
