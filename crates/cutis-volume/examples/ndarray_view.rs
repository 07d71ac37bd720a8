//! Views a volume and a lattice field as `ndarray` arrays, without a copy.
//!
//! Both views are indexed `[i, j, k]`. For this phantom, axis 0 runs to the patient's right, axis 1
//! to the front and axis 2 to the head. Run it with
//! `cargo run -p cutis-volume --example ndarray_view`.
#![expect(clippy::print_stdout, reason = "an example that prints its results")]

use cutis_volume::phantom::Phantom;
use cutis_volume::sample;
use ndarray::Axis;

/// Threshold for bone in HU.
const BONE_HU: f32 = 250.0;

fn main() -> Result<(), cutis_volume::VolumeError> {
    let volume = Phantom::new([128, 128, 96], 1)?.volume()?;
    let view = volume.view();

    // A threshold on all voxels.
    let bone = view.iter().filter(|&&stored| volume.hu(stored) > BONE_HU).count();
    println!("{bone} of {} voxels are bone\n", view.len());

    // Statistics of every 16th axial slice.
    println!(" k   z / mm   mean HU   max HU   bone voxels");
    for (k, slice) in view.axis_iter(Axis(2)).enumerate().step_by(16) {
        let hu = slice.mapv(|stored| volume.hu(stored));
        let (mean, max) = (hu.mean().unwrap_or(f32::NAN), hu.fold(f32::NEG_INFINITY, |a, &b| a.max(b)));
        let bone = hu.iter().filter(|&&hu| hu > BONE_HU).count();
        let z = volume.grid().mm([0, 0, k]).z;
        println!("{k:2} {z:8.1} {mean:9.1} {max:8.0} {bone:13}");
    }

    // The same for values at lattice points: a profile through the middle from the back to the
    // front.
    let lattice = sample::lattice_grid(volume.grid(), sample::LatticeSize::SpacingMm(25.0))?;
    let hu = sample::to_grid(&volume, &lattice)?;
    let field = lattice.view(&hu)?;
    let (nx, _, nz) = field.dim();
    let profile = field.index_axis(Axis(2), nz / 2).index_axis_move(Axis(0), nx / 2).mapv(f32::round);
    println!("\nHU from back to front: {profile}");
    Ok(())
}
