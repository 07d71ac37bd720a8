//! Stitches across a wound: pairs of points of the skin, or of tissue below it.

use nalgebra::{Point3, Vector3, distance};

use crate::piece::Piece;
use crate::sever::closest_in_triangle;
use crate::skin_surface::Facet;
use crate::slit::Slit;
use crate::{Cut, MeshError, TetMesh};

/// Largest number of stitches of a wound.
const MOST_STITCHES: f64 = 1000.0;

/// Where stitches along a wound are. All lengths are in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stitching {
    /// Distance from one stitch to the next.
    pub every: f64,
    /// Distance of the ends of a stitch from the edge of the wound.
    pub bite: f64,
    /// Depth of the ends below the skin. 0: on the skin.
    pub depth: f64,
}

/// A stitch: a point on the left side of a wound, and one on its right side. They lie on the skin,
/// or below it on faces of tets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stitch {
    /// The triangles on which the two points lie, in mesh vertices. They share no vertex.
    pub triangles: [[u32; 3]; 2],
    /// Weights of the second and third corner of each triangle.
    pub weights: [[f64; 2]; 2],
    /// Distance of the points at rest in m.
    pub rest: f64,
    /// Distance of the points in m when the edges of the wound meet.
    pub closed: f64,
}

impl Stitch {
    /// The vertices of both triangles.
    pub fn vertices(&self) -> [u32; 6] {
        let [[a, b, c], [d, e, f]] = self.triangles;
        [a, b, c, d, e, f]
    }
}

/// A point that is close to a wanted one.
struct End {
    triangle: [u32; 3],
    weights: [f64; 3],
    point: Point3<f64>,
}

/// The triangles on which stitches end: the skin, or faces of tets.
struct Tissue<'a> {
    mesh: &'a TetMesh,
    triangles: Vec<[u32; 3]>,
    /// Largest distance of an end from its wanted place, in m.
    reach: f64,
}

impl Tissue<'_> {
    fn corners(&self, triangle: &[u32; 3]) -> [Point3<f32>; 3] {
        triangle.map(|v| self.mesh.positions[v as usize])
    }

    /// The closest point to a wanted one that fits, on a triangle whose area vector fits.
    fn end(
        &self,
        wanted: Point3<f64>,
        faces: &dyn Fn(&Vector3<f64>) -> bool,
        fits: &dyn Fn(Point3<f64>) -> bool,
    ) -> Option<End> {
        let facing =
            self.triangles.iter().filter(|triangle| faces(&Facet::of(self.corners(triangle)).area_vector));
        let ends = facing.map(|triangle| {
            let corners = self.corners(triangle).map(|corner| corner.cast::<f64>());
            let weights = closest_in_triangle(&corners, wanted);
            let sum = corners
                .iter()
                .zip(weights)
                .fold(Vector3::zeros(), |sum, (corner, w)| sum + corner.coords * w);
            End { triangle: *triangle, weights, point: Point3::from(sum) }
        });
        let far = |end: &End| distance(&end.point, &wanted);
        let near = ends.filter(|end| far(end) <= self.reach && fits(end.point));
        near.min_by(|a, b| far(a).total_cmp(&far(b)))
    }
}

/// The stitch between two ends, if they share no vertex. `closed` is computed from its rest length.
fn join(left: &End, right: &End, closed: impl Fn(f64) -> f64) -> Option<Stitch> {
    if left.triangle.iter().any(|v| right.triangle.contains(v)) {
        return None;
    }
    let rest = distance(&left.point, &right.point);
    let weights = [left.weights, right.weights].map(|[_, b, c]| [b, c]);
    Some(Stitch { triangles: [left.triangle, right.triangle], weights, rest, closed: closed(rest) })
}

/// Number of stitches along a wound. The error is the least distance in m.
fn count(length: f64, every: f64) -> Result<usize, f64> {
    let count = (length / every).round().max(1.0);
    if count > MOST_STITCHES { Err(length / MOST_STITCHES) } else { Ok(count as usize) }
}

impl Cut {
    /// The skin near a wound, or the faces of whole tets near it if the stitches lie below the
    /// skin.
    fn tissue_near<'a>(
        mesh: &'a TetMesh,
        skin: &[[u32; 3]],
        bite: f64,
        depth: f64,
        near: impl Fn(Point3<f32>, f64) -> bool,
    ) -> Tissue<'a> {
        // The skin may be bent, and its triangles are those of the lattice.
        let reach = 2.0 * mesh.lattice.longest_step_mm() / 1000.0 + 0.25 * bite;
        let is_near = |vertex: u32| near(mesh.positions[vertex as usize], bite + depth + 2.0 * reach);
        let triangles = if depth > 0.0 {
            let tets = mesh.tets[..mesh.whole_tets()].iter().filter(|tet| is_near(tet[0]));
            tets.flat_map(|&[a, b, c, d]| [[a, b, c], [a, b, d], [a, c, d], [b, c, d]]).collect()
        } else {
            skin.iter().filter(|triangle| is_near(triangle[0])).copied().collect()
        };
        Tissue { mesh, triangles, reach }
    }

    /// Stitches along an incision at equal distances of about `every`. Their ends are about `bite`
    /// from the incision. `skin` holds triangles of the mesh, none of them divided by a cut.
    ///
    /// # Errors
    /// [`MeshError::StitchOffSkin`] if a stitch has no tissue near one of its ends, or if no cut is
    /// between them. [`MeshError::TooManyStitches`] for more than 1000.
    ///
    /// # Panics
    /// If there is no such incision.
    pub fn stitches(
        &self,
        incision: usize,
        mesh: &TetMesh,
        skin: &[[u32; 3]],
        at: &Stitching,
    ) -> Result<Vec<Stitch>, MeshError> {
        let Stitching { every, bite, depth } = *at;
        let slits = self.incisions().nth(incision).expect("the incision exists");
        let length: f64 = slits.iter().map(Slit::length).sum();
        let count = count(length, every).map_err(|least| MeshError::TooManyStitches {
            incision,
            every_mm: every * 1000.0,
            least_mm: least * 1000.0,
        })?;
        let near = |p: Point3<f32>, margin: f64| slits.iter().any(|slit| slit.near(p, margin));
        let tissue = Self::tissue_near(mesh, skin, bite, depth, near);
        let off_skin = |at: Point3<f64>| MeshError::StitchOffSkin {
            incision,
            at_mm: mesh.frame.to_mm(at.cast()).into(),
            reach_mm: tissue.reach * 1000.0,
        };
        let stitch = |number: usize| {
            let (slit, along) = at_length(slits, length * (number as f64 + 0.5) / count as f64);
            let middle = slit.skin_at(along);
            let end = |side: f64| {
                let wanted = middle + slit.lateral() * (side * bite) + slit.inward() * depth;
                let faces = |area: &Vector3<f64>| depth > 0.0 || area.dot(&slit.inward()) < 0.0;
                let on_side = |point: Point3<f64>| side * slit.coordinates(point).lateral > 0.2 * bite;
                tissue.end(wanted, &faces, &on_side).ok_or_else(|| off_skin(wanted))
            };
            join(&end(-1.0)?, &end(1.0)?, |rest| rest).ok_or_else(|| off_skin(middle))
        };
        (0..count).map(stitch).collect()
    }

    /// Stitches across an excision, along the line between the two points of its outline that are
    /// farthest apart. Their ends are about `bite` from the outline. For the rest see
    /// [`Cut::stitches`].
    ///
    /// # Errors
    /// [`MeshError::Excision`] if a stitch has no tissue near one of its ends, or for more than
    /// 1000 stitches.
    ///
    /// # Panics
    /// If there is no such excision.
    pub fn stitches_across(
        &self,
        excision: usize,
        mesh: &TetMesh,
        skin: &[[u32; 3]],
        at: &Stitching,
    ) -> Result<Vec<Stitch>, MeshError> {
        let Stitching { every, bite, depth } = *at;
        let piece = &self.pieces[excision];
        let axis = &piece.axis;
        let refuse = |why: String| MeshError::Excision { excision, why };
        let count = count(axis.length(), every).map_err(|least| {
            let (every_mm, least_mm) = (every * 1000.0, least * 1000.0);
            refuse(format!("stitches every {every_mm} mm are too many; give at least {least_mm:.3} mm"))
        })?;
        let near = |p: Point3<f32>, margin: f64| piece.outline.iter().any(|slit| slit.near(p, margin));
        let tissue = Self::tissue_near(mesh, skin, bite, depth, near);
        let off_skin = |at: Point3<f64>| {
            let at_mm: [f64; 3] = mesh.frame.to_mm(at.cast()).into();
            let reach_mm = tissue.reach * 1000.0;
            refuse(format!(
                "a stitch has no tissue within {reach_mm:.1} mm of {at_mm:.1?} mm; use a finer lattice, \
                 or change bite_mm"
            ))
        };
        let stitch = |number: usize| {
            let along = axis.length() * (number as f64 + 0.5) / count as f64;
            let [left, right] = sides(piece, along);
            let middle = axis.skin_at(along);
            let end = |side: f64, edge: f64| {
                let wanted = middle + axis.lateral() * (edge + side * bite) + axis.inward() * depth;
                let faces = |area: &Vector3<f64>| depth > 0.0 || area.dot(&axis.inward()) < 0.0;
                let beyond =
                    |point: Point3<f64>| side * (axis.coordinates(point).lateral - edge) > 0.2 * bite;
                tissue.end(wanted, &faces, &beyond).ok_or_else(|| off_skin(wanted))
            };
            let closed = |rest: f64| (rest - (right - left)).max(0.0);
            join(&end(-1.0, left)?, &end(1.0, right)?, closed).ok_or_else(|| off_skin(middle))
        };
        (0..count).map(stitch).collect()
    }

    /// Stitches between pairs of points near the skin, in mm. The edges of the wound meet when the
    /// points are `closed` apart, in m. `skin` is as in [`Cut::stitches`].
    ///
    /// # Errors
    /// [`MeshError::StitchPair`] if a point is too far from the skin, or if no cut lies between the
    /// two points.
    pub fn stitches_between(
        &self,
        pairs_mm: &[[[f64; 3]; 2]],
        mesh: &TetMesh,
        skin: &[[u32; 3]],
        closed: f64,
    ) -> Result<Vec<Stitch>, MeshError> {
        let skin = Self::tissue_near(mesh, skin, 0.0, 0.0, |_, _| true);
        let stitch = |(pair, ends): (usize, &[[f64; 3]; 2])| {
            let refuse = |why: String| MeshError::StitchPair { pair, why };
            let end = |mm: [f64; 3]| {
                let wanted = mesh.frame.to_local(mm.into()).cast();
                skin.end(wanted, &|_| true, &|_| true).ok_or_else(|| {
                    let reach_mm = skin.reach * 1000.0;
                    refuse(format!("there is no whole skin within {reach_mm:.1} mm of {mm:.1?} mm"))
                })
            };
            let [left, right] = [end(ends[0])?, end(ends[1])?];
            let [a, b]: [Point3<f32>; 2] = [left.point.cast(), right.point.cast()];
            let mut walls = self.slits.iter().chain(self.pieces.iter().flat_map(|piece| &piece.outline));
            let cut = walls.any(|slit| slit.crosses(a, b));
            let stitch = join(&left, &right, |_| closed).filter(|_| cut);
            stitch.ok_or_else(|| refuse(format!("no cut lies between {:?} and {:?} mm", ends[0], ends[1])))
        };
        pairs_mm.iter().enumerate().map(stitch).collect()
    }
}

/// Lateral coordinates of the left and right edge of a piece at a length along its axis, in m.
fn sides(piece: &Piece, along: f64) -> [f64; 2] {
    let at = |point: Point3<f64>| {
        let at = piece.axis.coordinates(point);
        [at.along, at.lateral]
    };
    let mut sides = [0.0_f64; 2];
    for slit in &piece.outline {
        let [[s, t], [u, v]] = [at(slit.skin_at(0.0)), at(slit.skin_at(slit.length()))];
        if (s <= along) != (u <= along) {
            let lateral = t + (v - t) * (along - s) / (u - s);
            sides = [sides[0].min(lateral), sides[1].max(lateral)];
        }
    }
    sides
}

/// The slit at a length along a path, and the length along the slit.
fn at_length(slits: &[Slit], mut along: f64) -> (&Slit, f64) {
    for slit in &slits[..slits.len() - 1] {
        if along <= slit.length() {
            return (slit, along);
        }
        along -= slit.length();
    }
    let last = &slits[slits.len() - 1];
    (last, along.min(last.length()))
}
