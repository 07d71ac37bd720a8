//! The phantom at 512 × 512 × 300 voxels: its depth below the skin (all of it,
//! and around a wound), and its skin with 900 × 900
//! pixels as a whole and close up.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use cutis_render::{Focus, Side, View, raymarch, skin_depth};
use cutis_volume::phantom::Phantom;
use nalgebra::Point3;

fn bench(criterion: &mut Criterion) {
    let phantom = Phantom::new([512, 512, 300], 1).expect("a size within the limits");
    let volume = phantom.volume().expect("within the memory");
    let (center_mm, _) = phantom.incision_site();
    let spacing = volume.grid().affine.spacing_mm().into_iter().fold(f64::INFINITY, f64::min);
    let mut group = criterion.benchmark_group("phantom 512 × 512 × 300");
    group.sample_size(10);
    group.bench_function("depth below the skin", |b| {
        b.iter(|| black_box(skin_depth(&volume, -300.0, spacing, 20.0, None).expect("lengths above zero")));
    });
    let corner = |mm: f64| Point3::from(center_mm.map(|x| x + mm));
    let part = Some([corner(-75.0), corner(75.0)]);
    group.bench_function("depth below the skin within 150 mm", |b| {
        b.iter(|| black_box(skin_depth(&volume, -300.0, spacing, 20.0, part).expect("lengths above zero")));
    });
    let depth = skin_depth(&volume, -300.0, spacing, 20.0, None).expect("lengths above zero");
    let all = View { width: 900, height: 900, depth: Some(&depth), ..View::new(Side::Anterior) };
    let close = View { focus: Some(Focus { center_mm, size_mm: 150.0 }), ..all };
    for (name, view) in [("picture of the whole", &all), ("picture of 150 mm", &close)] {
        group.bench_function(name, |b| {
            b.iter(|| black_box(raymarch(&volume, view).expect("valid settings")));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
