//! The geometry of an incision: its axes on the skin and the height of the skin along it.

use nalgebra::{Point3, Vector3};

use crate::below_skin::through_body;
use crate::incision::Incision;
use crate::path::check_path;
use crate::skin_surface::{Facet, SkinSurface};
use crate::{Lattice, MeshError};

/// Largest distance in m between the skin and a shallow segment, for any length.
const MOST_REACH: f64 = 0.05;
/// Largest number of sample points and bins along one slit. It limits the work for very long
/// segments.
const MOST_BINS: f64 = 1024.0;

/// A segment of an incision placed on the skin at rest. Lengths are in meters, positions in local
/// meters.
///
/// It has three orthogonal axes. *Along* points from start to end. *Inward* is opposite to the mean
/// outward normal of the skin near the segment. *Lateral* is inward × along: the left lip has
/// negative and the right lip positive lateral coordinates.
///
/// *Depth* is measured along the inward axis from the local skin. The height of the local skin
/// varies along the slit, so that curved skin is cut to an even depth.
#[derive(Clone, Debug)]
pub struct Slit {
    /// Number of the incision of which it is a segment.
    pub(crate) incision: usize,
    start: Point3<f64>,
    pub(crate) along: Vector3<f64>,
    pub(crate) lateral: Vector3<f64>,
    pub(crate) inward: Vector3<f64>,
    pub(crate) length: f64,
    /// Zero for a cut of no width.
    half_width: f64,
    depth: f64,
    /// Height above the local skin up to which the slit removes elements.
    above: f64,
    /// Coordinate of the skin along the inward axis, relative to the segment, in the middle of
    /// equal bins along it.
    skin: Vec<f64>,
    /// Share of the bins that have skin.
    on_skin: f64,
}

/// Coordinates of a point with respect to a slit, in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SlitPoint {
    pub along: f64,
    pub lateral: f64,
    /// Depth below the local skin.
    pub depth: f64,
}

impl Slit {
    /// Places the segments of incisions on the skin of a lattice. `skin` holds triangles in flat
    /// lattice indices ([`crate::TissueMask::skin`]).
    ///
    /// This needs no mesh, so the region that is meshed can depend on the slits.
    ///
    /// # Errors
    /// [`MeshError::VertexIndex`] if a triangle names a point that does not exist.
    /// [`MeshError::IncisionSize`] if a length, depth or width is not finite and positive.
    /// [`MeshError::IncisionPath`] if a path has fewer than two points, turns back or crosses
    /// itself. [`MeshError::IncisionWithoutSkin`] if there is no skin.
    /// [`MeshError::IncisionOffSkin`] or [`MeshError::IncisionOverGap`] if a segment is too far
    /// from the skin. [`MeshError::IncisionThroughBody`] if it runs through the body, and
    /// [`MeshError::IncisionThroughSkin`] if it pierces the skin.
    pub fn on_lattice(
        lattice: &Lattice,
        skin: &[[u32; 3]],
        incisions: &[Incision],
    ) -> Result<Vec<Self>, MeshError> {
        let surface = SkinSurface::new(lattice, skin)?;
        let mut slits = Vec::new();
        for (number, incision) in incisions.iter().enumerate() {
            check_path(number, &incision.path_mm, lattice.longest_step_mm())?;
            for ends in incision.path_mm.windows(2) {
                slits.push(Self::place(&surface, number, incision, [ends[0], ends[1]])?);
            }
        }
        Ok(slits)
    }

    /// Finds the axes of the slit and the height of the skin along it.
    ///
    /// Let `reach` be the largest of the depth, a quarter of the length up to 50 mm, and two
    /// lattice steps. This suffices for a segment under strongly curved skin. The segment must come
    /// within `reach` of the center of a skin triangle. Along at least half of the segment there
    /// must be skin within `reach` above or below it.
    pub(crate) fn place(
        surface: &SkinSurface<'_>,
        number: usize,
        cut: &Incision,
        [from_mm, to_mm]: [[f64; 3]; 2],
    ) -> Result<Self, MeshError> {
        let local = |mm: [f64; 3]| Point3::from((Point3::from(mm) - surface.frame.origin_mm) / 1000.0);
        let (start, end) = (local(from_mm), local(to_mm));
        let length = (end - start).norm();
        let width = cut.width_mm.map(|width| ("width_mm", width));
        let sizes = [("length", length * 1000.0), ("depth_mm", cut.depth_mm)].into_iter().chain(width);
        if let Some((key, value)) = sizes.clone().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            return Err(MeshError::IncisionSize { incision: number, key, value });
        }
        let along = (end - start) / length;
        let (depth, half_width) = (cut.depth_mm / 1000.0, cut.width_mm.unwrap_or(0.0) / 2000.0);
        let (step, facets) = (surface.step, &surface.facets);
        let reach = depth.max((length / 4.0).min(MOST_REACH)).max(2.0 * step);

        let from_segment = |facet: &Facet| {
            let s = (facet.center - start).dot(&along).clamp(0.0, length);
            (facet.center - (start + along * s)).norm()
        };
        let from_end = |end: Point3<f64>| {
            facets.iter().map(|facet| (facet.center - end).norm()).fold(f64::INFINITY, f64::min)
        };
        let off_skin = |distance: f64| MeshError::IncisionOffSkin {
            incision: number,
            from_mm,
            to_mm,
            distance_mm: distance * 1000.0,
            ends_mm: [start, end].map(|end| from_end(end) * 1000.0),
            reach_mm: reach * 1000.0,
        };
        if facets.is_empty() {
            return Err(MeshError::IncisionWithoutSkin { incision: number });
        }
        let distance = facets.iter().map(from_segment).fold(f64::INFINITY, f64::min);
        if distance > reach {
            return Err(off_skin(distance));
        }
        let near: Vec<&Facet> =
            facets.iter().filter(|facet| from_segment(facet) <= reach + 2.0 * step).collect();
        let stations = (length / step).ceil().clamp(1.0, MOST_BINS) as usize;
        let places = (0..stations).map(|n| start + along * (length * (n as f64 + 0.5) / stations as f64));
        if let Some((below, at)) = through_body(surface, &near, reach, [start, end], stations) {
            return Err(MeshError::IncisionThroughBody {
                incision: number,
                from_mm,
                to_mm,
                below_mm: below * 1000.0,
                at_mm: surface.frame.to_mm(at.cast()).into(),
            });
        }
        let normal = mean_normal(&near, places, 2.0 * step);
        let outward = normal - along * normal.dot(&along);
        // The direction is not reliable if the angle between skin and segment is above about 84°,
        // or if the normals cancel.
        if outward.norm() < 0.1 {
            return Err(MeshError::IncisionThroughSkin {
                incision: number,
                from_mm,
                to_mm,
                normal: normal.into(),
            });
        }
        let inward = -outward.normalize();
        let lateral = inward.cross(&along);
        let mut slit = Self {
            incision: number,
            start,
            along,
            lateral,
            inward,
            length,
            half_width,
            depth,
            above: reach,
            skin: Vec::new(),
            on_skin: 1.0,
        };
        let (heights, on_skin) = slit.heights(surface);
        slit.on_skin = on_skin as f64 / heights.len() as f64;
        if slit.on_skin < 0.5 {
            let distance = from_end(start).max(from_end(end));
            let (share, reach_mm) = (slit.on_skin, reach * 1000.0);
            let over_gap = MeshError::IncisionOverGap { incision: number, from_mm, to_mm, share, reach_mm };
            return Err(if distance > reach { off_skin(distance) } else { over_gap });
        }
        slit.skin = heights;
        Ok(slit)
    }

    /// Mean height of the skin in bins of about two lattice steps, and the number of bins with
    /// skin. The height in a bin without skin is interpolated.
    fn heights(&self, surface: &SkinSurface<'_>) -> (Vec<f64>, usize) {
        let step = surface.step;
        let count = (self.length / (2.0 * step)).floor().clamp(1.0, MOST_BINS) as usize;
        let mut bins: Vec<Vec<f64>> = vec![Vec::new(); count];
        let facing = surface
            .triangles
            .iter()
            .zip(&surface.facets)
            .filter(|(_, facet)| facet.area_vector.dot(&self.inward) < 0.0);
        let mut vertices: Vec<u32> = facing.flat_map(|(triangle, _)| *triangle).collect();
        vertices.sort_unstable();
        vertices.dedup();
        for vertex in vertices {
            let from_start = surface.position(vertex).cast::<f64>() - self.start;
            let (s, t, q) =
                (from_start.dot(&self.along), from_start.dot(&self.lateral), from_start.dot(&self.inward));
            let over_slit =
                t.abs() <= self.half_width + 1.5 * step && (-step..=self.length + step).contains(&s);
            if over_slit && q.abs() <= self.above + step {
                bins[((s / self.length * count as f64).max(0.0) as usize).min(count - 1)].push(q);
            }
        }
        let known: Vec<(f64, f64)> = bins
            .iter_mut()
            .enumerate()
            .filter(|(_, heights)| !heights.is_empty())
            .map(|(bin, heights)| (bin as f64, robust_mean(heights, 2.0 * step)))
            .collect();
        ((0..count).map(|bin| interpolate(&known, bin as f64)).collect(), known.len())
    }

    /// Coordinates of a rest position.
    pub(crate) fn coordinates(&self, position: Point3<f64>) -> SlitPoint {
        let from_start = position - self.start;
        let along = from_start.dot(&self.along);
        SlitPoint {
            along,
            lateral: from_start.dot(&self.lateral),
            depth: from_start.dot(&self.inward) - self.height(along),
        }
    }

    /// Coordinate of the skin along the inward axis at a length along the segment.
    fn height(&self, along: f64) -> f64 {
        let bin = along / self.length * self.skin.len() as f64 - 0.5;
        let last = self.skin.len() - 1;
        let low = bin.clamp(0.0, last as f64).floor();
        let (low, part) = (low as usize, (bin - low).clamp(0.0, 1.0));
        self.skin[low] + part * (self.skin[(low + 1).min(last)] - self.skin[low])
    }

    /// The point of the skin at a length along the segment, in local meters.
    pub fn skin_at(&self, along: f64) -> Point3<f64> {
        self.start + self.along * along + self.inward * self.height(along)
    }

    /// True if the slit has no width: it severs tissue and removes none.
    pub fn removes_nothing(&self) -> bool {
        self.half_width == 0.0
    }

    /// Depth below the skin in m.
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Height above the skin in m up to which the slit cuts.
    pub(crate) fn above(&self) -> f64 {
        self.above
    }

    /// True if a rest position is in the slit: along the segment, within half the width, and not
    /// below the depth. A slit without a width contains nothing.
    pub(crate) fn contains(&self, position: Point3<f32>) -> bool {
        let point = self.coordinates(position.cast());
        !self.removes_nothing() && point.lateral.abs() <= self.half_width && self.in_middle_surface(point)
    }

    /// True if the slit cuts a simplex with these corners at rest: a corner is in the slit, or an
    /// edge crosses its middle surface.
    pub fn cuts(&self, corners: &[Point3<f32>]) -> bool {
        corners
            .iter()
            .enumerate()
            .any(|(n, &a)| self.contains(a) || corners[n + 1..].iter().any(|&b| self.crosses(a, b)))
    }

    /// True if the straight line between two rest positions crosses the middle surface of the slit
    /// (lateral = 0).
    pub(crate) fn crosses(&self, a: Point3<f32>, b: Point3<f32>) -> bool {
        let (a, b) = (a.cast::<f64>(), b.cast::<f64>());
        let (left, right) = ((a - self.start).dot(&self.lateral), (b - self.start).dot(&self.lateral));
        // A position exactly in the plane counts as right, so that every line has one answer.
        if (left < 0.0) == (right < 0.0) {
            return false;
        }
        let meeting = a + (b - a) * (left / (left - right));
        self.in_middle_surface(self.coordinates(meeting))
    }

    fn in_middle_surface(&self, point: SlitPoint) -> bool {
        (0.0..=self.length).contains(&point.along) && (-self.above..=self.depth).contains(&point.depth)
    }

    /// True if a rest position is within `margin` of the box around the slit.
    pub(crate) fn near(&self, position: Point3<f32>, margin: f64) -> bool {
        let point = self.coordinates(position.cast());
        (-margin..=self.length + margin).contains(&point.along)
            && point.lateral.abs() <= self.half_width + margin
            && (-self.above - margin..=self.depth + margin).contains(&point.depth)
    }

    /// Distance in m from a rest position to the middle surface of the slit.
    pub fn distance(&self, position: Point3<f32>) -> f64 {
        let point = self.coordinates(position.cast());
        let beyond = |v: f64, low: f64, high: f64| (low - v).max(v - high).max(0.0);
        let (s, d) = (beyond(point.along, 0.0, self.length), beyond(point.depth, 0.0, self.depth));
        Vector3::new(s, point.lateral, d).norm()
    }

    /// Length of the segment in m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Number of the incision of which it is a segment.
    pub fn incision(&self) -> usize {
        self.incision
    }

    /// Length of the segment that has skin above or below it, in m.
    pub fn length_on_skin(&self) -> f64 {
        self.on_skin * self.length
    }

    /// Unit vector from the start to the end of the segment.
    pub fn along(&self) -> Vector3<f64> {
        self.along
    }

    /// The point of the skin above the middle of the slit at rest, in local meters.
    pub fn middle(&self) -> Point3<f64> {
        let height = self.skin.get(self.skin.len() / 2).copied().unwrap_or(0.0);
        self.start + self.along * (self.length / 2.0) + self.inward * height
    }

    /// Unit vector across the slit, from the left to the right lip.
    pub fn lateral(&self) -> Vector3<f64> {
        self.lateral
    }

    /// Unit vector into the body.
    pub fn inward(&self) -> Vector3<f64> {
        self.inward
    }
}

/// Mean of the skin normals at some places. The normal at a place is the area-weighted mean of the
/// triangles whose distance is at most `spread` above the smallest distance.
///
/// The result is shorter than 1 if normals differ, and near 0 if they cancel.
fn mean_normal(facets: &[&Facet], places: impl Iterator<Item = Point3<f64>>, spread: f64) -> Vector3<f64> {
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for place in places {
        let nearest = facets.iter().map(|facet| (facet.center - place).norm()).fold(f64::INFINITY, f64::min);
        let (mut normal, mut area) = (Vector3::zeros(), 0.0);
        for facet in facets.iter().filter(|facet| (facet.center - place).norm() <= nearest + spread) {
            normal += facet.area_vector;
            area += facet.area_vector.norm();
        }
        if area > 0.0 {
            sum += normal / area;
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { sum }
}

/// Mean of the values within `spread` of the median, so that a second surface above or below has no
/// influence.
fn robust_mean(values: &mut [f64], spread: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let median = values[values.len() / 2];
    let close = values.iter().filter(|v| (*v - median).abs() <= spread);
    let (sum, count) = close.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    sum / count
}

/// Piecewise linear interpolation of `known` (ascending). It is constant beyond the ends, and 0
/// without values.
fn interpolate(known: &[(f64, f64)], at: f64) -> f64 {
    let next = known.partition_point(|(x, _)| *x < at);
    match (next.checked_sub(1).and_then(|n| known.get(n)), known.get(next)) {
        (Some((x, y)), Some((u, v))) => y + (v - y) * (at - x) / (u - x),
        (Some((_, y)), None) | (None, Some((_, y))) => *y,
        (None, None) => 0.0,
    }
}
