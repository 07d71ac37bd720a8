//! Compares lattices and tissue meshes with brute force.

use std::collections::{BTreeMap, BTreeSet};

use cutis_mesh::{
    HalfSpace, Lattice, MeshError, SkinMode, SkinOptions, Split, TetMesh, Tissue, TissueMask, skin,
};
use cutis_volume::{Affine, Grid};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use crate::oracle::{air, all_tets, build, lattice, mesh, random_body, set, sorted, tets_of_faces};

fn volume(mesh: &TetMesh, tet: &[u32; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|v| mesh.positions[v as usize].cast::<f64>());
    (b - a).dot(&(c - a).cross(&(d - a))) / 6.0
}

/// `Σ V e⊗e⊗e⊗e` over the edges of a block of cells, times 15 and divided by its volume: for
/// springs of an isotropic solid the parts are 3 for `xxxx`, 1 for `xxyy`, and 0 for odd powers.
/// Returns the largest difference from that.
fn anisotropy(split: Split) -> f64 {
    let affine = Affine::from_spacing([2.0; 3], [0.0; 3]).unwrap();
    let grid = Grid { shape: [7; 3], affine };
    let lattice = Lattice::new(grid, split).unwrap();
    let mesh = build(&lattice, &[0.0; 343], &[false; 343], false).unwrap();
    let total: f64 = mesh.tet_volumes().iter().map(|&v| f64::from(v)).sum();
    let mut worst = 0.0f64;
    for [a, b, c] in (0..5usize).flat_map(|a| (0..5 - a).map(move |b| [a, b, 4 - a - b])) {
        let sum = |(edge, &volume): (&[u32; 2], &f32)| {
            let [p, q] = edge.map(|v| mesh.positions[v as usize].cast::<f64>());
            let e = (q - p).normalize();
            f64::from(volume) * e.x.powi(a as i32) * e.y.powi(b as i32) * e.z.powi(c as i32)
        };
        let found = 15.0 / total * mesh.edges.iter().zip(&mesh.edge_volumes()).map(sum).sum::<f64>();
        let wanted = match [a, b, c] {
            powers if powers.contains(&4) => 3.0,
            powers if powers.iter().all(|power| power % 2 == 0) => 1.0,
            _ => 0.0,
        };
        worst = worst.max((found - wanted).abs());
    }
    worst
}

/// Springs of `five` are isotropic, and those of `kuhn6` are not (control).
#[test]
fn springs_of_five_are_isotropic() {
    let (five, kuhn6) = (anisotropy(Split::Five), anisotropy(Split::Kuhn6));
    assert!(five < 1e-5, "{five}");
    assert!(kuhn6 > 0.5, "{kuhn6}");
}

/// Brute-force face-connected components; the largest, first in order among equals.
fn largest(tets: &[[usize; 4]]) -> (BTreeSet<[usize; 4]>, usize) {
    let mut label: Vec<usize> = (0..tets.len()).collect();
    fn root(label: &[usize], mut n: usize) -> usize {
        while label[n] != n {
            n = label[n];
        }
        n
    }
    for pair in tets_of_faces(tets).values().filter(|owners| owners.len() == 2) {
        let (a, b) = (root(&label, pair[0].0), root(&label, pair[1].0));
        label[a.max(b)] = a.min(b);
    }
    let mut parts: BTreeMap<usize, Vec<[usize; 4]>> = BTreeMap::new();
    (0..tets.len()).for_each(|n| parts.entry(root(&label, n)).or_default().push(tets[n]));
    let count = parts.len();
    let best = parts.into_values().rev().max_by_key(Vec::len).unwrap_or_default();
    (best.into_iter().map(sorted).collect(), count)
}

proptest! {
    #[test]
    fn mesh_equals_brute_force((lattice, air) in random_body(), only_largest: bool) {
        let hu: Vec<f32> = (0..air.len()).map(|n| n as f32).collect();
        let mut kept: Vec<_> = all_tets(&lattice).into_iter().filter(|t| t.iter().all(|&p| !air[p])).collect();
        let mesh = match build(&lattice, &hu, &air, only_largest) {
            Ok(mesh) => mesh,
            Err(MeshError::NoTissue { tissue_vertices, .. }) => {
                prop_assert!(kept.is_empty());
                prop_assert_eq!(tissue_vertices, air.iter().filter(|&&a| !a).count());
                return Ok(());
            }
            Err(other) => panic!("{other}"),
        };
        let (best, components) = largest(&kept);
        if only_largest {
            prop_assert_eq!(mesh.components, components);
            prop_assert_eq!(mesh.dropped_tets, kept.len() - best.len());
            kept.retain(|tet| best.contains(&sorted(*tet)));
        }
        // The same tets in the same order, positively oriented.
        let points = |v: u32| mesh.lattice_index[v as usize] as usize;
        let found: Vec<[usize; 4]> = mesh.tets.iter().map(|tet| tet.map(points)).collect();
        prop_assert_eq!(&found, &kept);
        prop_assert!(mesh.tets.iter().all(|tet| volume(&mesh, tet) > 0.0));
        // The used vertices, ascending, each with its HU.
        let used: BTreeSet<usize> = kept.iter().flatten().copied().collect();
        prop_assert!(mesh.lattice_index.iter().map(|&p| p as usize).eq(used));
        prop_assert!(mesh.lattice_index.iter().zip(&mesh.hu).all(|(&p, &hu)| hu == p as f32));
        // The edges of the tets, ascending.
        let pairs = |tet: &[u32; 4]| {
            let t = *tet;
            [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].map(|(a, b)| [t[a].min(t[b]), t[a].max(t[b])])
        };
        let edges: BTreeSet<[u32; 2]> = mesh.tets.iter().flat_map(pairs).collect();
        prop_assert!(mesh.edges.iter().copied().eq(edges));
        // The faces of exactly one tet, each once.
        let once: BTreeSet<_> =
            tets_of_faces(&kept).into_iter().filter(|(_, owners)| owners.len() == 1).map(|(face, _)| face).collect();
        let boundary: Vec<[u32; 3]> = mesh.boundary().iter().map(|t| t.map(|v| mesh.lattice_index[v as usize])).collect();
        prop_assert_eq!(boundary.len(), once.len());
        prop_assert_eq!(set(&boundary), once);
    }

    #[test]
    fn elements_of_one_color_share_no_vertex((lattice, air) in random_body()) {
        let Ok(mesh) = build(&lattice, &vec![0.0; air.len()], &air, false) else { return Ok(()) };
        let (most_edges, most_tets) = if lattice.split() == Split::Kuhn6 { (14, 24) } else { (18, 40) };
        let mut seen = BTreeSet::new();
        for (edge, color) in mesh.edges.iter().zip(mesh.edge_colors()) {
            prop_assert!(color < most_edges && edge.iter().all(|&v| seen.insert((color, v))));
        }
        seen.clear();
        for (tet, color) in mesh.tets.iter().zip(mesh.tet_colors()) {
            prop_assert!(color < most_tets && tet.iter().all(|&v| seen.insert((color, v))));
        }
    }

    #[test]
    fn edge_volumes_and_masses_add_up((lattice, air) in random_body()) {
        let Ok(mesh) = build(&lattice, &vec![0.0; air.len()], &air, false) else { return Ok(()) };
        let total: f64 = mesh.tet_volumes().iter().map(|&v| f64::from(v)).sum();
        let shares: f64 = mesh.edge_volumes().iter().map(|&v| f64::from(v)).sum();
        let masses: f64 = mesh.masses(&|_| 1000.0).iter().map(|&m| f64::from(m)).sum();
        prop_assert!((shares / total - 1.0).abs() < 1e-5 && (masses / (1000.0 * total) - 1.0).abs() < 1e-5);
        prop_assert!(mesh.edge_volumes().iter().all(|&share| share > 0.0));
        // By the divergence theorem, the outward oriented boundary encloses the volume.
        let corner = |v: u32| mesh.positions[v as usize].coords.cast::<f64>();
        let enclosed: f64 =
            mesh.boundary().iter().map(|&[a, b, c]| corner(a).dot(&corner(b).cross(&corner(c))) / 6.0).sum();
        prop_assert!((enclosed / total - 1.0).abs() < 1e-4, "{enclosed} {total}");
    }
}

#[test]
fn whole_lattice_has_the_volume_of_its_box() {
    for split in [Split::Kuhn6, Split::Five] {
        let lattice = lattice([5, 4, 6], [-2.0, 3.0, 2.5], split);
        let mesh = mesh(&lattice, &[false; 120]);
        let total: f64 = mesh.tets.iter().map(|tet| volume(&mesh, tet)).sum();
        let expected = 4.0 * 3.0 * 5.0 * (2.0 * 3.0 * 2.5) * 1e-9;
        assert!((total / expected - 1.0).abs() < 1e-5, "{total} {expected}");
    }
}

#[test]
fn frame_maps_to_the_world_and_back() {
    let lattice = lattice([5, 4, 6], [-2.0, 3.0, 2.5], Split::Kuhn6);
    let mesh = mesh(&lattice, &[false; 120]);
    for (position, &point) in mesh.positions.iter().zip(&mesh.lattice_index) {
        let expected = lattice.grid().mm(lattice.grid().point(point as usize));
        assert!((mesh.frame.to_mm(*position) - expected).norm() < 1e-5);
        assert_eq!(mesh.frame.to_local(expected), *position);
    }
}

#[test]
fn a_tet_has_the_density_of_its_mean_hu() {
    let lattice = lattice([2, 2, 2], [10.0; 3], Split::Kuhn6);
    let hu: Vec<f32> = (0..8).map(|n| 100.0 * n as f32).collect();
    let mesh = build(&lattice, &hu, &[false; 8], true).unwrap();
    let sixth = 1e-6 / 6.0;
    let mean = |tet: &[u32; 4]| tet.iter().map(|&v| hu[v as usize]).sum::<f32>() / 4.0;
    let expected: f32 = mesh.tets.iter().map(|tet| sixth * mean(tet)).sum();
    let found: f32 = mesh.masses(&|hu| hu).iter().sum();
    assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    // Corner 0 belongs to all six tets, corner 1 to two of them.
    let masses = mesh.masses(&|_| 1000.0);
    assert!((masses[0] / masses[1] - 3.0).abs() < 1e-4);
}

#[test]
fn cut_planes_and_selections_choose_the_right_vertices() {
    let lattice = lattice([9, 9, 9], [2.0; 3], Split::Kuhn6);
    let everything = vec![false; 729];
    let plane = HalfSpace { point_mm: [0.0, -12.5, 0.0], normal: [0.0, -3.0, 0.0] };
    let tissue = Tissue { air: &everything, cut_away: &[plane], largest_component: true };
    let mesh = TissueMask::find(&lattice, &tissue).unwrap().mesh(&vec![40.0; 729]).unwrap();
    // Points at y = −20, −18, … −4; the cut removes those below −12.5, and five of nine rows stay.
    assert_eq!(mesh.positions.len(), 9 * 5 * 9);
    assert!(mesh.vertices_beyond(&plane).unwrap().iter().all(|beyond| !beyond));
    let count = |selected: Vec<bool>| selected.iter().filter(|&&s| s).count();
    assert_eq!(count(mesh.vertices_in_box_mm([30.0, -4.0, 10.0], [34.0, -8.0, 10.0])), 3 * 3);
    assert_eq!(count(mesh.vertices_in_box_mm([34.0, -8.0, 10.0], [30.0, -4.0, 10.0])), 3 * 3);
    let bad = HalfSpace { normal: [0.0; 3], ..plane };
    assert!(matches!(mesh.vertices_beyond(&bad), Err(MeshError::Plane { .. })));
    let nowhere = HalfSpace { point_mm: [f64::NAN, 0.0, 0.0], ..plane };
    let tissue = Tissue { air: &everything, cut_away: &[nowhere], largest_component: true };
    assert!(matches!(TissueMask::find(&lattice, &tissue), Err(MeshError::Plane { .. })));
}

#[test]
fn invalid_input_is_refused() {
    let affine = Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap();
    let refuse_shape = |shape| Lattice::new(Grid { shape, affine }, Split::Kuhn6).unwrap_err().to_string();
    assert!(refuse_shape([1, 5, 5]).contains("[1, 5, 5]"));
    assert!(refuse_shape([0, 5, 5]).contains("at least 2"));
    assert!(refuse_shape([32767, 32767, 32767]).contains("32767"));
    assert!(refuse_shape([usize::MAX, usize::MAX, 3]).contains("at most"));
    let tiny = Affine::from_spacing([1e-60, 1.0, 1.0], [0.0; 3]).unwrap();
    let lattice_of = |affine| Lattice::new(Grid { shape: [3, 3, 3], affine }, Split::Kuhn6);
    assert!(matches!(lattice_of(tiny), Err(MeshError::LatticeExtent { .. })));

    let lattice = lattice_of(affine).unwrap();
    let refuse = |hu: &[f32], air: &[bool]| build(&lattice, hu, air, true).unwrap_err();
    assert!(matches!(
        refuse(&[0.0; 26], &[false; 27]),
        MeshError::Length { array: "hu", expected: 27, found: 26 }
    ));
    assert!(matches!(refuse(&[0.0; 27], &[false; 28]), MeshError::Length { array: "air", found: 28, .. }));
    let mut hu = [0.0; 27];
    hu[5] = f32::NAN;
    assert!(matches!(refuse(&hu, &[false; 27]), MeshError::NotFinite { point: [2, 1, 0], .. }));
    assert!(matches!(refuse(&[0.0; 27], &[true; 27]), MeshError::NoTissue { tissue_vertices: 0, .. }));
}

#[test]
fn scaled_and_rotated_lattices_have_positive_tets() {
    for scale in [1e-3, 1.0, 1e3] {
        let (s, c) = (scale * 0.6, scale * 0.8);
        let rows =
            [[c, s, 0.0, 5.0], [s, -c, 0.1 * scale, 7.0], [0.0, 0.0, scale, 9.0], [0.0, 0.0, 0.0, 1.0]];
        let grid = Grid { shape: [4, 5, 3], affine: Affine::from_rows(rows).unwrap() };
        assert!(grid.affine.voxel_volume_mm3() < 0.0);
        let lattice = Lattice::new(grid, Split::Five).unwrap();
        let mesh = mesh(&lattice, &air(&lattice, |_| true));
        assert!(mesh.tet_volumes().iter().all(|&volume| volume > 0.0));
        let middle = mesh.positions.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / 60.0;
        assert!(Point3::from(middle).coords.norm() < 1e-4 * scale as f32);
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let lattice = lattice([33, 30, 37], [2.0, 2.0, 3.0], Split::Kuhn6);
    // Tissue with holes a few steps wide.
    let wave = |p: [f64; 3]| (p[0] / 7.0).sin() + (p[1] / 5.0).cos() + (p[2] / 9.0).sin();
    let air = air(&lattice, |p| wave(p) > -0.4);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mesh = mesh(&lattice, &air);
            let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<_>>();
            let skins = [SkinMode::Paper, SkinMode::Boundary, SkinMode::Exterior].map(|mode| {
                let skin = skin::detect(&lattice, &air, mode, &SkinOptions::default()).unwrap();
                (skin.triangles, skin.report)
            });
            let figures = [mesh.tet_volumes(), mesh.edge_volumes(), mesh.masses(&|hu| hu)].map(bits);
            (mesh.boundary(), mesh.edge_colors(), mesh.tets, mesh.edges, skins, figures)
        })
    };
    let one = run(1);
    assert!(one.0.len() > 1000);
    for threads in [2, 3, 8] {
        assert!(run(threads) == one, "{threads} threads");
    }
}
