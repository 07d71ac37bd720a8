//! The skin of solids with known surfaces, from the file to the report.

use cutis::mesh::{SkinMode, SkinReport, Split};
use cutis::volume::{Volume, nifti, phantom, sample::LatticeSize};
use cutis::{Silent, SkinRequest};

fn skin(volume: &Volume, mode: SkinMode, lattice: LatticeSize) -> SkinReport {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("solid.nii.gz");
    nifti::write(&file, volume).unwrap();
    let request =
        SkinRequest { read: Default::default(), lattice, split: Split::Kuhn6, mode, offset_hu: 0.0 };
    cutis::find_skin(&file, &request, None, &Silent).unwrap()
}

fn is_one_closed_sphere(report: &SkinReport) -> bool {
    let edges = (report.open_edges, report.non_manifold_edges);
    edges == (0, 0) && report.components == 1 && report.euler_characteristic == 2
}

#[test]
fn a_sphere_has_one_closed_skin() {
    let ball = phantom::sphere([40, 36, 44], [2.0, 2.5, 1.5], 25.0, 40).unwrap();
    for lattice in [LatticeSize::Native, LatticeSize::SpacingMm(3.0), LatticeSize::Vertices([25, 30, 28])] {
        for mode in [SkinMode::Exterior, SkinMode::Boundary] {
            let report = skin(&ball, mode, lattice);
            assert!(
                report.triangles > 500 && is_one_closed_sphere(&report),
                "{mode:?} {lattice:?}: {report:?}"
            );
        }
    }
}

/// Only the outer sphere is skin. The other rules also find the hollow and the inner ball.
#[test]
fn only_the_outer_of_two_nested_spheres_is_skin() {
    let nested = phantom::nested_spheres([48, 48, 48], [1.5; 3], [32.0, 22.0, 12.0], 40).unwrap();
    let solid = phantom::sphere([48, 48, 48], [1.5; 3], 32.0, 40).unwrap();
    let exterior = skin(&nested, SkinMode::Exterior, LatticeSize::Native);
    assert!(is_one_closed_sphere(&exterior), "{exterior:?}");
    assert_eq!(exterior.triangles, skin(&solid, SkinMode::Exterior, LatticeSize::Native).triangles);
    assert!(exterior.enclosed_share > 0.2, "{exterior:?}");

    let boundary = skin(&nested, SkinMode::Boundary, LatticeSize::Native);
    assert_eq!((boundary.components, boundary.euler_characteristic), (3, 6));
    assert!(!is_one_closed_sphere(&boundary));
}
