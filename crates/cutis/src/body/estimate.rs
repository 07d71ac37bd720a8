//! Estimates the size of a body from the voxels of its CT, before the lattice is sampled. So a
//! lattice that is far too fine is refused at once.

use cutis_mesh::{Lattice, Split};
use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use super::{BodySections, region};
use crate::scene::{IncisionSection, Zone};

/// Most voxels that are looked at. A larger CT is sampled.
const MOST_SAMPLES: usize = 4_000_000;

/// About how many tetrahedra the body will have: the volume of the tissue in the region over that
/// of a cell. None for a graded lattice, and for undermined skin and excisions, whose cuts are not
/// known yet.
pub(super) fn tets(sections: &BodySections<'_>, volume: &Volume, lattice: &Lattice) -> Option<u64> {
    let known = sections.lattice.grading.is_none() && sections.excisions.is_empty();
    if !(known && sections.underminings.is_empty()) {
        return None;
    }
    let grid = volume.grid();
    let stride = (grid.len() as f64 / MOST_SAMPLES as f64).cbrt().ceil().max(1.0) as usize;
    let zone = region::region_zone(sections.lattice);
    let paths: Vec<(Vec<Point3<f64>>, f64)> = sections.incisions.iter().map(path).collect();
    let held = |mm: Point3<f64>| match zone {
        None => true,
        Some(Zone::Box(min, max)) => (0..3).all(|axis| (min[axis]..=max[axis]).contains(&mm[axis])),
        // The mesh holds each tetrahedron with a corner in the region.
        Some(Zone::Around(around)) => region::near_action(
            sections.handles,
            from_paths(&paths, mm),
            mm,
            around + lattice.longest_step_mm(),
        ),
    };
    let [nx, ny, nz] = grid.shape;
    let air = sections.tissue.air_below_hu;
    let in_slice = |k: usize| {
        let rows = (0..ny).step_by(stride);
        let at = rows.flat_map(|j| (0..nx).step_by(stride).map(move |i| [i, j, k]));
        at.filter(|&at| volume.hu(volume.voxels()[grid.index(at)]) >= air && held(grid.mm(at))).count()
    };
    let slices: Vec<usize> = (0..nz).step_by(stride).collect();
    let samples = slices.into_par_iter().map(in_slice).reduce(|| 0, |a, b| a + b);
    let volume_of = |steps: [f64; 3]| steps.iter().product::<f64>();
    let per_sample = volume_of(grid.affine.spacing_mm()) * (stride as f64).powi(3);
    let cells = samples as f64 * per_sample / volume_of(lattice.grid().affine.spacing_mm());
    let per_cell = match lattice.split() {
        Split::Five => 5.0,
        Split::Kuhn6 => 6.0,
    };
    Some((cells * per_cell) as u64)
}

/// The path of an incision, and how much nearer its blade is in the mean, mm: half of its depth.
fn path(incision: &IncisionSection) -> (Vec<Point3<f64>>, f64) {
    (incision.path().into_iter().map(Point3::from).collect(), incision.depth_mm / 2.0)
}

/// About the distance of a place from the nearest blade, mm.
fn from_paths(paths: &[(Vec<Point3<f64>>, f64)], mm: Point3<f64>) -> f64 {
    let segments = paths.iter().flat_map(|(path, nearer)| path.windows(2).map(move |ends| (ends, nearer)));
    let distance = |(ends, nearer): (&[Point3<f64>], &f64)| {
        let along = ends[1] - ends[0];
        let share = (mm - ends[0]).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
        (mm - (ends[0] + along * share.clamp(0.0, 1.0))).norm() - nearer
    };
    segments.map(distance).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::body::Body;
    use crate::ct::source;
    use crate::scene::Scene;

    /// The estimate is that of the body within a fifth, with and without a region.
    #[test]
    fn the_estimate_is_near_the_body() {
        for (region, split) in
            [("'whole'", "five"), ("{ around_mm = 60 }", "five"), ("{ around_mm = 60 }", "kuhn6")]
        {
            let text = format!(
                "volume = {{ phantom = {{ size = [64, 64, 48], seed = 1 }} }}\n\
                 lattice = {{ spacing_mm = 5.0, region = {region}, split = '{split}' }}\n\
                 incision = [{{ from_mm = [30, 110, -30], to_mm = [30, 110, 30], depth_mm = 20 }}]"
            );
            let loaded = Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap();
            let sections = BodySections::of(&loaded);
            let source = source::load(&loaded).unwrap();
            let lattice = super::super::lattice::lattice(&sections, &source.volume).unwrap();
            let estimate = tets(&sections, &source.volume, &lattice).unwrap() as f64;
            let found = Body::build(&sections, &source.volume).unwrap().mesh.whole_tets() as f64;
            assert!((estimate / found - 1.0).abs() < 0.2, "{region}, {split}: {estimate} and {found}");
        }
    }
}
