//! An increment of a growing cut: 100 × 20 mm on a torso of 230 thousand vertices with steps of
//! 4 mm.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use cutis_mesh::{Cut, Incision, Lattice, SkinMode, Slit, Split, Tissue, TissueMask};
use cutis_volume::phantom::Phantom;
use cutis_volume::sample;

fn bench(criterion: &mut Criterion) {
    let phantom = Phantom::new([192, 192, 128], 1).expect("a valid size");
    let volume = phantom.volume().expect("a phantom");
    let grid = sample::lattice_grid(volume.grid(), "4.0".parse().expect("a step")).expect("a lattice");
    let lattice = Lattice::new(grid, Split::Five).expect("a lattice");
    let hu = lattice.sample(&volume).expect("values at the lattice points");
    let air: Vec<bool> = hu.iter().map(|&hu| hu < -449.0).collect();
    let tissue = Tissue { air: &air, cut_away: &[], largest_component: true };
    let (body, skin) =
        TissueMask::find_with_skin(&lattice, &tissue, SkinMode::Exterior, None).expect("tissue");
    let mut mesh = body.mesh(&hu).expect("a mesh");
    let (on_body, _) = body.skin(&skin);
    let path_mm = vec![[30.0, 110.0, -50.0], [30.0, 110.0, 50.0]];
    let incision = Incision { path_mm, depth_mm: 20.0, width_mm: None };
    let slits = Slit::on_lattice(&lattice, &on_body, &[incision]).expect("a place on the skin");
    let (mut triangles, _) = mesh.divide_skin(&on_body);
    let mut cut = Cut::of_slits(&mesh, &triangles, slits).expect("a cut");
    let vertices = mesh.positions.len();
    let severed = cut.sever_growing(&mut mesh, &mut triangles).expect("a cut of the skin");
    let (_, growth) = severed.expect("the incision has no width");
    let length = growth.lengths()[0];
    let mut group = criterion.benchmark_group(format!("an increment of a cut, {vertices} vertices"));
    for share in [0.1, 0.5, 0.9] {
        group.bench_function(format!("{:.0} % of the cut", 100.0 * share), |bencher| {
            bencher.iter(|| black_box(growth.stage(&[share * length])));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
