//! Relaxation of ChainMail: positions of all elements and counts, after sweeps on the device and on
//! the CPU.
//!
//! The relaxation computes with integers, so every adapter has to be exact.

use anyhow::bail;
use std::cell::RefCell;

use cutis_chainmail::{Chain, Drag, Material, NO_MATERIAL, Order, RelaxGpu, Relaxation};
use cutis_gpu::Gpu;

use super::replaced;
use crate::parity::bench::{Bench, Failure};
use crate::parity::comparison::{Figures, Measured, Ring};

/// Elements along each axis: an odd number in a row, and several workgroups.
const SHAPE: [usize; 3] = [37, 22, 9];
/// Number of sweeps: more than one submission has.
const SWEEPS: u32 = 70;
/// Elements that stay grabbed while the others relax.
const GRABBED: [[usize; 3]; 2] = [[20, 20, 4], [3, 2, 1]];

/// Deliberate faults, as changes of the kernel.
const WRONG: [(&str, &str, &str); 8] = [
    ("the other half", "+ j + half.odd", "+ j + 1u - half.odd"),
    ("means rounded upwards", "2u * size + count - 1u", "2u * size + count"),
    ("no bounds", "max(min(by, asked.highest), asked.lowest)", "by"),
    ("bounds of another axis", "(neighbor >> 8u)) + axis", "(neighbor >> 8u)) + (axis + 1u) % 3u"),
    ("bounds of one material", "pairs + (neighbor >> 8u)", "pairs + pairs / max(half.materials, 1u)"),
    ("no k", "abs(by) < k", "false"),
    ("held elements move", "HELD: u32 = 192u", "HELD: u32 = 64u"),
    ("fixed elements move", "HELD: u32 = 192u", "HELD: u32 = 128u"),
];

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let name = "chainmail: relaxation";
    let start = body()?;
    let held = GRABBED.map(|place| start.element(place));
    let mut expected = start.clone();
    let done = expected.relax(SWEEPS, &held);
    let measure = |gpu: &Gpu, start: &Chain, change: &dyn Fn(String) -> String| {
        let mut found = start.clone();
        let relaxed = RelaxGpu::with_source(gpu, start, change)?.relax(&mut found, SWEEPS, &held)?;
        Ok(compared((&found, relaxed), (&expected, done)))
    };
    let same = |source: String| source;
    bench.compare(Ring::Kernel, name, |gpu, _| measure(gpu, &start, &same))?;
    for (what, from, to) in WRONG {
        bench.control(Ring::Kernel, name, what, |gpu, _| {
            let error = RefCell::new(None);
            let change = |source: String| match replaced(&source, from, to) {
                Ok(changed) => changed,
                Err(failure) => {
                    *error.borrow_mut() = Some(failure);
                    source
                }
            };
            let measured = measure(gpu, &start, &change);
            error.take().map_or(measured, Err)
        })?;
    }
    bench.control(Ring::Kernel, name, "a link less", |gpu, _| {
        let mut cut = start.clone();
        let [a, b] = [[10, 10, 4], [11, 10, 4]].map(|place| start.element(place));
        match cut.cut(|_, before, after| (before, after) == (a, b)) {
            1 => measure(gpu, &cut, &same),
            _ => bail!("the control cuts no link"),
        }
    })
}

/// Compares the positions by the largest difference of a coordinate in steps, and the counts.
fn compared(found: (&Chain, Relaxation), expected: (&Chain, Relaxation)) -> Measured {
    let ((chain, done), (of_cpu, of_cpu_done)) = (found, expected);
    let (mut differing, mut worst) = (0, 0.0_f64);
    for element in 0..of_cpu.places() as u32 {
        let (a, b) = (chain.position(element), of_cpu.position(element));
        differing += u64::from(a != b);
        worst = (0..3).map(|c| (a[c] - b[c]).abs()).fold(worst, f64::max);
    }
    let agrees = differing == 0 && done == of_cpu_done && chain.places() == of_cpu.places();
    let compared = of_cpu.places() as u64;
    Measured::new(agrees, Figures { compared, differing, worst, tolerance: 0.0, of: "a step of the grid" })
}

/// Four materials in layers and grains, with holes, a cut and fixed elements. One of the drags
/// contradicts the fixed elements.
fn body() -> Result<Chain, Failure> {
    let soft = Material { shear: [0.4, 0.2, 0.3], ..Material::isotropic(0.6, 1.7, 0.0, 0.0) };
    let across =
        Material { shortest: [0.5, 0.9, 0.2], longest: [2.0, 1.1, 3.0], shear: [1.0, 0.05, 0.4], k: 0.003 };
    let plastic = Material::isotropic(0.3, 3.0, 1.5, 0.2);
    let [nx, ny, nz] = SHAPE;
    let noise = |n: usize| n.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
    let grabbed = GRABBED.map(|[i, j, k]| i + nx * (j + ny * k));
    let of = |element: usize| match (noise(element) % 37, element % nx / 7) {
        _ if grabbed.contains(&element) => 0,
        (0, _) => NO_MATERIAL,
        (1, _) => (noise(element) >> 8 & 3) as u8,
        (_, layer) => [0, 1, 0, 3, 2, 0][layer.min(5)],
    };
    let elements = (0..nx * ny * nz).map(of).collect();
    let mut chain = Chain::new(SHAPE, [1.0, 0.8, 2.0], &[soft, across, Material::RIGID, plastic], elements)?;
    let [first, second] = GRABBED.map(|place| chain.element(place));
    let fixed =
        |element: &u32| chain.has_element(*element) && noise(*element as usize + 7).is_multiple_of(61);
    let mut fixed: Vec<u32> = (0..chain.places() as u32).filter(fixed).collect();
    fixed.retain(|element| ![first, second].contains(element));
    chain.fix(&fixed)?;
    chain.cut(|chain, a, _| chain.position(a)[0] == 12.0 && chain.position(a)[1] < 9.0);
    for by in [[5.0, -3.0, 2.0], [-2.0, 6.5, 1.5]] {
        let to = |element: u32, sign: f64| {
            let at = chain.position(element);
            Drag { element, to: [0, 1, 2].map(|c| at[c] + sign * by[c]) }
        };
        let drags = [to(first, 1.0), to(second, -1.0)];
        chain.drag(&drags, Order::Fifo)?;
    }
    Ok(chain)
}
