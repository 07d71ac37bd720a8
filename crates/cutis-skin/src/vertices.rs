//! Compact numbers for the vertices of a skin.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::BodySkin;

/// The vertices of a skin, numbered from 0 in lattice order.
pub(crate) struct SkinVertices {
    /// Flat lattice index of each vertex, ascending.
    pub points: Vec<u32>,
    /// The triangles in vertex numbers.
    pub triangles: Vec<[u32; 3]>,
}

impl SkinVertices {
    pub fn of(skin: &BodySkin<'_>) -> Self {
        let mut points: Vec<u32> = skin.triangles().iter().flatten().copied().collect();
        points.par_sort_unstable();
        points.dedup();
        let number = |point: u32| points.partition_point(|&other| other < point) as u32;
        let triangles = skin.triangles().par_iter().map(|triangle| triangle.map(number)).collect();
        Self { points, triangles }
    }

    /// World positions of the vertices in mm.
    pub fn positions_mm(&self, skin: &BodySkin<'_>) -> Vec<Point3<f64>> {
        self.points.par_iter().map(|&point| skin.mm(point)).collect()
    }

    /// The sum over the triangles around each vertex of a value per triangle, in the order of the
    /// triangles.
    pub fn gather<T: Copy + std::ops::AddAssign>(&self, zero: T, values: &[T]) -> Vec<T> {
        let mut sums = vec![zero; self.points.len()];
        for (triangle, &value) in self.triangles.iter().zip(values) {
            for &vertex in triangle {
                sums[vertex as usize] += value;
            }
        }
        sums
    }
}
