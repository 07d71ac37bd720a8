//! Tests of a region of a body: its mesh, skin, shell and cut equal those of the whole body there.

use std::collections::{BTreeMap, BTreeSet};

use cutis_mesh::{
    Cut, Incision, Lattice, MeshError, Shell, SkinMode, SkinOptions, Slit, Split, TetMesh, Tissue,
    TissueMask, skin,
};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::oracle::{air, lattice};

fn whole(lattice: &Lattice, air: &[bool], largest_component: bool) -> Result<TissueMask, MeshError> {
    TissueMask::find(lattice, &Tissue { air, cut_away: &[], largest_component })
}

fn hu(lattice: &Lattice) -> Vec<f32> {
    (0..lattice.grid().len()).map(|point| (point % 90) as f32).collect()
}

/// Simplices in lattice points, sorted.
fn points<const N: usize>(mesh: &TetMesh, simplices: &[[u32; N]]) -> BTreeSet<[u32; N]> {
    simplices.iter().map(|simplex| sorted(simplex.map(|v| mesh.lattice_index[v as usize]))).collect()
}

fn sorted<const N: usize>(mut simplex: [u32; N]) -> [u32; N] {
    simplex.sort_unstable();
    simplex
}

/// A ball with a radius of 8 steps, its air flags, its skin in lattice points, and a region: all
/// points at least `above_mm` above the middle.
fn ball(above_mm: f64) -> (TissueMask, Vec<bool>, Vec<[u32; 3]>, Vec<bool>) {
    let lattice = lattice([21, 21, 21], [-2.0, 2.0, 2.0], Split::Kuhn6);
    let middle = lattice.mm([10, 10, 10]);
    let air = air(&lattice, |p| (Point3::from(p) - middle).norm() <= 16.0);
    let whole = whole(&lattice, &air, true).unwrap();
    let found = skin::detect(&lattice, &air, SkinMode::Exterior, &SkinOptions::default()).unwrap();
    let skin = whole.skin(&found).0;
    let inside = whole.vertices_where(|mm| mm.z >= middle.z + above_mm);
    (whole, air, skin, inside)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn a_region_has_the_tets_of_the_whole_body(
        flags in proptest::collection::vec((proptest::bool::weighted(0.15), proptest::bool::weighted(0.3)), 6 * 5 * 7),
        five in proptest::bool::ANY,
        largest in proptest::bool::ANY,
    ) {
        let lattice = lattice([6, 5, 7], [2.0, -3.0, 1.0], if five { Split::Five } else { Split::Kuhn6 });
        let (air, inside): (Vec<bool>, Vec<bool>) = flags.into_iter().unzip();
        let Ok(body) = whole(&lattice, &air, largest) else { return Ok(()) };
        let all = body.mesh(&hu(&lattice)).unwrap();
        let touched = |tet: &[u32; 4]| tet.iter().any(|&v| inside[all.lattice_index[v as usize] as usize]);
        let kept: Vec<[u32; 4]> = all.tets.iter().copied().filter(touched).collect();
        let part = match body.mesh_within(&hu(&lattice), &inside) {
            Ok(part) => part,
            Err(MeshError::RegionEmpty { vertices }) => {
                prop_assert!(kept.is_empty() && vertices == all.positions.len());
                return Ok(());
            }
            Err(other) => return Err(TestCaseError::fail(other.to_string())),
        };
        let inactive = part.inactive.as_ref().unwrap();
        prop_assert_eq!(points(&part, &part.tets), points(&all, &kept));
        prop_assert_eq!(part.tets.len() + inactive.tets, all.tets.len());
        prop_assert_eq!(part.edges.len() + inactive.edges, all.edges.len());
        prop_assert_eq!(part.positions.len() + inactive.vertices, all.positions.len());
        prop_assert_eq!((part.components, part.dropped_tets), (all.components, all.dropped_tets));
        // Vertices inside have all of their tets and edges, and the same mass as in the whole body.
        let (masses, all_masses) = (part.masses(&|hu| hu + 900.0), all.masses(&|hu| hu + 900.0));
        let edges = points(&part, &part.edges);
        for (v, &point) in all.lattice_index.iter().enumerate() {
            let here = part.lattice_index.binary_search(&point);
            prop_assert_eq!(here.is_err(), inactive.points[point as usize]);
            let Ok(here) = here else { continue };
            prop_assert_eq!(part.positions[here], all.positions[v]);
            prop_assert_eq!(inactive.border[here], !inside[point as usize]);
            if inside[point as usize] {
                prop_assert_eq!(masses[here].to_bits(), all_masses[v].to_bits());
            }
        }
        for edge in points(&all, &all.edges) {
            prop_assert!(edges.contains(&edge) || !edge.iter().any(|&point| inside[point as usize]));
        }
        // The colors are those of the whole body.
        let colors = |mesh: &TetMesh| -> BTreeMap<[u32; 4], u16> {
            let keys = mesh.tets.iter().map(|tet| sorted(tet.map(|v| mesh.lattice_index[v as usize])));
            keys.zip(mesh.tet_colors()).collect()
        };
        let of_all = colors(&all);
        prop_assert!(colors(&part).iter().all(|(tet, color)| of_all[tet] == *color));
    }
}

#[test]
fn faces_inside_the_body_at_the_border_of_a_region_are_not_skin() {
    let (body, _, skin, inside) = ball(3.0);
    let mesh = body.mesh_within(&hu(body.lattice()), &inside).unwrap();
    let (moving, fixed) = mesh.divide_skin(&skin);
    let of_skin: BTreeSet<[u32; 3]> = skin.iter().map(|&triangle| sorted(triangle)).collect();
    let own = points(&mesh, &moving);
    assert!(own.len() > 100 && own.is_subset(&of_skin));
    let free = |point: u32| inside[point as usize];
    let expected: BTreeSet<_> = of_skin.iter().copied().filter(|t| t.iter().any(|&p| free(p))).collect();
    assert_eq!(own, expected);
    // The other triangles are the inactive skin, with each of its own positions once.
    assert_eq!(moving.len() + fixed.triangles.len(), skin.len());
    let place = |v: u32| match (v as usize).checked_sub(mesh.positions.len()) {
        Some(own) => fixed.lattice_index[own],
        None => mesh.lattice_index[v as usize],
    };
    let inactive: BTreeSet<_> = fixed.triangles.iter().map(|t| sorted(t.map(place))).collect();
    assert_eq!(inactive, &of_skin - &own);
    // Control: the mesh has such faces.
    assert!(!points(&mesh, &mesh.boundary()).is_subset(&of_skin));
    let (all, none) = body.mesh(&hu(body.lattice())).unwrap().divide_skin(&skin);
    assert!(all.len() == skin.len() && none.triangles.is_empty());
}

/// If nothing outside the region moves, the shell of a region moves like the shell of the whole
/// body.
#[test]
fn the_shell_of_a_region_moves_like_that_of_the_whole_body() {
    let (body, air, _, inside) = ball(3.0);
    let all = body.mesh(&hu(body.lattice())).unwrap();
    let part = body.mesh_within(&hu(body.lattice()), &inside).unwrap();
    let moved = |mesh: &TetMesh| -> Vec<Point3<f32>> {
        let shift = |point: u32| {
            let noise = |n: u32| (point.wrapping_mul(2_654_435_761 + n) >> 20) as f32 * 1e-6;
            if inside[point as usize] { Vector3::new(noise(0), noise(2), noise(4)) } else { Vector3::zeros() }
        };
        mesh.positions
            .iter()
            .zip(&mesh.lattice_index)
            .map(|(position, &point)| position + shift(point))
            .collect()
    };
    // The tets of the shell, each by the rest and deformed positions of its corners.
    let shell = |mesh: &TetMesh| {
        let shell = Shell::new(mesh, &air, &Cut::of_slits(mesh, &[], Vec::new()).unwrap(), None).unwrap();
        let bits = |p: &Point3<f32>| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits()];
        let now = shell.follow(&mesh.positions, &moved(mesh));
        let places: Vec<_> = mesh.positions.iter().chain(&shell.positions).map(bits).collect();
        let places_now: Vec<_> = moved(mesh).iter().chain(&now).map(bits).collect();
        let tet = |tet: &[u32; 4]| {
            let mut corners = tet.map(|v| (places[v as usize], places_now[v as usize]));
            corners.sort_unstable();
            corners
        };
        let tets: BTreeSet<_> = shell.tets.iter().map(tet).collect();
        assert_eq!(tets.len(), shell.tets.len());
        (tets, shell)
    };
    let ((all_tets, _), (part_tets, part_shell)) = (shell(&all), shell(&part));
    assert!(part_tets.is_subset(&all_tets) && part_tets.len() < all_tets.len());
    let moves = |tet: &&[([u32; 3], [u32; 3]); 4]| tet.iter().any(|(rest, now)| rest != now);
    assert_eq!(all_tets.iter().filter(moves).count(), part_tets.iter().filter(moves).count());
    // Control: inactive vertices reduce the motion of some extra vertices.
    assert!(part_shell.held_by.iter().any(|&held_by| held_by > 0));
}

#[test]
fn a_cut_in_a_region_is_the_cut_of_the_whole_body() {
    let (body, _, skin, inside) = ball(-1.0);
    let top = body.lattice().mm([10, 10, 10]) + Vector3::new(0.0, 0.0, 16.0);
    let ends = [-6.0, 6.0].map(|x| (top + Vector3::new(x, 0.5, 0.0)).into());
    let incision = Incision { path_mm: ends.to_vec(), depth_mm: 6.0, width_mm: Some(4.5) };
    let slits = Slit::on_lattice(body.lattice(), &skin, &[incision]).unwrap();
    let cut = |mut mesh: TetMesh, slits: Vec<Slit>| {
        let mut own = mesh.divide_skin(&skin).0;
        let cut = Cut::of_slits(&mesh, &own, slits)?;
        let removed = cut.apply(&mut mesh, &mut own);
        let lips: Vec<u32> =
            cut.gapes[0].left().iter().map(|lip| mesh.lattice_index[lip.nodes[0] as usize]).collect();
        let gape = cut.gapes[0].measure(&mesh.positions);
        Ok::<_, MeshError>((
            points(&mesh, &removed.tets),
            points(&mesh, &removed.edges),
            removed.triangles.len(),
            lips,
            gape,
        ))
    };
    let all = body.mesh(&hu(body.lattice())).unwrap();
    let expected = cut(all, slits.clone()).unwrap();
    assert!(expected.0.len() > 20);
    let within = |inside: &[bool]| body.mesh_within(&hu(body.lattice()), inside).unwrap();
    assert_eq!(cut(within(&inside), slits.clone()).unwrap(), expected);
    // A region that does not contain the slit is refused.
    let refused = |keep: &dyn Fn(Point3<f64>) -> bool| {
        let inside: Vec<bool> = (0..inside.len())
            .map(|p| body.vertices()[p] && keep(body.lattice().mm(body.lattice().grid().point(p))))
            .collect();
        cut(within(&inside), slits.clone()).unwrap_err()
    };
    let shallow = refused(&|mm| mm.z > top.z - 5.0);
    let half = refused(&|mm| mm.x > top.x);
    let elsewhere = refused(&|mm| mm.z < top.z - 14.0);
    for error in [shallow, half, elsewhere] {
        assert!(matches!(error, MeshError::IncisionBeyond { incision: 0, coarse: false, .. }), "{error}");
    }
    let nothing = body.mesh_within(&hu(body.lattice()), &vec![false; inside.len()]);
    assert!(matches!(nothing, Err(MeshError::RegionEmpty { .. })));
    assert!(matches!(body.mesh_within(&hu(body.lattice()), &inside[1..]), Err(MeshError::Length { .. })));
}
