//! `deformed.nii.gz`: grid, scaling, and where the landmarks are after the run.

use super::body::{HU, MARKERS_MM, MOVE_MM, ct, finished};
use super::nifti::Nifti;

fn deformed() -> Nifti {
    Nifti::of_bytes(&finished().files["deformed.nii.gz"])
}

/// Center of the voxels of a marker on the patient's right (`true`) or left.
fn marker(volume: &Nifti, right: bool) -> [f64; 3] {
    let level = f64::from(HU[0] + HU[1]) / 2.0;
    let voxels = (0..volume.voxels.len()).filter(|&n| volume.hu(n) > level);
    let places: Vec<_> = voxels.map(|n| volume.at(n)).filter(|at| (at[0] > 10.0) == right).collect();
    assert!(places.len() > 20, "{} voxels of a marker", places.len());
    [0, 1, 2].map(|axis| places.iter().map(|at| at[axis]).sum::<f64>() / places.len() as f64)
}

#[test]
fn grid_and_scaling_match_the_input() {
    let (before, after) = (ct(), deformed());
    assert_eq!((after.shape, after.scaling), (before.shape, [1.0, 0.0]));
    for (found, expected) in after.rows.iter().flatten().zip(before.rows.iter().flatten()) {
        assert!((found - expected).abs() < 1e-3, "{:?}", after.rows);
    }
    assert_eq!(after.codes, [1, 1], "qform and sform are both in use");
}

#[test]
fn markers_move_with_the_handle() {
    let after = deformed();
    let right = marker(&after, true);
    for axis in 0..3 {
        let moved = right[axis] - MARKERS_MM[0][axis];
        assert!((moved - MOVE_MM[axis]).abs() < 1.0, "axis {axis}: {moved} mm, not {}", MOVE_MM[axis]);
    }
    let left = marker(&after, false);
    for axis in 0..3 {
        let moved = left[axis] - MARKERS_MM[1][axis];
        let most = 0.75 * MOVE_MM[axis].abs();
        assert!(moved.abs() < most, "axis {axis}: the left marker moved by {moved} mm");
    }
}

/// Fixed tissue keeps its voxels except at its edges. All values lie between air and the markers.
#[test]
fn fixed_tissue_keeps_its_voxels() {
    let (before, after) = (ct(), deformed());
    let fixed = |n: &usize| {
        let [x, y, z] = before.at(*n);
        y < -36.0 && (-80.0..45.0).contains(&x) && (-80.0..45.0).contains(&z)
    };
    assert!((0..before.voxels.len()).filter(fixed).any(|n| before.voxels[n] > 0));
    assert!((0..before.voxels.len()).filter(fixed).all(|n| before.voxels[n] == after.voxels[n]));
    assert!(after.voxels.iter().all(|voxel| (-1000..=HU[1]).contains(voxel)));
}

/// Voxels that changed, and those that changed from tissue to air, compared with the counts of the
/// report.
#[test]
fn voxel_counts_match_the_file() {
    let (run, before, after) = (finished(), ct(), deformed());
    let is_tissue = |volume: &Nifti, n: usize| volume.voxels[n] > -449;
    let count =
        |counts: &dyn Fn(usize) -> bool| (0..before.voxels.len()).filter(|&n| counts(n)).count() as f64;
    let (moved, vacated) = (run.number("/resample/moved_voxels"), run.number("/resample/vacated_voxels"));
    // Where tissue is uniform, a voxel that moved keeps its value.
    let changed = count(&|n| before.voxels[n] != after.voxels[n]);
    assert!((1.0..6.0).contains(&((moved + vacated) / changed)), "{moved} moved, {changed} changed");
    let left = count(&|n| is_tissue(&before, n) && !is_tissue(&after, n));
    assert!(left > 50.0 && (0.8..2.0).contains(&(vacated / left)), "{vacated} vacated, {left} now of air");
    assert_eq!(run.number("/resample/folds"), 0.0);
}
