//! The part of a field of directions that a picture shows, in the plane of the picture.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::LineField;
use super::evenly_spaced::Sample;
use crate::field::Field;
use crate::raymarch::Marcher;
use crate::rays::Rays;
use crate::shade::Shader;
use crate::{Axes, View};

/// How far a triangle acts, in lengths of its longest edge. The skin of a lattice is a staircase up
/// to one step below the skin that the picture shows.
const REACH: f64 = 1.5;
/// Difference in depth of neighboring nodes, over their distance, above which they are on different
/// parts of the body. A surface at 80° to the picture has 6.
const STEEPEST: f64 = 8.0;
/// Least squared length of a direction in the picture. A shorter one points to the viewer.
const LEAST_IN_PICTURE: f64 = 0.03;

/// The field at the nodes of a grid in the picture.
pub(super) struct VisibleField {
    /// Distance between nodes, pixels.
    spacing: f64,
    /// Largest difference in depth between neighbors on the same surface, mm.
    most_depth_mm: f64,
    /// Nodes in a row.
    columns: usize,
    nodes: Vec<Option<Node>>,
}

/// A node on a surface, with sums over the triangles near it.
#[derive(Clone, Copy)]
struct Node {
    place_mm: Point3<f64>,
    /// Distance towards the viewer, mm.
    depth_mm: f64,
    sums: Sums,
}

/// Sums over triangles: their share, their weight, and the tensor of their directions in the
/// picture, weighted by both.
#[derive(Clone, Copy, Default)]
struct Sums {
    share: f64,
    weight: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Sums {
    fn add(&mut self, other: &Self, factor: f64) {
        self.share += factor * other.share;
        self.weight += factor * other.weight;
        self.xx += factor * other.xx;
        self.xy += factor * other.xy;
        self.yy += factor * other.yy;
    }
}

impl VisibleField {
    /// Samples the field at nodes `spacing` pixels apart.
    pub fn new(
        field: &Field<'_>,
        rays: &Rays<'_>,
        view: &View<'_>,
        axes: &Axes,
        lines: &LineField<'_>,
        spacing: f64,
    ) -> Self {
        let [columns, rows] = [view.width, view.height].map(|n| (n as f64 / spacing).ceil() as usize + 1);
        let marcher = Marcher::new(field, rays, view.threshold_hu);
        let shader = Shader::new(field, view, axes);
        let node = |n: usize| {
            let place = [n % columns, n / columns].map(|step| step as f64 * spacing);
            let hit = marcher.cast(&rays.through(place)?)?;
            let on_skin = !hit.on_cut && shader.exposure(hit.index, &shader.normal(hit.index)) < 0.5;
            let place_mm = field.to_mm(hit.index);
            let depth_mm = place_mm.coords.dot(&axes.toward);
            on_skin.then_some(Node { place_mm, depth_mm, sums: Sums::default() })
        };
        let nodes = (0..columns * rows).into_par_iter().map(node).collect();
        let most_depth_mm = STEEPEST * spacing * rays.pixel_mm;
        let mut visible = Self { spacing, most_depth_mm, columns, nodes };
        for triangle in 0..lines.triangles.len() {
            visible.add(rays, axes, lines, triangle);
        }
        visible
    }

    /// Adds a triangle to the nodes near it, if it faces the viewer.
    fn add(&mut self, rays: &Rays<'_>, axes: &Axes, lines: &LineField<'_>, triangle: usize) {
        let corners = lines.triangles[triangle]
            .map(|vertex| lines.origin_mm + lines.positions[vertex as usize].coords.map(f64::from) * 1000.0);
        let edges = [corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]];
        let facing = edges[0].cross(&edges[1]).dot(&axes.toward) / 2.0;
        if facing <= 0.0 {
            return;
        }
        let reach = REACH * edges.iter().map(Vector3::norm).fold(0.0, f64::max);
        let middle = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
        let weight = f64::from(lines.weights[triangle]);
        let direction = Vector3::from(lines.directions[triangle]).map(f64::from);
        let [x, y] = [direction.dot(&axes.right), -direction.dot(&axes.up)];
        let sums = Sums { share: 1.0, weight, xx: weight * x * x, xy: weight * x * y, yy: weight * y * y };

        let (columns, rows) = (self.columns, self.nodes.len() / self.columns);
        let at = rays.pixel_of(middle);
        let steps = reach / rays.pixel_mm / self.spacing;
        let span = |axis: usize, count: usize| {
            let step = at[axis] / self.spacing;
            let low = (step - steps).ceil().clamp(0.0, count as f64);
            let high = (step + steps).floor().clamp(-1.0, count as f64 - 1.0);
            low as usize..(high + 1.0) as usize
        };
        for row in span(1, rows) {
            for column in span(0, columns) {
                if let Some(node) = &mut self.nodes[row * columns + column] {
                    let near = 1.0 - (node.place_mm - middle).norm_squared() / (reach * reach);
                    if near > 0.0 {
                        node.sums.add(&sums, facing * near * near);
                    }
                }
            }
        }
    }

    /// The direction at a place of the picture, in pixels from its top left corner. None where the
    /// picture shows no skin of the field, at an edge of the body, and where the direction points
    /// to the viewer.
    pub fn at(&self, place: [f64; 2]) -> Option<Sample> {
        let [x, y] = place.map(|c| c / self.spacing);
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        if column + 1 >= self.columns {
            return None;
        }
        let (right, below) = (x - column as f64, y - row as f64);
        let mut sums = Sums::default();
        let (mut nearest, mut farthest) = (f64::NEG_INFINITY, f64::INFINITY);
        for (corner, part) in [
            (0, (1.0 - right) * (1.0 - below)),
            (1, right * (1.0 - below)),
            (self.columns, (1.0 - right) * below),
            (self.columns + 1, right * below),
        ] {
            let node = self.nodes.get(row * self.columns + column + corner)?.as_ref()?;
            if node.sums.share <= 0.0 {
                return None;
            }
            sums.add(&node.sums, part / node.sums.share);
            nearest = nearest.max(node.depth_mm);
            farthest = farthest.min(node.depth_mm);
        }
        if nearest - farthest > self.most_depth_mm || sums.xx + sums.yy <= LEAST_IN_PICTURE * sums.weight {
            return None;
        }
        // The angle of the main eigenvector is half that of (difference, twice the mixed term).
        let (difference, mixed) = (sums.xx - sums.yy, 2.0 * sums.xy);
        let angle = mixed.atan2(difference) / 2.0;
        let agreement = difference.hypot(mixed) / (sums.xx + sums.yy);
        Some(Sample { direction: [angle.cos(), angle.sin()], opacity: (sums.weight * agreement) as f32 })
    }
}
