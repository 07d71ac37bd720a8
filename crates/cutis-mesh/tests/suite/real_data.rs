//! Counts on real CT volumes against an independent program's.

use std::path::PathBuf;

use cutis_mesh::{Lattice, SkinMode, SkinOptions, Split, TetMesh, Tissue, skin};
use cutis_volume::nifti;

/// The test data's folder, or `None` with a printed reason; in CI its absence is a failure.
fn data() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let folder = PathBuf::from(std::env::var_os("CUTIS_TEST_DATA").unwrap_or_else(|| beside.into()));
    if folder.join("ct").is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "no test data at {}", folder.display());
    eprintln!("skipped: no test data at {} (set CUTIS_TEST_DATA)", folder.display());
    None
}

/// File, histogram of air corners, triangles, triangles given twice.
const LITERAL: [(&str, [usize; 5], usize, usize); 3] = [
    ("abdomen_ts_129x107x118", [5_944_490, 159_059, 149_947, 158_365, 3_112_875], 148_367, 10_692),
    ("leg_sts013_129x110x114", [3_658_505, 119_625, 113_302, 120_845, 5_447_179], 112_895, 6_730),
    ("headphantom_imagex_129x129x105", [1_607_329, 147_245, 150_218, 164_425, 8_154_399], 136_683, 10_562),
];

#[test]
fn literal_skin_counts_of_three_volumes() {
    let Some(folder) = data() else { return };
    for (name, histogram, triangles, duplicates) in LITERAL {
        let volume = nifti::read(folder.join(format!("ct/{name}.nii.gz"))).unwrap().volume;
        let hu: Vec<f32> = volume.voxels().iter().map(|&stored| volume.hu(stored)).collect();
        // −449 HU itself is tissue.
        let air: Vec<bool> = hu.iter().map(|&hu| hu < -449.0).collect();
        let lattice = Lattice::new(*volume.grid(), Split::Kuhn6).unwrap();
        let report = skin::detect(&lattice, &air, SkinMode::Paper, &SkinOptions::default()).unwrap().report;
        assert_eq!(report.air_vertex_histogram, histogram, "{name}");
        assert_eq!((report.triangles, report.duplicates), (triangles, duplicates), "{name}");

        // Without stray sheets, every open edge lies on the box.
        let options = SkinOptions::default();
        let boundary = skin::detect(&lattice, &air, SkinMode::Boundary, &options).unwrap().report;
        assert_eq!(boundary.open_edges, boundary.open_edges_on_box, "{name}");

        // One surface, with next to no hole, that covers the iso-surface.
        let skin = skin::detect(&lattice, &air, SkinMode::Exterior, &options).unwrap();
        let exterior = &skin.report;
        assert!(exterior.components == 1 && exterior.coverage > 0.99, "{name}: {exterior:?}");
        assert!(exterior.open_edges - exterior.open_edges_on_box < exterior.triangles / 1000, "{name}");

        let tissue = Tissue { air: &air, cut_away: &[], largest_component: true };
        let mesh = TetMesh::build(&lattice, &hu, &tissue).unwrap();
        assert_eq!(mesh.tets.len() + mesh.dropped_tets, histogram[0], "{name}");
        assert!(mesh.tet_volumes().iter().all(|&volume| volume > 0.0), "{name}");
        assert_eq!(skin.on_mesh(&mesh).1, 0, "{name}");
    }
}
