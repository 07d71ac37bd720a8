//! Controls: the comparison detects another body and every fault of the kernel.

use cutis_chainmail::{Chain, Drag, Material, Order, RelaxGpu};
use cutis_gpu::GpuOptions;

use cutis_test_kit::gpu::{on_each_adapter, on_each_adapter_with};

use super::bodies::{SHAPES, at_rest, drag_some};
use super::result;

const SWEEPS: u32 = 12;

#[test]
fn another_k_and_a_missing_link_are_detected() {
    on_each_adapter(|gpu| {
        let body = |k: f64, apart: (u32, u32)| {
            let soft = Material::isotropic(0.6, 1.8, 0.4, k);
            let mut body = Chain::new([12, 10, 4], [1.0; 3], &[soft], vec![0; 480]).unwrap();
            drag_some(&mut body, 8);
            body.cut(|_, a, b| (a, b) == apart);
            body
        };
        let mut expected = body(0.01, (0, 0));
        let done = expected.relax(SWEEPS, &[]);
        let wanted = result(&expected, done);
        let found = |mut chain: Chain| {
            let done = RelaxGpu::new(gpu, &chain).unwrap().relax(&mut chain, SWEEPS, &[]).unwrap();
            result(&chain, done)
        };
        assert_eq!(found(body(0.01, (0, 0))), wanted);
        assert_ne!(found(body(0.011, (0, 0))), wanted);
        assert_ne!(found(body(0.01, (0, 1))), wanted);
    });
}

/// Replacements of one operation each. The first text occurs once in the source.
const MUTATIONS: &[(&str, &str)] = &[
    ("plane * slab.pitch + place / 2u", "plane * slab.pitch + (place + 1u) / 2u"),
    ("16u * (place & 1u)", "16u * (1u - (place & 1u))"),
    ("3u * (pairs + (neighbor >> 8u)) + axis", "3u * (pairs + (neighbor >> 8u)) + half.coordinate"),
    ("pairs + (neighbor >> 8u)", "pairs"),
    ("axis == half.coordinate", "axis == 0u"),
    ("select(rest, -rest, after)", "select(-rest, rest, after)"),
    ("select(bound.x, -bound.y, after)", "select(bound.x, bound.y, after)"),
    ("select(bound.y, -bound.x, after)", "select(bound.y, -bound.y, after)"),
    ("max(so_far.lowest, low)", "min(so_far.lowest, low)"),
    ("min(so_far.highest, high)", "high"),
    ("2u * size + count - 1u", "2u * size + count"),
    ("(2u * size + count - 1u) / (2u * count)", "size / count"),
    ("select(nearest, -nearest, sum < 0)", "nearest"),
    ("asked.lowest > 0 ||", ""),
    ("|| asked.highest < 0", ""),
    ("max(min(by, asked.highest), asked.lowest)", "by"),
    ("abs(by) < k", "abs(by) <= k"),
    ("abs(by) < k", "false"),
    ("slab.first + k + j", "k + j"),
    ("+ j + half.odd", "+ j"),
    ("|| (own & HELD) != 0u", ""),
    ("HELD: u32 = 192u", "HELD: u32 = 64u"),
    ("HELD: u32 = 192u", "HELD: u32 = 128u"),
    ("k + 1u < slab.planes", "true"),
    ("if (k > 0u)", "if (true)"),
    ("plane * (slab.planes_below - 1u)", "plane * 0u"),
    ("element(k + 2u, place)", "element(k + 1u, place)"),
    ("asked, there - here, pairs, element(k, place)", "asked, there - here, pairs, element(k + 1u, place)"),
    ("(AFTER << 2u)", "(AFTER << 1u)"),
    ("(BEFORE << 2u)", "(BEFORE << 1u)"),
    ("x[at + slab.columns]", "x[at + 1u]"),
    ("number += threads", "number += threads + 1u"),
    ("any = any | atomicLoad(&moved[word]);", "any = atomicLoad(&moved[word]);"),
    ("word < HALVES", "word < 1u"),
    ("SWEEP + 2u * half.coordinate", "SWEEP + 2u * SWEEP"),
    ("select(0u, 1u, by != 0)", "1u"),
];

/// A body in which relaxation changes no x coordinate.
fn moving_along_y() -> (Chain, Vec<u32>) {
    let soft = Material::isotropic(0.6, 1.8, 0.4, 0.0);
    let mut body = Chain::new([6, 6, 3], [1.0; 3], &[soft], vec![0; 108]).unwrap();
    let element = body.element([3, 3, 1]);
    body.drag(&[Drag { element, to: [3.0, 6.5, 1.0] }], Order::Fifo).unwrap();
    (body, vec![element])
}

#[test]
fn every_mutation_of_the_kernel_is_detected() {
    on_each_adapter_with(&GpuOptions { chunk_cap: Some(150), ..GpuOptions::default() }, |gpu| {
        let random = SHAPES.into_iter().map(|shape| {
            let mut body = at_rest(shape, 40);
            let held = drag_some(&mut body, 41);
            (body, held)
        });
        let bodies: Vec<_> = random
            .chain([moving_along_y()])
            .map(|(before, held)| {
                let mut after = before.clone();
                let done = after.relax(SWEEPS, &held);
                (before, held, result(&after, done))
            })
            .collect();
        let differs = |change: &dyn Fn(String) -> String| {
            bodies.iter().any(|(before, held, wanted)| {
                let mut chain = before.clone();
                let mut device = RelaxGpu::with_source(gpu, &chain, change).unwrap();
                let done = device.relax(&mut chain, SWEEPS, held).unwrap();
                result(&chain, done) != *wanted
            })
        };
        assert!(!differs(&|source| source));
        let undetected: Vec<_> = MUTATIONS
            .iter()
            .filter(|(from, to)| {
                !differs(&|source| {
                    assert_eq!(source.matches(from).count(), 1, "{from}");
                    source.replace(from, to)
                })
            })
            .collect();
        assert!(undetected.is_empty(), "{undetected:#?}");
    });
}
