//! Tests that the shell follows the mesh and leaves slits open.

use std::collections::BTreeSet;

use cutis_mesh::{Incision, Shell, SkinMode, SkinOptions, Split, TetMesh, skin};
use nalgebra::{Point3, Vector3};

use crate::oracle::{air, all_tets, lattice, mesh, plan, skin_on_mesh, sorted};

fn ball() -> (TetMesh, Vec<[u32; 3]>, Vec<bool>) {
    let lattice = lattice([17, 17, 17], [-2.0, 2.0, 2.0], Split::Kuhn6);
    let middle = lattice.grid().mm([8, 8, 8]);
    let air = air(&lattice, |p| (Point3::from(p) - middle).norm() <= 11.0);
    let skin = skin::detect(&lattice, &air, SkinMode::Exterior, &SkinOptions::default()).unwrap();
    let mesh = mesh(&lattice, &air);
    let triangles = skin_on_mesh(&mesh, &skin).0;
    (mesh, triangles, air)
}

/// The lattice point of a vertex of the shell.
fn point(mesh: &TetMesh, shell: &Shell, v: u32) -> usize {
    let position = match v.checked_sub(shell.first_extra) {
        Some(extra) => shell.positions[extra as usize],
        None => mesh.positions[v as usize],
    };
    let index = mesh.lattice.grid().affine.to_index(mesh.frame.to_mm(position));
    mesh.lattice.grid().index([index.x, index.y, index.z].map(|x| x.round() as usize))
}

#[test]
fn shell_has_all_tets_between_mesh_and_air() {
    let (mesh, triangles, air) = ball();
    let shell = Shell::new(&mesh, &air, &plan(&mesh, &triangles, &[]).unwrap(), None).unwrap();
    let expected: BTreeSet<[usize; 4]> = all_tets(&mesh.lattice)
        .into_iter()
        .filter(|tet| (1..=3).contains(&tet.iter().filter(|&&p| air[p]).count()))
        .filter(|tet| tet.iter().any(|&p| mesh.lattice_index.contains(&(p as u32))))
        .map(sorted)
        .collect();
    let found: Vec<_> = shell.tets.iter().map(|tet| sorted(tet.map(|v| point(&mesh, &shell, v)))).collect();
    assert_eq!(found.len(), expected.len());
    assert_eq!(found.into_iter().collect::<BTreeSet<_>>(), expected);
    assert!(shell.removed.is_empty());
    let extras: BTreeSet<u32> =
        shell.tets.iter().flatten().copied().filter(|&v| v >= shell.first_extra).collect();
    assert_eq!(extras.len(), shell.positions.len());
    // Every extra vertex follows a mesh vertex, and follows a translation exactly.
    assert!(shell.offsets.windows(2).all(|w| w[0] < w[1]));
    let shift = Vector3::new(0.25, -0.5, 0.125);
    let moved: Vec<Point3<f32>> = mesh.positions.iter().map(|p| p + shift).collect();
    for (rest, now) in shell.positions.iter().zip(shell.follow(&mesh.positions, &moved)) {
        assert!((now - rest - shift).norm() < 1e-6);
    }
    assert_eq!(shell.follow(&mesh.positions, &mesh.positions), shell.positions);
}

#[test]
fn slits_open_the_shell_and_no_vertex_follows_across_them() {
    let (mut mesh, mut triangles, air) = ball();
    let top = mesh.lattice.grid().mm([8, 8, 8]) + Vector3::new(0.0, 0.0, 11.0);
    let (from, to) = (top - Vector3::new(7.0, 0.5, 0.0), top + Vector3::new(7.0, -0.5, 0.0));
    let slit = Incision { path_mm: vec![from.into(), to.into()], depth_mm: 6.0, width_mm: Some(0.5) };
    let cut = plan(&mesh, &triangles, &[slit]).unwrap();
    cut.apply(&mut mesh, &mut triangles);
    let shell = Shell::new(&mesh, &air, &cut, None).unwrap();
    assert!(!shell.removed.is_empty() && !shell.tets.is_empty());
    // Pull the two sides of the slit apart. Each shell vertex moves with its own side.
    let y = |p: &Point3<f32>| mesh.frame.to_mm(*p).y - top.y + 0.5;
    let pulled: Vec<Point3<f32>> =
        mesh.positions.iter().map(|p| p + Vector3::new(0.0, 0.01 * y(p).signum() as f32, 0.0)).collect();
    let followed = shell.follow(&mesh.positions, &pulled);
    let used: BTreeSet<u32> =
        shell.tets.iter().flatten().copied().filter(|&v| v >= shell.first_extra).collect();
    let mut checked = 0;
    for v in used {
        let n = (v - shell.first_extra) as usize;
        let mm = mesh.frame.to_mm(shell.positions[n]);
        if (mm.x - top.x).abs() < 5.0 && mm.z > top.z - 4.0 {
            let moved = (followed[n] - shell.positions[n]).y;
            assert!((moved - 0.01 * y(&shell.positions[n]).signum() as f32).abs() < 1e-6, "{mm} {moved}");
            checked += 1;
        }
    }
    assert!(checked > 10);
    let other = plan(&ball().0, &ball().1, &[]).unwrap();
    assert!(Shell::new(&mesh, &air[1..], &other, None).is_err());
}
