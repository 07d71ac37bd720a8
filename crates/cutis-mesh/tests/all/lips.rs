//! The points of both lips of a cut of no width.

use std::collections::BTreeSet;

use cutis_mesh::Split;
use cutis_mesh::sever::LipPoint;
use nalgebra::{Point3, Vector3};

use crate::sever::{block, cut, pieces, plane, tets};

/// Displacements in m of the nodes on the side of x = 0, and of the others.
const APART: [f64; 2] = [-0.002, 0.005];

/// A plane cuts a block into two pieces that move apart. Every lip point moves with its own piece,
/// also if the plane is so close to lattice points that the parts behind it are too thin for
/// copies.
#[test]
fn lip_points_move_with_their_own_side() {
    let mut thin = 0;
    for split in [Split::Kuhn6, Split::Five] {
        let mesh = block([6, 4, 4], split);
        // The lattice points with x = 9 mm, which are local 0, and the cell on both sides of them.
        for x in [-2.7, -0.9, -0.15, -0.03, -3e-4, 0.0, 3e-4, 0.03, 0.15, 0.9, 2.7] {
            for tilt in [0.0, 0.02] {
                let blade = plane([x * 1e-3, 0.0, 0.0], [tilt, 1.0, 0.0], [-tilt, 0.0, 1.0]);
                let wound = cut(&mesh, &[blade]);
                let sides = pieces(&tets(&mesh, &wound));
                assert_eq!(sides.len(), 2, "{split:?}, {x}, {tilt}");
                let rest = [mesh.positions.as_slice(), &wound.positions(&mesh)].concat();
                let first = rest.iter().map(|p| p.x).fold(f32::INFINITY, f32::min);
                let is_left = |side: &BTreeSet<u32>| side.iter().any(|&v| rest[v as usize].x == first);
                let moved = |node: u32| {
                    let left = sides.iter().any(|side| side.contains(&node) && is_left(side));
                    let apart = if left { APART[0] } else { APART[1] };
                    rest[node as usize].cast::<f64>() + Vector3::new(apart, 0.0, 0.0)
                };
                let skin = mesh.boundary();
                let copies = wound.skin(&mesh, &skin);
                let lips = wound.lips(&mesh, &skin, &copies, 0);
                assert!(lips.len() > 20, "{split:?}, {x}, {tilt}: {}", lips.len());
                for LipPoint { edge, right, at } in &lips {
                    let start = at.at(&rest).cast::<f64>();
                    let shift = at.at_by(&moved) - start;
                    let both: Point3<f64> = lips
                        .iter()
                        .find(|other| other.edge == *edge && other.right != *right)
                        .map_or(start, |other| other.at.at(&rest).cast());
                    assert!((both - start).norm() < 1e-8, "{split:?}, {x}, {tilt}: {both} {start}");
                    thin += usize::from(at.weights.iter().any(|weight| *weight < 0.0));
                    let is = |apart: f64| (shift - Vector3::new(apart, 0.0, 0.0)).norm() < 1e-8;
                    let left_is_right = is(APART[usize::from(!*right)]);
                    assert!(left_is_right, "{split:?}, {x}, {tilt}: {at:?} moves by {shift}, right: {right}");
                }
                // Both lips are there.
                assert!(lips.iter().any(|lip| lip.right) && lips.iter().any(|lip| !lip.right));
            }
        }
    }
    assert!(thin > 20, "only {thin} points of thin parts");
}
