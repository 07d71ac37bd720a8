//! How deep a segment of an incision runs below the skin.

use nalgebra::Point3;

use crate::skin_surface::{Facet, SkinSurface};

/// Largest depth of a segment below the skin, over its length. A chord of a circle has this sag if
/// it spans about 90°.
const DEEPEST: f64 = 0.2;

/// The largest depth below the skin in m of a segment that runs through the body, and its place.
/// None if the segment follows the skin.
///
/// Each stretch of the segment below the skin may be deeper than the shallower one of its ends by
/// [`DEEPEST`] of the segment's length, or of twice its own length if that is less, or by two
/// lattice steps. `near` are the facets within `reach` and two lattice steps of the segment.
pub(crate) fn through_body(
    surface: &SkinSurface<'_>,
    near: &[&Facet],
    reach: f64,
    [start, end]: [Point3<f64>; 2],
    stations: usize,
) -> Option<(f64, Point3<f64>)> {
    let place = |n: usize| start + (end - start) * (n as f64 / stations as f64);
    let depth = |n: usize| {
        let depth = depth_below(near.iter().copied(), place(n), surface.step);
        if depth.abs() <= reach { depth } else { depth_below(surface.facets.iter(), place(n), surface.step) }
    };
    let depths: Vec<(usize, f64)> = (0..=stations).map(|n| (n, depth(n))).collect();
    let interval = (end - start).norm() / stations as f64;
    let deepest = |stretch: &[(usize, f64)]| {
        let &(at, below) = stretch.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let ends = stretch[0].1.min(stretch[stretch.len() - 1].1);
        let length = (end - start).norm().min(2.0 * interval * stretch.len() as f64);
        let most = (DEEPEST * length).max(2.0 * surface.step);
        (below > 0.0 && below - ends > most).then(|| (below, place(at)))
    };
    let stretches = depths.chunk_by(|a, b| (a.1 > 0.0) == (b.1 > 0.0));
    stretches.filter_map(deepest).max_by(|a, b| a.0.total_cmp(&b.0))
}

/// Distance in m from a place to the skin, negative outside the body. The sign is that of the mean
/// height of the facets that are at most a lattice step farther than the closest one.
fn depth_below<'a>(facets: impl Iterator<Item = &'a Facet> + Clone, place: Point3<f64>, step: f64) -> f64 {
    let distance = |facet: &Facet| (facet.center - place).norm();
    let nearest = facets.clone().map(distance).fold(f64::INFINITY, f64::min);
    let close = facets.filter(|facet| distance(facet) <= nearest + step);
    let height: f64 = close.map(|facet| facet.area_vector.dot(&(facet.center - place))).sum();
    if height > 0.0 { nearest } else { -nearest }
}
