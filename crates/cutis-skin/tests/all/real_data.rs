//! Fields on the skin of real CT volumes.

use std::collections::BTreeMap;

use cutis_mesh::{Lattice, SkinMode, Split};
use cutis_skin::{Directions, SkinField};
use cutis_test_kit::scans;
use cutis_volume::nifti;
use nalgebra::Vector3;

use crate::shapes::Body;

/// Mean angle in degrees between the vectors of two triangles with a common edge.
fn mean_change(triangles: &[[u32; 3]], vectors: &[Vector3<f64>]) -> f64 {
    let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (t, &[a, b, c]) in triangles.iter().enumerate() {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            edges.entry([p.min(q), p.max(q)]).or_default().push(t);
        }
    }
    let pairs = edges.values().filter(|owners| owners.len() == 2);
    let angles: Vec<f64> =
        pairs.map(|owners| vectors[owners[0]].angle(&vectors[owners[1]]).to_degrees()).collect();
    angles.iter().sum::<f64>() / angles.len() as f64
}

#[test]
fn real_skins_have_smooth_outward_normals() {
    for name in ["abdomen_ts_129x107x118", "leg_sts013_129x110x114", "headphantom_imagex_129x129x105"] {
        let Some(path) = scans::find(&format!("ct/{name}.nii.gz")) else { continue };
        let volume = nifti::read(path).unwrap().volume;
        let lattice = Lattice::new(*volume.grid(), Split::Kuhn6).unwrap();
        let hu = lattice.sample(&volume).unwrap();
        let body = Body::new(lattice, hu, SkinMode::Exterior);
        let field = SkinField::new(&body.skin(), &Directions::Around([0.0, 0.0, 1.0])).unwrap();
        let count = body.triangles.len();
        assert!(field.normals_from_facets * 1000 < count, "{name}: {} of {count}", field.normals_from_facets);
        let facets: Vec<Vector3<f64>> =
            body.triangles.iter().map(|triangle| body.facet_normal(triangle)).collect();
        let inward = facets.iter().zip(&field.normals).filter(|(a, b)| a.dot(b) < 0.0).count();
        assert!(inward * 50 < count, "{name}: {inward} of {count} facets face inwards");
        let change = mean_change(&body.triangles, &field.normals);
        // Control: the facets.
        let facets = mean_change(&body.triangles, &facets);
        eprintln!("{name}: {change:.1}° between neighbors, facets {facets:.0}°");
        assert!(change < 2.5 && facets > 15.0, "{name}: {change} {facets}");
        assert!(field.coverage > 0.95, "{name}: {}", field.coverage);
    }
}
