//! Presses a dent into the belly of a phantom: meshes its tissue, moves the vertices, and resamples
//! the volume through the deformed mesh. Prints what happened to the voxels.
#![forbid(unsafe_code)]
#![expect(clippy::print_stdout, reason = "the example prints its result")]

use std::error::Error;

use cutis_mesh::{Lattice, Split, Tissue, TissueMask};
use cutis_resample::{Warp, resample};
use cutis_volume::phantom::Phantom;
use nalgebra::{Point3, Vector3};

/// Depth of the dent, mm.
const DEPTH_MM: f64 = 25.0;
/// Radius of the dent, mm.
const RADIUS_MM: f64 = 60.0;

fn main() -> Result<(), Box<dyn Error>> {
    let phantom = Phantom::new([64, 64, 40], 3)?;
    let volume = phantom.volume()?;
    let grid = *volume.grid();
    let hu: Vec<f32> = volume.voxels().iter().map(|&v| f32::from(v)).collect();
    let air: Vec<bool> = hu.iter().map(|&hu| hu < -449.0).collect();
    let lattice = Lattice::new(grid, Split::Kuhn6)?;
    let mesh = TissueMask::find(&lattice, &Tissue { air: &air, cut_away: &[], largest_component: true })?
        .mesh(&hu)?;

    // A smooth push towards the back, strongest at a point of the belly's skin.
    let (site, _) = phantom.incision_site();
    let pushed = |p: &Point3<f32>| {
        let distance_mm = (mesh.frame.to_mm(*p) - Point3::from(site)).norm();
        let depth_mm = DEPTH_MM * (-(distance_mm / RADIUS_MM).powi(2)).exp();
        p - Vector3::new(0.0, (depth_mm / 1000.0) as f32, 0.0)
    };
    let deformed: Vec<Point3<f32>> = mesh.positions.iter().map(pushed).collect();
    let warp = Warp {
        origin_mm: mesh.frame.origin_mm,
        rest: &mesh.positions,
        deformed: &deformed,
        tets: &mesh.tets,
        body_tets: mesh.tets.len(),
        removed: &[],
    };
    let (pressed, report) = resample(&volume, &warp, &|_done, _total| {})?;

    println!("{:?} voxels of {:.1?} mm, {} tets", grid.shape, grid.affine.spacing_mm(), mesh.tets.len());
    println!("{} voxels moved, {} became air", report.moved_voxels, report.vacated_voxels);
    println!("{} voxels in two places, {} inverted tets", report.folds, report.inverted_tets);
    let thickness_mm = |volume: &cutis_volume::Volume| {
        let [i, _, k] = [0, 1, 2].map(|axis| grid.affine.to_index(Point3::from(site))[axis].round() as usize);
        let row = (0..grid.shape[1]).filter(|&j| volume.voxels()[grid.index([i, j, k])] > -449);
        row.count() as f64 * grid.affine.spacing_mm()[1]
    };
    println!(
        "tissue behind the site: {:.0} mm, then {:.0} mm",
        thickness_mm(&volume),
        thickness_mm(&pressed)
    );
    Ok(())
}
