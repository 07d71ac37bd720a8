//! The ends of incisions: where a wound comes to a point.

use cutis_mesh::sever::Embedded;
use nalgebra::Point3;

use crate::body::Body;

/// Distance from a cut, in lattice steps, up to which a point is on its wall.
const ON_THE_WALL: f64 = 0.05;
/// Largest distance beyond an end, in lattice steps, at which tets are divided.
const REACH: f64 = 2.0;

/// Closes wounds beyond the ends of their incisions.
///
/// The last tets of an incision are divided over their whole length, so they open up to a step
/// beyond its end. There the points on both sides of the wall follow the undivided tet, and so they
/// stay together.
pub(super) struct Ends<'a> {
    body: &'a Body,
    /// Number of the first virtual node.
    first_virtual: usize,
    /// The mesh vertex at the place of each virtual node.
    virtual_nodes: &'a [u32],
    step_mm: f64,
}

impl<'a> Ends<'a> {
    pub(super) fn new(body: &'a Body) -> Self {
        let mesh = &body.mesh;
        let virtual_nodes = body.severed.as_ref().map_or(&[][..], |severed| &severed.virtual_nodes);
        let first_virtual = mesh.positions.len() - virtual_nodes.len();
        Self { body, first_virtual, virtual_nodes, step_mm: mesh.lattice.longest_step_mm() }
    }

    /// The point as it is shown: beyond an end it follows the vertices of the mesh, not their
    /// copies.
    pub(super) fn close(&self, point: Embedded) -> Embedded {
        let place = |node: u32| (node as usize).checked_sub(self.first_virtual);
        let is_copy = point.nodes.iter().any(|&node| place(node).is_some());
        if is_copy && self.is_beyond(point.at(&self.body.mesh.positions)) {
            let node = |node: u32| place(node).map_or(node, |number| self.virtual_nodes[number]);
            return Embedded { nodes: point.nodes.map(node), ..point };
        }
        point
    }

    fn is_beyond(&self, at: Point3<f32>) -> bool {
        let cut = &self.body.cut;
        cut.is_beyond_an_end(at, REACH * self.step_mm) && cut.distance_mm(at) > ON_THE_WALL * self.step_mm
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::body::BodySections;
    use crate::ct::source;
    use crate::scene::Override;

    /// Both sides of a wall are one beyond the ends of the demo's incision, and two along it.
    #[test]
    fn a_wound_is_closed_beyond_its_ends_only() {
        let keys = [("volume.phantom", "{ size = [64, 64, 48], seed = 1 }"), ("lattice.spacing_mm", "9.0")];
        let set = keys.map(|(key, value)| Override { key: key.into(), value: value.into() });
        let loaded = crate::demo(&set).unwrap();
        let body = Body::build(&BodySections::of(&loaded), &source::load(&loaded).unwrap().volume).unwrap();
        let ends = Ends::new(&body);
        // The nodes of the points at each place, as they are and as they are shown.
        let mut sides: HashMap<[u32; 3], [Vec<[u32; 4]>; 2]> = HashMap::new();
        for &point in &body.severed.as_ref().unwrap().tet_pieces.points {
            let place = <[f32; 3]>::from(point.at(&body.mesh.positions)).map(f32::to_bits);
            for (shown, nodes) in sides.entry(place).or_default().iter_mut().enumerate() {
                let point = if shown == 1 { ends.close(point) } else { point };
                nodes.push(point.nodes);
            }
        }
        let mut closed = 0;
        for (place, [all, shown]) in &sides {
            let at = Point3::from(place.map(f32::from_bits));
            if ends.is_beyond(at) {
                closed += usize::from(all.iter().any(|nodes| *nodes != all[0]));
                let of_body = shown.iter().flatten().all(|&node| (node as usize) < ends.first_virtual);
                assert!(of_body, "{at} is beyond an end, and moves with {shown:?}");
            } else {
                assert_eq!(all, shown, "{at} is not beyond an end");
            }
        }
        assert!(closed > 0 && closed < sides.len() / 4, "the control: {closed} of {} places", sides.len());
    }
}
