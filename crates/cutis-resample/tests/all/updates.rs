//! Updates of a kept output compared with resampling from the beginning.

use cutis_resample::{ResampleError, Resampler, Warp, resample};
use cutis_volume::Grid;
use nalgebra::{Point3, Vector3};

use crate::bodies::{Mesh, lattice, noise, oblique};

/// A body of several tiles along each axis, with a shell and removed tets.
fn body() -> (cutis_volume::Volume, Mesh, Vec<[u32; 4]>) {
    let grid = Grid { shape: [150, 80, 70], affine: oblique() };
    let mut mesh = lattice(&grid, [20, 12, 10], [4.0; 3], [144.3, 75.2, 66.1]);
    let removed = mesh.tets.drain(700..730).collect();
    (noise(grid, 11), mesh, removed)
}

fn warp<'a>(mesh: &'a Mesh, removed: &'a [[u32; 4]], deformed: &'a [Point3<f32>]) -> Warp<'a> {
    let (origin_mm, rest, tets) = (mesh.origin_mm, &mesh.rest, &mesh.tets);
    Warp { origin_mm, rest, deformed, tets, body_tets: mesh.tets.len() - 900, removed }
}

/// Moves the vertices within a radius of a vertex.
fn moved(mesh: &Mesh, around: usize, radius: f32, by: Vector3<f32>) -> Vec<Point3<f32>> {
    let center = mesh.rest[around];
    let near = |p: &Point3<f32>| (1.0 - (p - center).norm() / radius).max(0.0);
    mesh.rest.iter().map(|p| p + by * near(p)).collect()
}

/// States with motion in one place, in another one, at rest, everywhere, with folds, and with a
/// vertex far away, which changes the tolerance.
fn states(mesh: &Mesh) -> Vec<Vec<Point3<f32>>> {
    let count = mesh.rest.len();
    let by = Vector3::new(0.004, -0.003, 0.005);
    let mut far = moved(mesh, count / 2, 0.03, by);
    far[count / 3].x += 900.0;
    vec![
        mesh.rest.clone(),
        moved(mesh, count / 2, 0.03, by),
        moved(mesh, count / 2, 0.03, by * 1.1),
        moved(mesh, count / 3, 0.03, by),
        moved(mesh, count / 2, 0.03, by * 8.0),
        mesh.rest.clone(),
        moved(mesh, 0, 9.0, by),
        far,
        moved(mesh, count / 2, 0.03, by),
    ]
}

#[test]
fn an_update_has_the_bits_of_a_resampling_from_the_beginning() {
    let (volume, mesh, removed) = body();
    let states = states(&mesh);
    let mut kept = Resampler::new(&volume, &warp(&mesh, &removed, &mesh.rest)).unwrap();
    let mut before = volume.voxels().to_vec();
    let mut folds = 0;
    for (n, deformed) in states.iter().enumerate() {
        let report = kept.update(deformed).unwrap();
        let (expected, whole) = resample(&volume, &warp(&mesh, &removed, deformed), &|_, _| {}).unwrap();
        assert!(kept.voxels() == expected.voxels(), "state {n}");
        assert_eq!(report, whole, "state {n}");
        assert!(kept.voxels() != before, "control: state {n} is not the one before");
        before.copy_from_slice(kept.voxels());
        folds += report.folds;
    }
    assert!(folds > 0, "control: one state has folds");
    assert_eq!(kept.into_volume().unwrap().voxels(), before);
}

#[test]
fn updates_have_the_same_bits_for_any_number_of_threads() {
    let (volume, mesh, removed) = body();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut kept = Resampler::new(&volume, &warp(&mesh, &removed, &mesh.rest)).unwrap();
            let reports =
                states(&mesh)[..5].iter().map(|state| kept.update(state).unwrap()).collect::<Vec<_>>();
            (reports, kept.into_volume().unwrap())
        })
    };
    let expected = run(1);
    for threads in [2, 3, 8] {
        assert!(run(threads) == expected, "{threads} threads");
    }
    assert_ne!(expected.0[0], expected.0[4], "control: the states differ");
}

#[test]
fn an_update_refuses_wrong_positions_and_keeps_the_output() {
    let (volume, mesh, removed) = body();
    let mut kept = Resampler::new(&volume, &warp(&mesh, &removed, &mesh.rest)).unwrap();
    let mut deformed = states(&mesh).swap_remove(1);
    let report = kept.update(&deformed).unwrap();
    let before = kept.voxels().to_vec();
    assert!(matches!(kept.update(&deformed[1..]), Err(ResampleError::VertexCount { .. })));
    deformed[7].y = f32::NAN;
    assert!(matches!(kept.update(&deformed), Err(ResampleError::NotFinite { vertex: 7, .. })));
    deformed[7].y = mesh.rest[7].y;
    assert_eq!((kept.update(&deformed).unwrap(), kept.voxels()), (report, before.as_slice()));
}
