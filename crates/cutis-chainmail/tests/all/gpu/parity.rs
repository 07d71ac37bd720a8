//! Every element is where the CPU puts it, after any history.

use cutis_chainmail::{Chain, Order, RelaxGpu};
use cutis_gpu::Gpu;
use proptest::prelude::*;

use crate::bodies::{SHAPES, at_rest, cut_some, drag_some, fix_some};
use crate::{devices, outcome, random};

/// Sweeps that are asked for: none, one, fewer than are submitted at once, more, and as many as it takes.
const MOST: [u32; 5] = [0, 1, 7, 70, 1000];

#[test]
fn bodies_that_have_everything_relax_to_the_same_bits() {
    let Some(gpus) = devices() else { return };
    let (mut settled, mut moves) = (0, 0);
    for (number, shape) in SHAPES.into_iter().enumerate() {
        let seed = 100 * number as u64;
        let mut expected = at_rest(shape, seed);
        let mut found = [(); 3].map(|()| expected.clone());
        let mut devices = gpus.each_ref().map(|gpu| RelaxGpu::new(gpu, &expected).unwrap());
        assert_eq!(devices[0].slabs(), 1);
        assert_eq!(devices[1].slabs(), shape[2], "a plane each");
        for (round, most) in (0..).zip(MOST) {
            let change = |chain: &mut Chain| {
                match round {
                    2 => cut_some(chain, seed + 11),
                    3 => fix_some(chain, seed + 12),
                    _ => {}
                }
                drag_some(chain, seed + 20 + round)
            };
            // Twice the same one, and some that are not there.
            let mut held = change(&mut expected);
            held.extend_from_within(..);
            held.extend([u32::MAX, expected.places() as u32]);
            let held = if round == 4 { &[] } else { &held[..] };
            let relaxed = expected.relax(most, held);
            let wanted = outcome(&expected, relaxed);
            settled += u32::from(relaxed.settled);
            moves += relaxed.moves;
            for (device, chain) in devices.iter_mut().zip(&mut found) {
                change(chain);
                let relaxed = device.relax(chain, most, held).unwrap();
                assert!(outcome(chain, relaxed) == wanted, "{shape:?}, {most}: {relaxed:?}, {:?}", wanted.0);
            }
        }
    }
    assert!(settled > 5 && moves > 100_000, "{settled} {moves}");
}

/// One device for two bodies in turn, of which each is what the other left on it.
#[test]
fn what_another_body_left_does_not_count() {
    let Some(gpus) = devices() else { return };
    for gpu in &gpus {
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
                assert_eq!(outcome(found, done), outcome(expected, wanted));
            }
        }
    }
}

/// Each goes on from where the other left off.
#[test]
fn cpu_and_gpu_take_turns() {
    let Some(gpus) = devices() else { return };
    let mut expected = at_rest([31, 12, 9], 3);
    let mut found = expected.clone();
    let mut device = RelaxGpu::new(&gpus[0], &found).unwrap();
    let held = drag_some(&mut expected, 4);
    drag_some(&mut found, 4);
    for _ in 0..3 {
        expected.relax(5, &held);
        device.relax(&mut found, 5, &held).unwrap();
        let (a, b) = (expected.relax(5, &held), found.relax(5, &held));
        assert_eq!(outcome(&found, b), outcome(&expected, a));
    }
}

/// More sweeps than small bodies take to settle.
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
            let wanted = outcome(&with_cpu, done);
            for (device, chain) in devices.iter_mut().zip(&mut found) {
                *chain = expected.clone();
                let relaxed = device.relax(chain, most, held).unwrap();
                prop_assert_eq!(outcome(chain, relaxed), wanted.clone());
            }
            prop_assert!(most < ENOUGH || done.settled, "{:?}", done);
            expected = with_cpu;
        }
    }
    Ok(())
}

#[test]
fn random_bodies_relax_to_the_same_bits() {
    let Some(gpus) = devices() else { return };
    let config = ProptestConfig {
        cases: 100,
        // Each comparison takes a while.
        max_shrink_iters: 100,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let mut runner = proptest::test_runner::TestRunner::new(config);
    runner.run(&(random::case(), 0_u32..40), |(case, most)| check(&case, &gpus, most)).unwrap();
}
