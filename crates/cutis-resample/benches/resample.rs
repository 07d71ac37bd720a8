//! A 256³ volume through a Kuhn lattice of 1.5 million tets on one thread: all of them moving, a ball of them, none.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use cutis_resample::{Warp, resample};
use cutis_volume::{Affine, Grid};
use nalgebra::{Point3, Vector3};

fn bench(criterion: &mut Criterion) {
    let affine =
        Affine::from_spacing([0.9765625, 0.9765625, 1.5], [-125.0, -125.0, 0.0]).expect("invertible");
    let grid = Grid { shape: [256; 3], affine };
    let volume = common::noise(grid, 1);
    let mesh = common::lattice(&grid, [63; 3], [0.0; 3], [255.0; 3]);
    let wave =
        |p: &Point3<f32>| p + Vector3::new((40.0 * p.y).sin(), (30.0 * p.z).sin(), (50.0 * p.x).sin()) * 2e-3;
    let center = mesh.rest[mesh.rest.len() / 2];
    let cases = [
        ("all move", mesh.rest.iter().map(wave).collect::<Vec<_>>()),
        (
            "a ball moves",
            mesh.rest.iter().map(|p| if (p - center).norm() < 0.05 { wave(p) } else { *p }).collect(),
        ),
        ("none moves", mesh.rest.clone()),
    ];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let mut group = criterion.benchmark_group("resample 256³, 1.5 M tets, 1 thread");
    group.sample_size(10);
    for (name, deformed) in &cases {
        let warp = Warp {
            origin_mm: mesh.origin_mm,
            rest: &mesh.rest,
            deformed,
            tets: &mesh.tets,
            body_tets: mesh.tets.len(),
            removed: &[],
        };
        group.bench_function(*name, |b| {
            b.iter(|| pool.install(|| black_box(resample(&volume, &warp, &|_, _| {}).expect("valid warp"))));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
