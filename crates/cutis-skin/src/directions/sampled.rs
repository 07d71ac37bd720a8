//! Directions from strokes: samples them on the skin and continues them harmonically.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::graph::SkinGraph;
use super::harmonic;
use super::tensor::Tensor;
use crate::nearest::Nearest;
use crate::strokes::{Polyline, Strokes};
use crate::vertices::SkinVertices;
use crate::{BodySkin, SkinError};

/// Samples per lattice step along a stroke.
const PER_STEP: f64 = 2.0;

/// Largest number of samples of all strokes.
const MOST_SAMPLES: f64 = 2e7;

/// Default reach in units of the longest distance between neighboring lattice planes.
const REACH_STEPS: f64 = 3.0;

/// Smallest mean of the squared sine between a stroke and the normals. Below, at angles of less
/// than 30° on average, the stroke pierces the skin.
const LEAST_ALONG: f64 = 0.25;

/// Direction and weight at each triangle.
pub(super) fn from_strokes(
    skin: &BodySkin<'_>,
    normals: &[Vector3<f64>],
    strokes: &Strokes,
) -> Result<Vec<(Vector3<f64>, f64)>, SkinError> {
    let vertices = SkinVertices::of(skin);
    let positions_mm = vertices.positions_mm(skin);
    let fixed = at_vertices(skin, &vertices, &positions_mm, normals, strokes)?;
    let graph = SkinGraph::new(&vertices.triangles, &positions_mm);
    let tensors = harmonic::extend(&graph, &fixed);
    let at_triangle = |(triangle, normal): (&[u32; 3], &Vector3<f64>)| {
        let [a, b, c] = triangle.map(|vertex| tensors[vertex as usize]);
        let (direction, gap) = ((a + b + c) * (1.0 / 3.0)).main_in_plane(normal);
        (direction, gap.min(1.0))
    };
    Ok(vertices.triangles.par_iter().zip(normals).map(at_triangle).collect())
}

/// The tensors at the vertices that are nearest to the strokes.
fn at_vertices(
    skin: &BodySkin<'_>,
    vertices: &SkinVertices,
    positions_mm: &[Point3<f64>],
    normals: &[Vector3<f64>],
    strokes: &Strokes,
) -> Result<Vec<Option<Tensor>>, SkinError> {
    let reach_mm = strokes.reach_mm().unwrap_or_else(|| REACH_STEPS * longest_step_mm(skin));
    let normals = vertex_normals(skin, vertices, normals);
    let sampler = Sampler {
        strokes,
        nearest: Nearest::new(positions_mm, reach_mm),
        reach_mm,
        step_mm: shortest_step_mm(skin) / PER_STEP,
    };
    sampler.check_length()?;
    let mut sums = vec![Sum::default(); positions_mm.len()];
    for stroke in strokes.polylines() {
        sampler.add(stroke, &normals, &mut sums)?;
    }
    Ok(sums.into_iter().map(|sum| sum.mean()).collect())
}

/// The samples at one vertex.
#[derive(Clone, Copy, Default)]
struct Sum {
    tensor: Tensor,
    /// Length of the samples, weighted by the squared sine of their angle to the normal.
    weight: f64,
    /// Length of the samples in mm.
    length: f64,
}

impl Sum {
    /// Adds a sample of a stroke with this unit tangent. Returns its weight.
    fn add(&mut self, tangent: &Vector3<f64>, normal: &Vector3<f64>, length: f64) -> f64 {
        let direction = tangent - normal * normal.dot(tangent);
        let along = direction.norm_squared();
        self.length += length;
        if along > 0.0 {
            self.tensor += Tensor::of_direction(&(direction / along.sqrt())) * (along * length);
            self.weight += along * length;
        }
        along * length
    }

    /// The mean of the samples. `None` without samples, or if they pierce the skin.
    fn mean(&self) -> Option<Tensor> {
        let along = self.length > 0.0 && self.weight >= LEAST_ALONG * self.length;
        along.then(|| self.tensor * (1.0 / self.weight))
    }
}

/// Walks along strokes at short distances.
struct Sampler<'a> {
    strokes: &'a Strokes,
    nearest: Nearest<'a>,
    reach_mm: f64,
    step_mm: f64,
}

impl Sampler<'_> {
    fn check_length(&self) -> Result<(), SkinError> {
        let length_mm = self.strokes.polylines().iter().map(Polyline::length_mm).sum::<f64>();
        let most_mm = self.step_mm * MOST_SAMPLES;
        if length_mm <= most_mm {
            return Ok(());
        }
        // A stroke that leaves the skin has the better message.
        for stroke in self.strokes.polylines() {
            for (point, &at) in stroke.points_mm().iter().enumerate() {
                self.vertex_at(stroke, point, at)?;
            }
        }
        Err(SkinError::StrokesTooLong { path: self.strokes.path().into(), length_mm, most_mm })
    }

    /// Adds the samples of a stroke to the skin vertices that are nearest to them.
    fn add(&self, stroke: &Polyline, normals: &[Vector3<f64>], sums: &mut [Sum]) -> Result<(), SkinError> {
        let (mut in_skin, mut total) = (0.0, 0.0);
        for (point, pair) in stroke.points_mm().windows(2).enumerate() {
            let way = pair[1] - pair[0];
            let length = way.norm();
            let count = (length / self.step_mm).ceil();
            for n in 0..count as usize {
                let at = pair[0] + way * ((n as f64 + 0.5) / count);
                let vertex = self.vertex_at(stroke, point, at)?;
                in_skin += sums[vertex].add(&(way / length), &normals[vertex], length / count);
                total += length / count;
            }
        }
        if in_skin >= LEAST_ALONG * total {
            return Ok(());
        }
        Err(SkinError::StrokeThroughSkin {
            path: self.strokes.path().into(),
            place: stroke.place(),
            along: in_skin / total,
            least: LEAST_ALONG,
        })
    }

    fn vertex_at(&self, stroke: &Polyline, point: usize, at: Point3<f64>) -> Result<usize, SkinError> {
        self.nearest.within_reach(&at).ok_or_else(|| SkinError::StrokeOffSkin {
            path: self.strokes.path().into(),
            place: stroke.place(),
            point,
            at_mm: at.into(),
            distance_mm: self.nearest.distance(&at),
            reach_mm: self.reach_mm,
        })
    }
}

/// Unit normals at the vertices: the means of the normals around them, weighted by projected area.
fn vertex_normals(
    skin: &BodySkin<'_>,
    vertices: &SkinVertices,
    normals: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let weighted = |(triangle, normal): (&[u32; 3], &Vector3<f64>)| {
        normal * skin.area_vector_mm2(triangle).dot(normal).abs()
    };
    let weighted: Vec<Vector3<f64>> = skin.triangles().par_iter().zip(normals).map(weighted).collect();
    let sums = vertices.gather(Vector3::zeros(), &weighted);
    sums.into_iter().map(|sum| sum.try_normalize(0.0).unwrap_or(sum)).collect()
}

fn shortest_step_mm(skin: &BodySkin<'_>) -> f64 {
    skin.lattice().grid().affine.spacing_mm().into_iter().fold(f64::INFINITY, f64::min)
}

/// Longest distance in mm between neighboring planes of the lattice, along its axes.
fn longest_step_mm(skin: &BodySkin<'_>) -> f64 {
    let steps_mm = skin.lattice().grid().affine.spacing_mm();
    let widest = |axis: usize| {
        let planes = skin.lattice().planes().map(|planes| &planes.axes()[axis]);
        planes.map_or(1.0, |planes| planes.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max))
    };
    (0..3).map(|axis| steps_mm[axis] * widest(axis)).fold(0.0, f64::max)
}
