//! Compares counts on real CT volumes with those of an independent program.

use cutis_mesh::{Lattice, SkinMode, SkinOptions, Split, Tissue, TissueMask, skin};
use cutis_test_kit::scans;
use cutis_volume::nifti;

/// File name, histogram of air corners, number of triangles, number of triangles found twice.
const LITERAL: [(&str, [usize; 5], usize, usize); 3] = [
    ("abdomen_ts_129x107x118", [5_944_490, 159_059, 149_947, 158_365, 3_112_875], 148_367, 10_692),
    ("leg_sts013_129x110x114", [3_658_505, 119_625, 113_302, 120_845, 5_447_179], 112_895, 6_730),
    ("headphantom_imagex_129x129x105", [1_607_329, 147_245, 150_218, 164_425, 8_154_399], 136_683, 10_562),
];

#[test]
fn literal_skin_counts_equal_those_of_an_independent_program() {
    for (name, histogram, triangles, duplicates) in LITERAL {
        let Some(path) = scans::find(&format!("ct/{name}.nii.gz")) else { continue };
        let volume = nifti::read(path).unwrap().volume;
        let hu: Vec<f32> = volume.voxels().iter().map(|&stored| volume.hu(stored)).collect();
        // Exactly −449 HU is tissue.
        let air: Vec<bool> = hu.iter().map(|&hu| hu < -449.0).collect();
        let lattice = Lattice::new(*volume.grid(), Split::Kuhn6).unwrap();
        let report = skin::detect(&lattice, &air, SkinMode::Paper, &SkinOptions::default()).unwrap().report;
        assert_eq!(report.air_vertex_histogram, histogram, "{name}");
        assert_eq!((report.triangles, report.duplicates), (triangles, duplicates), "{name}");

        // Without stray sheets, every open edge is on the box.
        let options = SkinOptions::default();
        let boundary = skin::detect(&lattice, &air, SkinMode::Boundary, &options).unwrap().report;
        assert_eq!(boundary.open_edges, boundary.open_edges_on_box, "{name}");

        // The exterior is one surface with very few holes that covers the iso-surface.
        let skin = skin::detect(&lattice, &air, SkinMode::Exterior, &options).unwrap();
        let exterior = &skin.report;
        assert!(exterior.components == 1 && exterior.coverage > 0.99, "{name}: {exterior:?}");
        assert!(exterior.open_edges - exterior.open_edges_on_box < exterior.triangles / 1000, "{name}");

        let tissue = Tissue { air: &air, cut_away: &[], largest_component: true };
        let body = TissueMask::find(&lattice, &tissue).unwrap();
        let mesh = body.mesh(&hu).unwrap();
        assert_eq!(mesh.tets.len() + mesh.dropped_tets, histogram[0], "{name}");
        assert!(mesh.tet_volumes().iter().all(|&volume| volume > 0.0), "{name}");
        assert_eq!(body.skin(&skin).1, 0, "{name}");
    }
}
