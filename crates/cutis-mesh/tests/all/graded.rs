//! Tests of graded lattices, which differ from even ones only in the positions of the points.

use cutis_mesh::{
    Cut, Grading, Incision, Lattice, MeshError, Planes, SkinMode, SkinOptions, Slit, Split, TetMesh, Tissue,
    TissueMask, skin,
};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

use crate::oracle;

/// A rotated, mirrored and slightly sheared grid with three different steps.
fn even() -> Grid {
    let rows = [[0.0, -2.0, 0.0, 30.0], [3.0, 0.0, 0.4, -20.0], [0.0, 0.0, 2.5, 10.0], [0.0, 0.0, 0.0, 1.0]];
    Grid { shape: [30, 26, 24], affine: Affine::from_rows(rows).unwrap() }
}

fn graded(fine: [[f64; 2]; 3], split: Split) -> Lattice {
    let planes = Planes::new(&even(), fine, &Grading { growth: 1.6, coarsest: 4.0 }).unwrap();
    Lattice::graded(even(), split, planes).unwrap()
}

fn mesh(lattice: &Lattice, is_tissue: impl Fn(Point3<f64>) -> bool) -> (TetMesh, Vec<bool>) {
    let grid = lattice.grid();
    let air: Vec<bool> = (0..grid.len()).map(|point| !is_tissue(lattice.mm(grid.point(point)))).collect();
    (oracle::build(lattice, &vec![40.0; air.len()], &air, true).unwrap(), air)
}

const EVERYWHERE: [[f64; 2]; 3] = [[-1.0, 99.0]; 3];
const MIDDLE: [[f64; 2]; 3] = [[11.0, 17.2], [9.0, 14.0], [0.0, 5.0]];

#[test]
fn positive_tets_fill_the_extent_of_the_lattice() {
    let even_mm3 = even().affine.voxel_volume_mm3().abs() * (29 * 25 * 23) as f64;
    for split in [Split::Kuhn6, Split::Five] {
        let lattice = graded(MIDDLE, split);
        assert!(lattice.grid().len() * 3 < even().len());
        let (mesh, _) = mesh(&lattice, |_| true);
        let volumes = mesh.tet_volumes();
        assert!(volumes.iter().all(|&volume| volume > 0.0));
        let sum = volumes.iter().map(|&volume| f64::from(volume)).sum::<f64>() * 1e9;
        assert!((sum / even_mm3 - 1.0).abs() < 1e-4, "{sum} {even_mm3}");
        let closed = cutis_mesh::Topology::of(&mesh.boundary());
        assert_eq!((closed.open_edges.len(), closed.euler_characteristic), (0, 2));
    }
}

#[test]
fn a_zone_over_the_whole_extent_gives_the_even_lattice() {
    let (all_fine, even) = (graded(EVERYWHERE, Split::Kuhn6), Lattice::new(even(), Split::Kuhn6).unwrap());
    let half = |p: Point3<f64>| p.x < 5.0;
    let ((a, air), (b, _)) = (mesh(&all_fine, half), mesh(&even, half));
    assert!(air.contains(&true));
    assert_eq!((&a.positions, &a.tets, &a.edges), (&b.positions, &b.tets, &b.edges));
    let volume =
        Volume::new(*even.grid(), (0..even.grid().len()).map(|n| (n % 501) as i16).collect(), 1.0, 0.0)
            .unwrap();
    assert_eq!(all_fine.sample(&volume).unwrap(), even.sample(&volume).unwrap());
    assert_ne!(graded(MIDDLE, Split::Kuhn6).sample(&volume).unwrap().len(), volume.grid().len());
}

#[test]
fn the_fine_zone_has_the_points_of_the_even_lattice() {
    let lattice = graded(MIDDLE, Split::Kuhn6);
    let planes = lattice.planes().unwrap();
    let mut fine = 0;
    for point in (0..lattice.grid().len()).map(|point| lattice.grid().point(point)) {
        let index = even().affine.to_index(lattice.mm(point));
        let within = (0..3)
            .all(|axis| (MIDDLE[axis][0].floor()..=MIDDLE[axis][1].ceil()).contains(&index[axis].round()));
        if planes.is_fine(point) {
            fine += 1;
            assert!(within && (index - index.map(f64::round)).norm() < 1e-9, "{point:?} {index}");
        } else {
            assert!(!within || (index - index.map(f64::round)).norm() > 1e-9);
        }
    }
    assert_eq!(fine, 8 * 6 * 6);
}

#[test]
fn incisions_that_leave_the_fine_zone_are_refused() {
    let skin_at = even().mm([15, 25, 12]);
    let inside = |p: Point3<f64>| p.x > skin_at.x + 3.0;
    let along = (even().mm([1, 0, 0]) - even().mm([0, 0, 0])).normalize();
    let cut = |zone: [[f64; 2]; 3]| {
        let lattice = graded(zone, Split::Kuhn6);
        let (mesh, air) = mesh(&lattice, inside);
        let body = TissueMask::find(&lattice, &Tissue { air: &air, cut_away: &[], largest_component: true })
            .unwrap();
        let found = skin::detect(&lattice, &air, SkinMode::Boundary, &SkinOptions::default()).unwrap();
        let skin = body.skin(&found).0;
        let middle = skin_at + Vector3::x() * 3.0;
        let ends = [-12.0, 12.0].map(|s| (middle + along * s).into());
        let incision = Incision { path_mm: ends.to_vec(), depth_mm: 8.0, width_mm: Some(3.0) };
        let slits = Slit::on_lattice(&lattice, &skin, &[incision])?;
        Cut::of_slits(&mesh, &mesh.divide_skin(&skin).0, slits)
    };
    let enough = [[4.0, 26.0], [10.0, 25.0], [3.0, 21.0]];
    let cut_fine = cut(enough).unwrap();
    assert!(cut_fine.removed.contains(&true));
    for axis in 0..3 {
        let mut short = enough;
        short[axis] = if axis == 1 { [20.0, 25.0] } else { [12.0, 14.0] };
        let refused = cut(short).unwrap_err();
        assert!(matches!(refused, MeshError::IncisionBeyond { coarse: true, .. }), "{axis}: {refused}");
    }
}
