//! Every element is at the same position as on the CPU, after any history.

use cutis_chainmail::{Chain, Order, RelaxGpu};
use cutis_gpu::Gpu;
use proptest::prelude::*;

use super::bodies::{SHAPES, at_rest, cut_some, drag_some, fix_some};
use super::{on_each_adapter_split, result};
use crate::random;

/// Numbers of sweeps: none, one, less and more than one submission, and enough to settle.
const MOST: [u32; 5] = [0, 1, 7, 70, 400];

#[test]
fn complex_bodies_relax_to_the_same_bits() {
    on_each_adapter_split(|gpus| {
        let (mut settled, mut moves) = (0, 0);
        for (number, shape) in SHAPES.into_iter().enumerate() {
            let seed = 100 * number as u64;
            let mut expected = at_rest(shape, seed);
            let mut found = [(); 3].map(|()| expected.clone());
            let mut devices = gpus.each_ref().map(|gpu| RelaxGpu::new(gpu, &expected).unwrap());
            assert_eq!(devices[0].slabs(), 1);
            assert_eq!(devices[1].slabs(), shape[2], "one plane per slab");
            for (round, most) in (0..).zip(MOST) {
                let change = |chain: &mut Chain| {
                    match round {
                        2 => cut_some(chain, seed + 11),
                        3 => fix_some(chain, seed + 12),
                        _ => {}
                    }
                    drag_some(chain, seed + 20 + round)
                };
                // Some elements are listed twice, and some do not exist.
                let mut held = change(&mut expected);
                held.extend_from_within(..);
                held.extend([u32::MAX, expected.places() as u32]);
                let held = if round == 4 { &[] } else { &held[..] };
                let relaxed = expected.relax(most, held);
                let wanted = result(&expected, relaxed);
                settled += u32::from(relaxed.settled);
                moves += relaxed.moves;
                for (device, chain) in devices.iter_mut().zip(&mut found) {
                    change(chain);
                    let relaxed = device.relax(chain, most, held).unwrap();
                    assert!(
                        result(chain, relaxed) == wanted,
                        "{shape:?}, {most}: {relaxed:?}, {:?}",
                        wanted.0
                    );
                }
            }
        }
        assert!(settled > 5 && moves > 100_000, "{settled} {moves}");
    });
}

/// One device is used for two bodies alternately.
#[test]
fn data_of_another_body_have_no_effect() {
    on_each_adapter_split(|gpus| {
        for gpu in gpus {
            let shape = [13, 7, 6];
            let mut bodies = [1, 2].map(|seed| (at_rest(shape, seed), at_rest(shape, seed)));
            let mut device = RelaxGpu::new(gpu, &bodies[0].0).unwrap();
            for round in 0..3 {
                for (found, expected) in &mut bodies {
                    let held = drag_some(found, round);
                    drag_some(expected, round);
                    let done = device.relax(found, 9, &held).unwrap();
                    let wanted = expected.relax(9, &held);
                    assert!(wanted.moves > 0);
                    assert_eq!(result(found, done), result(expected, wanted));
                }
            }
        }
    });
}

/// Each relaxation continues from the other one's result.
#[test]
fn cpu_and_gpu_can_alternate() {
    on_each_adapter_split(|gpus| {
        let mut expected = at_rest([31, 12, 9], 3);
        let mut found = expected.clone();
        let mut device = RelaxGpu::new(&gpus[0], &found).unwrap();
        let held = drag_some(&mut expected, 4);
        drag_some(&mut found, 4);
        for _ in 0..3 {
            expected.relax(5, &held);
            device.relax(&mut found, 5, &held).unwrap();
            let (a, b) = (expected.relax(5, &held), found.relax(5, &held));
            assert_eq!(result(&found, b), result(&expected, a));
        }
    });
}

/// Enough sweeps for small bodies to settle.
const ENOUGH: u32 = 5000;

fn check(case: &random::Case, gpus: &[Gpu; 3], most: u32) -> Result<(), TestCaseError> {
    let mut expected = case.chain();
    let mut found = [(); 3].map(|()| expected.clone());
    let mut devices = gpus.each_ref().map(|gpu| RelaxGpu::new(gpu, &expected).unwrap());
    for drags in case.drags(&expected) {
        expected.drag(&drags, Order::Fifo).unwrap();
        let held: Vec<u32> = drags.iter().map(|drag| drag.element).collect();
        for (most, held) in [(most, &held[..]), (1, &[]), (ENOUGH, &held[..])] {
            let mut with_cpu = expected.clone();
            let done = with_cpu.relax(most, held);
            let wanted = result(&with_cpu, done);
            for (device, chain) in devices.iter_mut().zip(&mut found) {
                *chain = expected.clone();
                let relaxed = device.relax(chain, most, held).unwrap();
                prop_assert_eq!(result(chain, relaxed), wanted.clone());
            }
            prop_assert!(most < ENOUGH || done.settled, "{:?}", done);
            expected = with_cpu;
        }
    }
    Ok(())
}

#[test]
fn random_bodies_relax_to_the_same_bits() {
    on_each_adapter_split(|gpus| {
        let config = ProptestConfig {
            cases: 40,
            // Each comparison takes a while.
            max_shrink_iters: 100,
            failure_persistence: None,
            ..ProptestConfig::default()
        };
        let mut runner = proptest::test_runner::TestRunner::new(config);
        runner.run(&(random::case(), 0_u32..40), |(case, most)| check(&case, gpus, most)).unwrap();
    });
}
