//! Writes a synthetic CT to a NIfTI file, reads it back and samples it on a coarser lattice.
//!
//! Run it with `cargo run -p cutis-volume --example nifti_and_lattice`.
#![expect(clippy::print_stdout, reason = "an example that prints its results")]

use cutis_volume::phantom::Phantom;
use cutis_volume::{Table, TableKind, nifti, sample};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("torso.nii.gz");
    Phantom::new([128, 128, 96], 1)?.write(&path, &|_, _| {})?;
    let size = std::fs::metadata(&path)?.len();

    let loaded = nifti::read(&path)?;
    let (grid, stats) = (loaded.volume.grid(), loaded.stats);
    println!("file         {:.1} MB, {}", size as f64 / 1e6, loaded.dtype);
    println!("voxels       {:?}, {:?} mm apart", grid.shape, grid.affine.spacing_mm());
    println!("orientation  {}", grid.affine.orientation().iter().collect::<String>());
    println!("HU           {} to {}", stats.min, stats.max);

    // The tent filter averages several voxels per lattice point, so that fine structures do not
    // alias.
    let lattice = sample::lattice_grid(grid, "6.0".parse()?)?;
    let hu = sample::to_grid(&loaded.volume, &lattice)?;
    println!("lattice      {:?}, {:.2?} mm apart", lattice.shape, lattice.affine.spacing_mm());

    let alpha = Table::preset(TableKind::Alpha, "paper")?;
    let density = Table::preset(TableKind::Density, "schneider2000")?;
    let cell_m3 = lattice.affine.voxel_volume_mm3().abs() * 1e-9;
    let tissue = hu.iter().filter(|&&hu| !alpha.is_air(hu));
    let mass_kg: f64 = tissue.map(|&hu| f64::from(density.at(hu)) * cell_m3).sum();
    println!("tissue       {mass_kg:.1} kg, including the scanner table");
    Ok(())
}
