//! Where stitches are: along incisions and across excisions, on the skin and below it.

use cutis_mesh::{Stitch, Stitching, TetMesh};
use nalgebra::{Point3, Vector3};

use crate::flaps::{SPLITS, along_x, block, ellipse, plan};

/// Both ends of a stitch in mm.
fn ends(mesh: &TetMesh, stitch: &Stitch) -> [Point3<f64>; 2] {
    [0, 1].map(|n| {
        let [a, b, c] = stitch.triangles[n].map(|v| mesh.positions[v as usize].cast::<f64>());
        let [v, w] = stitch.weights[n];
        let at: Vector3<f64> = a.coords * (1.0 - v - w) + b.coords * v + c.coords * w;
        mesh.frame.to_mm(Point3::from(at).cast())
    })
}

/// The ends lie on both sides of the wound at the bite, and at the depth below the skin at
/// z = 24 mm. Control: with a depth of 0 they are on the skin.
#[test]
fn stitches_end_at_their_depth_on_both_sides() {
    for split in SPLITS {
        for depth_mm in [0.0, 3.0, 5.0] {
            let at = Stitching { every: 8e-3, bite: 5e-3, depth: depth_mm / 1000.0 };
            let (mesh, skin) = block(split);
            let cut = plan(&mesh, &skin, &[along_x(30.0, 10.0)], &[], &[]).unwrap();
            let along = cut.stitches(0, &mesh, &skin, &at).unwrap();
            assert_eq!(along.len(), 5);
            let (mut mesh, mut skin) = block(split);
            let mut cut = plan(&mesh, &skin, &[], &[], &[ellipse(8.0)]).unwrap();
            let severed = cut.sever(&mut mesh, &mut skin).unwrap().unwrap();
            let whole = &skin[..skin.len() - severed.copies.len()];
            let across = cut.stitches_across(0, &mesh, whole, &at).unwrap();
            assert_eq!(across.len(), 5);
            let half_width = |x: f64| 8.0 * (1.0 - ((x - 40.0) / 20.0).powi(2)).max(0.0).sqrt();
            let edges = along.iter().map(|stitch| (stitch, 0.0));
            let x = |stitch: &Stitch| ends(&mesh, stitch)[0].x;
            for (stitch, edge) in edges.chain(across.iter().map(|stitch| (stitch, half_width(x(stitch))))) {
                for (end, side) in ends(&mesh, stitch).iter().zip([1.0, -1.0]) {
                    assert!((end.z - (24.0 - depth_mm)).abs() < 1.2, "{split:?} {depth_mm}: {end}");
                    let beyond = side * (end.y - 30.0) - edge;
                    assert!((beyond.abs() - 5.0).abs() < 2.2, "{split:?} {depth_mm}: {end} {edge}");
                }
                let [a, b] = ends(&mesh, stitch);
                assert!((a.y - 30.0) * (b.y - 30.0) < 0.0, "{a} {b}");
            }
        }
    }
}
