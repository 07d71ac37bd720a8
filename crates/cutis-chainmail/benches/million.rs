//! A million elements: propagation with one queue and with slabs, and one sweep of relaxation.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use cutis_chainmail::{Chain, Drag, Material, Order};

const SIDE: usize = 100;

/// The materials of a cube.
#[derive(Clone, Copy)]
enum Materials {
    /// One material.
    Uniform,
    /// Layers of ten elements, alternately soft and stiff.
    Layers,
    /// A soft or a stiff element at random.
    Noise,
}

fn cube(materials: Materials) -> Chain {
    let soft = Material::isotropic(0.9, 1.1, 0.1, 0.0);
    let stiff = Material::isotropic(0.99, 1.01, 0.01, 0.0);
    let material = |element: usize| match materials {
        Materials::Uniform => 0,
        Materials::Layers => (element / SIDE % SIDE / 10 % 2) as u8,
        Materials::Noise => (element as u32).wrapping_mul(2_654_435_761).count_ones() as u8 % 2,
    };
    Chain::new([SIDE; 3], [1.0; 3], &[soft, stiff], (0..SIDE.pow(3)).map(material).collect()).unwrap()
}

/// Drags a corner so far that all elements move.
fn pull(chain: &Chain) -> Drag {
    let element = chain.element([0; 3]);
    Drag { element, to: [-60.0, -50.0, -40.0] }
}

/// Drags every seventh element along each axis a little, so that many elements are away from the
/// mean of their neighbors.
fn knead(chain: &Chain) -> Chain {
    let mut deformed = chain.clone();
    for element in 0..chain.places() as u32 {
        let place = [element as usize % SIDE, element as usize / SIDE % SIDE, element as usize / SIDE.pow(2)];
        if place.iter().all(|n| n % 7 == 3) {
            let by = |axis: usize| {
                f64::from((element.wrapping_mul(2_654_435_761) >> (8 * axis)) & 255) / 256.0 - 0.5
            };
            let at = deformed.position(element);
            deformed
                .drag(&[Drag { element, to: [0, 1, 2].map(|axis| at[axis] + by(axis)) }], Order::Fifo)
                .unwrap();
        }
    }
    deformed
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("million");
    group.sample_size(10).throughput(Throughput::Elements(SIDE.pow(3) as u64));
    for (name, materials) in
        [("uniform", Materials::Uniform), ("layers", Materials::Layers), ("noise", Materials::Noise)]
    {
        let chain = cube(materials);
        for (queue, order) in [("fifo", Order::Fifo), ("slabs", Order::Slabs)] {
            group.bench_function(format!("{queue}/{name}"), |bencher| {
                bencher.iter_batched_ref(
                    || chain.clone(),
                    |chain| {
                        let drag = pull(chain);
                        let moved = chain.drag(&[drag], order).unwrap();
                        assert_eq!(moved.elements, SIDE.pow(3));
                        moved
                    },
                    BatchSize::LargeInput,
                );
            });
        }
        let mut dragged = knead(&chain);
        group.bench_function(format!("classic/{name}"), |bencher| {
            bencher.iter_batched_ref(
                || chain.clone(),
                |chain| chain.drag_classic(pull(chain)),
                BatchSize::LargeInput,
            );
        });
        // The search for classes happens once, before the first sweep. It is not measured.
        dragged.relax(0, &[]);
        group.bench_function(format!("sweep/{name}"), |bencher| {
            bencher.iter_batched_ref(
                || dragged.clone(),
                |chain| {
                    let relaxed = chain.relax(1, &[0]);
                    assert!(relaxed.moves > SIDE.pow(3) as u64 / 2, "{relaxed:?}");
                },
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(million, benches);
criterion_main!(million);
