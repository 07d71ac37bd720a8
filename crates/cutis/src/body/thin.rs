//! Finds skin on parts that are only a few lattice steps thick, as an ear is. The tension of both
//! sides acts on few tetrahedra there, which cannot resist it as tissue does.

use cutis_mesh::{Lattice, TetMesh, TissueMask};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Thickness in lattice steps below which a part is thin.
const STEPS: f64 = 3.0;
/// Skin vertices on thin parts up to which nothing is reported, as a number and as a share of the
/// skin: a few are at corners.
const FEW: (usize, f64) = (20, 1e-3);

/// Warning about the skin of a mesh on thin parts. `skin` are triangles in flat lattice indices.
pub(super) fn warning(whole: &TissueMask, mesh: &TetMesh, skin: &[[u32; 3]]) -> Option<String> {
    let lattice = whole.lattice();
    let mut moves = vec![false; lattice.grid().len()];
    let border = mesh.inactive.as_ref().map(|inactive| inactive.border.as_slice());
    for (vertex, &point) in mesh.lattice_index.iter().enumerate() {
        moves[point as usize] = border.is_none_or(|border| !border[vertex]);
    }
    let (mut thin, mut moving) = (Vec::new(), 0_u32);
    for (point, is_thin) in thickness(lattice, whole.vertices(), skin) {
        moving += u32::from(moves[point as usize]);
        thin.extend((is_thin && moves[point as usize]).then_some(point));
    }
    let few = FEW.0.max((FEW.1 * f64::from(moving)) as usize);
    let middle = *thin.get(thin.len() / 2).filter(|_| thin.len() > few)?;
    let at_mm: [f64; 3] = lattice.mm(lattice.grid().point(middle as usize)).into();
    Some(format!(
        "{} of {moving} vertices of the skin lie on parts that are thinner than {STEPS} lattice steps ({:.1} mm), \
         for example at {at_mm:.0?} mm: the tension of both sides may crumple or tear them. Look at skin.vtu \
         there; use a finer lattice, or leave the part out of lattice.region",
        thin.len(),
        STEPS * lattice.longest_step_mm()
    ))
}

/// Each point of the skin in ascending order, and whether the body is thin there: a line into the
/// body leaves it within [`STEPS`] at another part of the skin. Lines are straight in lattice
/// steps.
fn thickness(lattice: &Lattice, tissue: &[bool], skin: &[[u32; 3]]) -> Vec<(u32, bool)> {
    let grid = lattice.grid();
    let mut points: Vec<u32> = skin.iter().flatten().copied().collect();
    points.par_sort_unstable();
    points.dedup();
    let number = |point: u32| points.partition_point(|&other| other < point);
    let place = |point: u32| Vector3::from(grid.point(point as usize).map(|n| n as f64));
    // Triangles are oriented in the world, and a lattice may be its mirror image.
    let axes = Matrix3::from_columns(&[0, 1, 2].map(|axis| grid.affine.step_mm(axis)));
    let sign = axes.determinant().signum();
    let mut outward = vec![Vector3::zeros(); points.len()];
    for corners in skin {
        let [a, b, c] = corners.map(place);
        let normal = (b - a).cross(&(c - a)) * sign;
        corners.iter().for_each(|&corner| outward[number(corner)] += normal);
    }
    // Means over neighbors, because facets of a lattice have few directions.
    let mut smooth = vec![Vector3::zeros(); points.len()];
    for corners in skin {
        let numbers = corners.map(number);
        let sum: Vector3<f64> =
            numbers.iter().map(|&n| outward[n].try_normalize(0.0).unwrap_or_default()).sum();
        numbers.iter().for_each(|&n| smooth[n] += sum);
    }
    let nearest = |at: Vector3<f64>| {
        let index = at.map(|v| v.round());
        let within = (0..3).all(|axis| index[axis] >= 0.0 && index[axis] < grid.shape[axis] as f64);
        within.then(|| grid.index([0, 1, 2].map(|axis| index[axis] as usize)) as u32)
    };
    let leaves = |(&point, outward): (&u32, &Vector3<f64>)| {
        let Some(inward) = outward.try_normalize(0.0).map(|normal| -normal) else { return (point, false) };
        let mut last = point;
        for half in 1..=(2.0 * STEPS) as usize {
            // Beyond the end of the scan the body goes on.
            let Some(next) = nearest(place(point) + inward * (half as f64 / 2.0)) else { break };
            if !tissue[next as usize] {
                let on_skin = points.binary_search(&last).is_ok();
                return (point, on_skin && (place(next) - place(last)).dot(&inward) > 0.0);
            }
            last = next;
        }
        (point, false)
    };
    points.par_iter().zip(&smooth).map(leaves).collect()
}

#[cfg(test)]
mod tests {
    use cutis_mesh::{SkinMode, SkinOptions, Split, skin};
    use cutis_volume::{Affine, Grid};

    use super::*;

    /// Share of the skin of a plate that is thin. The plate is `steps` thick, and `slope` steps
    /// rise for each step along it.
    fn share(steps: f64, slope: f64, mirror: f64) -> f64 {
        let affine = Affine::from_spacing([2.0 * mirror, 2.0, 2.0], [0.0; 3]).unwrap();
        let grid = Grid { shape: [40, 40, 40], affine };
        let inside = |[i, j, k]: [usize; 3]| {
            let height = (k as f64 - 12.0 - slope * i as f64) / (1.0 + slope * slope).sqrt();
            (5..35).contains(&i) && (5..35).contains(&j) && (0.0..=steps).contains(&height)
        };
        let air: Vec<bool> = (0..grid.len()).map(|n| !inside(grid.point(n))).collect();
        let lattice = Lattice::new(grid, Split::Five).unwrap();
        let found = skin::detect(&lattice, &air, SkinMode::Exterior, &SkinOptions::default()).unwrap();
        let tissue: Vec<bool> = air.iter().map(|air| !air).collect();
        let all = thickness(&lattice, &tissue, &found.triangles);
        all.iter().filter(|(_, thin)| *thin).count() as f64 / all.len() as f64
    }

    #[test]
    fn plates_are_thin_up_to_three_steps_in_any_direction_and_in_a_mirror() {
        for (slope, mirror) in [(0.0, 1.0), (0.4, 1.0), (0.4, -1.0)] {
            let [thin, thick] = [2.0, 6.0].map(|steps| share(steps, slope, mirror));
            assert!(thin > 0.8 && thick < 0.05, "slope {slope}, mirror {mirror}: {thin} and {thick}");
        }
    }
}
