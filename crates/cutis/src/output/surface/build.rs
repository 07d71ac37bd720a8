//! The surface of a body: its skin and the walls of its wounds, each place once.

use std::collections::HashMap;

use cutis_mesh::sever::Embedded;
use cutis_render::tissue_color;
use cutis_volume::Volume;
use nalgebra::Point3;

use super::ends::Ends;
use super::places::Places;
use super::reduce::reduce;
use super::walls::{nodes_of, walls};
use super::{MOST_POINTS, Surface};
use crate::body::Body;

/// No node, and no point.
const NONE: u32 = u32::MAX;

/// A point of the surface.
#[derive(Clone, Copy)]
struct Shown {
    rest: Point3<f32>,
    /// None for a point that never moves.
    embedded: Option<Embedded>,
    on_skin: bool,
}

/// What makes two points one: the nodes that they follow, in order, their place, and whether they
/// are on the skin. So a lip has an edge, and its two sides are two points.
type Key = ([u32; 4], u32, bool);

impl Surface {
    /// The surface of a body with a skin, with at most [`MOST_POINTS`] points. None without a skin.
    /// The points near wounds stay where a coarser surface is shown farther away.
    pub(crate) fn of(body: &Body, ct: &Volume) -> Option<Self> {
        let (positions, triangles) = body.whole_skin(&body.mesh.positions);
        if triangles.is_empty() {
            return None;
        }
        let nodes = body.mesh.positions.len();
        let fixed = nodes + body.inactive_skin.positions.len();
        let edges = body.severed.as_ref().map_or(&[][..], |severed| &severed.skin_pieces.points);
        let ends = Ends::new(body);
        let mut builder = Builder {
            places: Places::new(body.mesh.lattice.longest_step_mm()),
            points: Vec::new(),
            triangles: Vec::new(),
            known: HashMap::new(),
        };
        let mut numbers = vec![NONE; positions.len()];
        for triangle in triangles {
            let corner = |v: u32| {
                let number = &mut numbers[v as usize];
                if *number == NONE {
                    let embedded = match v as usize {
                        v if v < nodes => Some(Embedded::node(v as u32)),
                        v => v.checked_sub(fixed).map(|edge| edges[edge]),
                    };
                    let embedded = embedded.map(|point| ends.close(point));
                    let shown = Shown { rest: positions[v as usize], embedded, on_skin: true };
                    *number = builder.point(shown);
                }
                *number
            };
            let triangle = triangle.map(corner);
            builder.triangles.push(triangle);
        }
        drop((positions, numbers));
        for wall in walls(body, &ends, &mut builder.places) {
            let shown = |point: Embedded| Shown {
                rest: point.at(&body.mesh.positions),
                embedded: Some(point),
                on_skin: false,
            };
            let triangle = wall.map(|point| builder.point(shown(point)));
            builder.triangles.push(triangle);
        }
        let rest: Vec<Point3<f32>> = builder.points.iter().map(|point| point.rest).collect();
        let from_wounds = |point: Point3<f32>| body.cut.distance_mm(point) / 1000.0;
        let kept = reduce(&rest, &builder.triangles, &from_wounds, MOST_POINTS);
        let points: Vec<Shown> = kept.points.iter().map(|&point| builder.points[point as usize]).collect();
        Some(finish(body, ct, &points, kept.triangles))
    }
}

struct Builder {
    places: Places,
    points: Vec<Shown>,
    triangles: Vec<[u32; 3]>,
    known: HashMap<Key, u32>,
}

impl Builder {
    /// The number of a point, which is added if it is new.
    fn point(&mut self, point: Shown) -> u32 {
        let mut nodes = [NONE; 4];
        let followed = point.embedded.iter().flat_map(nodes_of);
        nodes.iter_mut().zip(followed).for_each(|(node, followed)| *node = followed);
        nodes.sort_unstable();
        let key = (nodes, self.places.number(point.rest), point.on_skin);
        let next = self.points.len() as u32;
        let number = *self.known.entry(key).or_insert(next);
        if number == next {
            self.points.push(point);
        }
        number
    }
}

/// Puts the points that can move first, and gives each the color of its tissue.
fn finish(body: &Body, ct: &Volume, points: &[Shown], triangles: Vec<[u32; 3]>) -> Surface {
    let (moving, fixed): (Vec<u32>, Vec<u32>) =
        (0..points.len() as u32).partition(|&n| points[n as usize].embedded.is_some());
    let order = [moving, fixed].concat();
    let mut place = vec![0; points.len()];
    order.iter().zip(0..).for_each(|(&point, now)| place[point as usize] = now);
    let ordered: Vec<&Shown> = order.iter().map(|&point| &points[point as usize]).collect();
    let mut nodes: Vec<u32> =
        ordered.iter().filter_map(|point| point.embedded.as_ref()).flat_map(nodes_of).collect();
    nodes.sort_unstable();
    nodes.dedup();
    // A node without weight has no number.
    let number = |node: &u32| nodes.binary_search(node).unwrap_or(0) as u32;
    let local = |point: Embedded| Embedded { nodes: point.nodes.each_ref().map(number), ..point };
    let affine = &ct.grid().affine;
    let color = |point: &&Shown| {
        let hu = ct.trilinear(affine.to_index(body.mesh.frame.to_mm(point.rest)));
        (tissue_color(hu), point.on_skin)
    };
    Surface {
        rest: ordered.iter().map(|point| point.rest).collect(),
        moving: ordered.iter().filter_map(|point| point.embedded.map(local)).collect(),
        triangles: triangles.into_iter().map(|corners| corners.map(|v| place[v as usize])).collect(),
        tissue: ordered.iter().map(color).collect(),
        nodes,
    }
}
