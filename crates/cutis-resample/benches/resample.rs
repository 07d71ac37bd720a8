//! A volume of 256³ voxels through a lattice of 1.5 million tets on one thread: with all tets
//! moving, with a ball of 100 mm of moving tets, and with none moving. A new output each time, and
//! updates of a kept output between two states. Last the voxels at the walls of a cut through the
//! ball.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use cutis_resample::{Resampler, Warp, blend_walls, resample};
use cutis_test_kit::{Kuhn, Random};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

fn bench(criterion: &mut Criterion) {
    let affine =
        Affine::from_spacing([0.9765625, 0.9765625, 1.5], [-125.0, -125.0, 0.0]).expect("invertible");
    let grid = Grid { shape: [256; 3], affine };
    let mut random = Random::new(1);
    let voxels = (0..grid.len()).map(|_| random.below(3000) as i16 - 1024).collect();
    let volume = Volume::new(grid, voxels, 1.0, 0.0).expect("as many voxels as the grid has");
    let Kuhn { positions, tets, .. } = Kuhn::new([64; 3], 255.0 / 63.0);
    let origin_mm = affine.to_mm(Point3::origin());
    let local =
        |index: &Point3<f64>| Point3::from(((affine.to_mm(*index) - origin_mm) / 1000.0).cast::<f32>());
    let rest: Vec<Point3<f32>> = positions.iter().map(local).collect();
    let wave =
        |p: &Point3<f32>| p + Vector3::new((40.0 * p.y).sin(), (30.0 * p.z).sin(), (50.0 * p.x).sin()) * 2e-3;
    let center = rest[rest.len() / 2];
    let cases = [
        ("all move", rest.iter().map(wave).collect::<Vec<_>>()),
        (
            "a ball moves",
            rest.iter().map(|p| if (p - center).norm() < 0.05 { wave(p) } else { *p }).collect(),
        ),
        ("none moves", rest.clone()),
    ];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let mut group = criterion.benchmark_group("resample 256³, 1.5 M tets, 1 thread");
    group.sample_size(10);
    for (name, deformed) in &cases {
        let warp =
            Warp { origin_mm, rest: &rest, deformed, tets: &tets, body_tets: tets.len(), removed: &[] };
        group.bench_function(*name, |b| {
            b.iter(|| pool.install(|| black_box(resample(&volume, &warp, &|_, _| {}).expect("valid warp"))));
        });
    }
    for (name, deformed) in &cases {
        let warp =
            Warp { origin_mm, rest: &rest, deformed, tets: &tets, body_tets: tets.len(), removed: &[] };
        // The second state is halfway to the first one.
        let half = rest.iter().zip(deformed).map(|(rest, deformed)| nalgebra::center(rest, deformed));
        let states = [deformed.clone(), half.collect()];
        let mut resampler = Resampler::new(&volume, &warp).expect("valid warp");
        let mut frame = 0;
        group.bench_function(format!("update, {name}"), |b| {
            b.iter(|| {
                frame += 1;
                pool.install(|| black_box(resampler.update(&states[frame % 2]).expect("valid positions")))
            });
        });
    }
    // The tets across the middle plane of the ball are removed, and one side moves.
    let in_ball = |p: &Point3<f32>| (p - center).norm() < 0.05;
    let is_cut = |tet: &[u32; 4]| {
        let corners = tet.map(|v| rest[v as usize]);
        let right = corners.iter().filter(|p| p.x > center.x).count();
        corners.iter().all(in_ball) && (1..4).contains(&right)
    };
    let (removed, kept): (Vec<[u32; 4]>, Vec<[u32; 4]>) = tets.iter().partition(|tet| is_cut(tet));
    let opened = |p: &Point3<f32>| {
        let by = if in_ball(p) && p.x > center.x { 2e-3 } else { 0.0 };
        p + Vector3::new(by, 0.0, 0.0)
    };
    let deformed: Vec<_> = rest.iter().map(opened).collect();
    let mut on_walls = vec![false; rest.len()];
    removed.iter().flatten().for_each(|&v| on_walls[v as usize] = true);
    let at_wall = |&tet: &u32| kept[tet as usize].iter().any(|&v| on_walls[v as usize]);
    let at_walls: Vec<u32> = (0..kept.len() as u32).filter(at_wall).collect();
    let warp = Warp {
        origin_mm,
        rest: &rest,
        deformed: &deformed,
        tets: &kept,
        body_tets: kept.len(),
        removed: &removed,
    };
    let (sharp, _) = resample(&volume, &warp, &|_, _| {}).expect("valid warp");
    let (_, blended) = blend_walls(&volume, &warp, &at_walls, sharp.clone()).expect("valid walls");
    assert!(blended > 1000, "the walls cross {blended} voxels");
    group.bench_function("walls of a cut", |b| {
        let walls =
            |sharp| pool.install(|| blend_walls(&volume, &warp, &at_walls, sharp).expect("valid walls"));
        b.iter_batched(|| sharp.clone(), walls, BatchSize::LargeInput);
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
