//! A cycle on the device is that of the CPU, part by part, and the comparisons notice every fault.

use cutis_gpu::{Gpu, GpuError, GpuOptions, Select};
use cutis_test_kit::gpu::on_each_adapter;
use nalgebra::Vector3;

use super::equations::GpuEquations;
use super::rows::{OfMatrix, Prolongation, Restriction};
use super::sliced::{Reads, Sliced};
use super::{RestGpu, step::Step};
use crate::conjugate::{Equations, Solution, solve};
use crate::curvature::Curvature;
use crate::host::{HostEquations, Vectors, scaled};
use crate::matrix::Matrix;
use crate::multigrid::{LANES, Multigrid, RIGID};
use crate::smoother::Operator;
use crate::springs::{block, flat_block};
use crate::transfer::Transfer;
use crate::{Body, RestError};

/// Largest difference of a product with a matrix, over its largest number. Measured: 3e-7 with the
/// matrix, 9.5e-7 with a restriction, 1e-7 with a prolongation.
const PRODUCT: f64 = 2e-6;
/// The same for a cycle, and for the matrix times its result, without a patch and with one.
/// Measured: 3.2e-6 and 3.1e-5, and with a patch 1.4e-6 and 2.9e-3. On the CPU, the cycle of a
/// right-hand side that is rounded in another way differs by 2.0e-6 and 3.7e-5, and with a patch by
/// 2.3e-6 and 2.3e-3, because flat tetrahedra are stiff.
const CYCLE: [[f64; 2]; 2] = [[6e-6, 6e-5], [6e-6, 6e-3]];

/// A matrix with three levels, and a right-hand side.
struct Problem {
    /// Bounds of the differences of a cycle.
    most: [f64; 2],
    matrix: Matrix,
    multigrid: Multigrid,
    right: Vec<Vector3<f64>>,
}

fn noise(n: usize) -> f64 {
    ((n as f64 + 1.0) * 12.9898).sin() * 43758.5453 % 1.0
}

impl Problem {
    /// One problem without a patch, and one with it.
    fn all() -> [Self; 2] {
        let [without, with] = [block(), flat_block()].map(|system| Body::of(&system, [0.0; 3]).unwrap());
        let both = [Self::of(&without, CYCLE[0]), Self::of(&with, CYCLE[1])];
        assert!(both[0].multigrid.patch.is_none() && both[1].multigrid.patch.is_some());
        both
    }

    fn new() -> Self {
        Self::all().into_iter().next().unwrap()
    }

    fn of(body: &Body, most: [f64; 2]) -> Self {
        let mut x = body.start.clone();
        body.free.iter().for_each(|&v| x[v as usize].x += 1e-3 * noise(v as usize));
        let mut matrix = body.empty_matrix();
        body.fill(&mut matrix, &x, Curvature::Stretched, 0.0);
        let places: Vec<_> = body.free.iter().map(|&v| x[v as usize]).collect();
        let multigrid = Multigrid::new(&matrix, &places);
        assert!(!multigrid.coarse.is_empty(), "the problem has more than two levels");
        let right = (0..matrix.nodes()).map(|n| Vector3::from_fn(|axis, _| noise(3 * n + axis))).collect();
        Self { most, matrix, multigrid, right }
    }

    /// The numbers of the right-hand side.
    fn numbers(&self) -> Vec<[f32; 4]> {
        self.right.iter().map(|v| scaled(v, 1.0)).collect()
    }

    /// The first cycle on the CPU, and the matrix times its result.
    fn cycle(&mut self) -> [Vec<f32>; 2] {
        let right = self.numbers();
        let (mut z, mut product) = (right.clone(), right.clone());
        self.multigrid.cycle(&self.matrix, &right, &mut z, &mut product);
        [z, product].map(|vector| vector.as_flattened().to_vec())
    }

    /// Equations on a device with this matrix.
    fn loaded(&self, device: &RestGpu) -> GpuEquations {
        let mut equations = device.equations(self.matrix.nodes()).unwrap();
        equations.load(&self.matrix, &self.multigrid).unwrap();
        equations
    }

    /// The first cycle on a device, and the matrix times its result.
    fn cycle_on(&self, device: &RestGpu) -> [Vec<f32>; 2] {
        let mut equations = self.loaded(device);
        equations.begin(&self.right, 1.0).unwrap();
        [&equations.vectors.z, &equations.vectors.z_product].map(|vector| equations.read(vector).unwrap())
    }
}

/// The largest difference of two vectors over the largest number of the second one.
fn difference(found: &[f32], expected: &[f32]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = |x: &mut dyn Iterator<Item = f32>| x.fold(0.0, |most: f32, x| most.max(x.abs()));
    // Not a number is a difference.
    let apart = |(a, b): (&f32, &f32)| if (a - b).is_nan() { f32::INFINITY } else { a - b };
    let apart = largest(&mut found.iter().zip(expected).map(apart));
    f64::from(apart) / f64::from(largest(&mut expected.iter().copied()))
}

/// Whether a cycle and its product are those of the CPU.
fn is_near(found: &[Vec<f32>; 2], expected: &[Vec<f32>; 2], most: [f64; 2]) -> bool {
    of_cycle(found, expected).into_iter().zip(most).all(|(found, most)| found < most)
}

/// The differences of a cycle and of its product.
fn of_cycle(found: &[Vec<f32>; 2], expected: &[Vec<f32>; 2]) -> [f64; 2] {
    [0, 1].map(|n| difference(&found[n], &expected[n]))
}

/// The same adapter with these chunks.
fn in_chunks(gpu: &Gpu, chunk_cap: usize) -> Gpu {
    let select = Select::Index(gpu.adapter().index);
    let chunk_cap = Some(chunk_cap);
    Gpu::open(&GpuOptions { select, chunk_cap, baseline_limits: true, ..GpuOptions::default() }).unwrap()
}

/// The vector that a kernel writes, or adds to zeros.
fn product_on<const R: usize, const C: usize>(
    device: &RestGpu,
    kernel: &std::sync::Arc<cutis_gpu::Kernel>,
    matrix: &Sliced<R, C>,
    [from, to]: [u32; 2],
    x: &[f32],
    len: usize,
) -> Vec<f32> {
    let gpu = device.gpu();
    let (x, found) = (gpu.buffer("x", x).unwrap(), gpu.zeroed::<f32>("found", len).unwrap());
    let vectors = [(from, x.whole()), (to, found.whole())];
    let step = Step::new(gpu, kernel, matrix, Reads::Blocks, &vectors).unwrap();
    let mut pass = gpu.pass("product");
    step.run(&mut pass);
    pass.submit().unwrap();
    gpu.read(&found, 0..len).unwrap()
}

#[test]
fn products_are_those_of_the_cpu() {
    let mut problem = Problem::new();
    let numbers = problem.numbers();
    let Some(fine) = &problem.multigrid.fine else { panic!() };
    let mut product = numbers.clone();
    problem.matrix.times(&numbers, &mut product);
    let restricted = fine.transfer.restrict(&numbers);
    let mut prolonged = vec![[0.0; 4]; numbers.len()];
    fine.transfer.add_prolonged(&restricted, &mut prolonged);
    let expected = [product.as_flattened(), restricted.as_flattened(), prolonged.as_flattened()];
    let on = |device: &RestGpu, problem: &Problem| {
        let Some(fine) = &problem.multigrid.fine else { panic!() };
        let (gpu, kernels, Transfer { prolongation, .. }) = (device.gpu(), device.kernels(), &fine.transfer);
        let (fine_len, coarse_len) = (4 * numbers.len(), LANES * restricted.len());
        let rows = OfMatrix { matrix: &problem.matrix, smoother: Some(&fine.smoother) };
        let matrix = Sliced::new(gpu, "matrix", &rows).unwrap();
        let down = Sliced::<RIGID, 3>::new(gpu, "down", &Restriction::of(prolongation)).unwrap();
        let up = Sliced::<3, RIGID>::new(gpu, "up", &Prolongation(prolongation)).unwrap();
        let (x, coarse) = (numbers.as_flattened(), restricted.as_flattened());
        let way = &kernels.from_fine;
        let found = [
            product_on(device, &kernels.product, &matrix, [0, 3], x, fine_len),
            product_on(device, &way.restriction, &down, [0, 1], x, coarse_len),
            product_on(device, &way.prolongation, &up, [0, 1], coarse, fine_len),
        ];
        ([0, 1, 2].map(|n| difference(&found[n], expected[n])), matrix.parts())
    };
    on_each_adapter(|gpu| {
        let (errors, parts) = on(&RestGpu::new(gpu).unwrap(), &problem);
        eprintln!("products: {errors:?}");
        assert!(errors.iter().all(|&error| error < PRODUCT) && parts == 1, "{errors:?} in {parts}");
        for cap in [1, 100] {
            let (split, parts) = on(&RestGpu::new(&in_chunks(gpu, cap)).unwrap(), &problem);
            assert!(split == errors && parts > 10, "{split:?} and {errors:?} in {parts} parts");
        }
    });
    // Control: a number that is off by 1 % is noticed, in the matrix only.
    let values = problem.matrix.above.values_mut();
    let (largest, _) = values.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap();
    values[largest] *= 1.01;
    on_each_adapter(|gpu| {
        let ([product, down, up], _) = on(&RestGpu::new(gpu).unwrap(), &problem);
        assert!(product > 10.0 * PRODUCT && down < PRODUCT && up < PRODUCT, "{product:e} {down:e} {up:e}");
    });
}

#[test]
fn a_cycle_is_that_of_the_cpu() {
    for (mut problem, mut rounded) in Problem::all().into_iter().zip(Problem::all()) {
        let (most, expected) = (problem.most, problem.cycle());
        rounded.right.iter_mut().enumerate().for_each(|(n, x)| *x *= 1.0 + 6e-8 * noise(n));
        let of_rounding = of_cycle(&rounded.cycle(), &expected);
        eprintln!("rounding: {of_rounding:?}");
        assert!((0..2).all(|n| most[n] < 5.0 * of_rounding[n]), "{of_rounding:?}");
        on_each_adapter(|gpu| {
            let device = RestGpu::new(gpu).unwrap();
            let found = problem.cycle_on(&device);
            eprintln!("cycle: {:?}", of_cycle(&found, &expected));
            assert!(is_near(&found, &expected, most), "{:?}", of_cycle(&found, &expected));
            assert!(problem.cycle_on(&device) == found, "a second run");
            for cap in [1, 100] {
                let split = RestGpu::new(&in_chunks(gpu, cap)).unwrap();
                assert!(problem.cycle_on(&split) == found, "chunks of {cap}");
            }
        });
        // Control: a number of the matrix that is off by 10 % is noticed. In the product 1 % is
        // enough.
        let values = problem.matrix.above.values_mut();
        let (largest, _) = values.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap();
        values[largest] *= 1.1;
        on_each_adapter(|gpu| {
            let found = problem.cycle_on(&RestGpu::new(gpu).unwrap());
            let errors = of_cycle(&found, &expected);
            assert!((0..2).all(|n| errors[n] > 3.0 * most[n]), "{errors:?}");
        });
    }
}

/// A matrix that is filled again goes to the device with its smoother and its patch, and the levels
/// stay.
#[test]
fn an_update_is_that_of_the_cpu() {
    on_each_adapter(|gpu| {
        for mut problem in Problem::all() {
            let stale = problem.cycle();
            let mut equations = problem.loaded(&RestGpu::new(gpu).unwrap());
            let buffers = gpu.counters().buffers;
            problem.matrix.above.values_mut().iter_mut().for_each(|x| *x *= 0.5);
            problem.multigrid.update(&problem.matrix);
            let expected = problem.cycle();
            equations.load(&problem.matrix, &problem.multigrid).unwrap();
            assert_eq!(gpu.counters().buffers, buffers, "no memory is allocated");
            equations.begin(&problem.right, 1.0).unwrap();
            let vectors = [&equations.vectors.z, &equations.vectors.z_product];
            let found = vectors.map(|vector| equations.read(vector).unwrap());
            assert!(is_near(&found, &expected, problem.most), "{:?}", of_cycle(&found, &expected));
            assert!(of_cycle(&stale, &expected)[0] > 0.01, "control");
        }
    });
}

fn solved(equations: &mut impl Equations, problem: &Problem, tolerance: f64) -> Solution {
    solve(equations, &problem.right, tolerance, 300).unwrap()
}

/// Conjugate gradients take as many cycles, and one submission for each half of them. The solutions
/// differ by some 2e-6 for both tolerances, which is the rounding of a cycle.
#[test]
fn solutions_are_those_of_the_cpu() {
    let mut problem = Problem::new();
    let expected = {
        let mut vectors = Vectors::default();
        let Problem { matrix, multigrid, right, .. } = &mut problem;
        let mut equations = HostEquations { matrix, multigrid, vectors: &mut vectors };
        [0.1, 1e-3].map(|tolerance| solve(&mut equations, right, tolerance, 300).unwrap())
    };
    let flat = |x: &[Vector3<f64>]| -> Vec<f32> {
        x.iter().flat_map(|x| <[f64; 3]>::from(*x).map(|x| x as f32)).collect()
    };
    on_each_adapter(|gpu| {
        let mut equations = problem.loaded(&RestGpu::new(gpu).unwrap());
        for (tolerance, expected) in [0.1, 1e-3].into_iter().zip(&expected) {
            let before = gpu.counters();
            let found = solved(&mut equations, &problem, tolerance);
            let after = gpu.counters();
            let error = difference(&flat(&found.x), &flat(&expected.x));
            eprintln!("solution to {tolerance}: {error:e} in {} cycles", found.cycles);
            assert!(error < 0.01 * tolerance, "{error:e} at {tolerance}");
            assert_eq!((found.cycles, found.indefinite), (expected.cycles, false));
            // The first cycle, and the last one without a turn or with one.
            let most = 2 * found.cycles as u64;
            assert!(after.submits - before.submits <= most, "{} submissions", after.submits - before.submits);
            assert!(after.readbacks - before.readbacks <= most + 1);
        }
    });
}

/// Replacements of one operation each. The first text occurs in one source or more.
const MUTATIONS: &[(&str, &str)] = &[
    ("(chunk.first + slice) * 64u", "(chunk.first + slice) * 64u + ROW_LANES"),
    ("(chunk.first + slice)", "slice"),
    ("node < chunk.rows", "node + 1u < chunk.rows"),
    ("columns[block * ROWS + place.row]", "columns[block * ROWS]"),
    ("min(lane, ROW_UNKNOWNS - 1u)", "0u"),
    ("values[first + HEIGHT] * of_node.y", "values[first] * of_node.y"),
    ("values[first + 2u * HEIGHT] * of_node.z", "0.0"),
    ("values[first + 5u * HEIGHT] * of_node.last.z", "0.0"),
    ("of_node.first.z", "of_node.first.x"),
    ("vec3f(first.w, last.xy)", "vec3f(last.xy, first.w)"),
    ("return difference(neighbor, own);", "return neighbor;"),
    ("place.slice + 1u];\n    let own", "place.slice + 1u] - 1u;\n    let own"),
    ("starts[place.slice + 1u];\n    var sum", "starts[place.slice + 1u] - 1u;\n    var sum"),
    ("return sum + row_times(row_of(place, own_block), own);", "return sum;"),
    ("INVERSE: u32 = 1u", "INVERSE: u32 = 0u"),
    ("numbers[node + n]", "numbers[thread]"),
    ("solution[place.number] = factors.step * step;", "solution[place.number] = 1.01 * factors.step * step;"),
    ("factors.old * own_number(place) +", ""),
    ("+ factors.step * step;\n        solution", ";\n        solution"),
    ("let third = factors.old * second", "let third = second"),
    ("+ change[place.number]", "- change[place.number]"),
    ("+ second) + third", "+ third)"),
    ("+ second) + third", "+ second)"),
    ("nodes[place.node] * ROW_LANES", "nodes[place.node / 2u] * ROW_LANES"),
    ("product_of(place, nodes[place.node])", "product_of(place, place.node)"),
    ("solution[whole_number(place)] +=", "solution[whole_number(place)] ="),
    ("residual[number] = right[number] - product;", "residual[number] = right[number] - 1.01 * product;"),
    (
        "next[place.number] = residual[whole_number(place)];",
        "next[place.number] = 1.01 * residual[whole_number(place)];",
    ),
    ("to[place.number] += found;", "to[place.number] = found;"),
    ("column < dense.size", "column + 64u < dense.size"),
    ("dense.lanes * (unknown / dense.unknowns)", "unknown / dense.unknowns"),
    ("half /= 2u", "half /= 4u"),
    ("NODES_OF_THREAD: u32 = 16u", "NODES_OF_THREAD: u32 = 15u"),
    ("shares[group] = sums[0]", "shares[group] = sums[1]"),
    ("x[node] += scalar.factor", "x[node] += 0.999 * scalar.factor"),
    ("residual[node] -= scalar.factor", "residual[node] -= 0.99 * scalar.factor"),
    ("z[node] + scalar.factor * old", "z[node] + 0.99 * scalar.factor * old"),
    ("z_product[node] + scalar.factor", "z_product[node] + 0.99 * scalar.factor"),
    ("x[node] = vec4f();", "x[node] = vec4f(1e-3);"),
    ("direction[node] = z[node];", "direction[node] = 1.01 * z[node];"),
    ("own.y += dot(residual[node], z[node]);", "own.y += 1.01 * dot(residual[node], z[node]);"),
];

/// Two solutions, the second one from the vectors that the first one left.
#[test]
fn every_mutation_of_the_kernels_is_detected() {
    let [_, mut problem] = Problem::all();
    let expected = problem.cycle();
    let select = |gpu: &Gpu| in_chunks(gpu, 2000);
    on_each_adapter(|gpu| {
        let gpu = select(gpu);
        let found = |change: &dyn Fn(String) -> String| {
            let device = RestGpu::with_source(&gpu, change).unwrap();
            let mut equations = problem.loaded(&device);
            let cycle = is_near(&problem.cycle_on(&device), &expected, problem.most);
            let solutions =
                [1e-2, 1e-3].map(|tolerance| solve(&mut equations, &problem.right, tolerance, 30));
            (cycle, solutions.map(|solution| solution.map(|found| (found.cycles, found.x))))
        };
        let right = found(&|source| source);
        assert!(right.0);
        let undetected: Vec<_> = MUTATIONS
            .iter()
            .filter(|(from, to)| {
                let changed = std::cell::Cell::new(false);
                let found = found(&|source| {
                    changed.set(changed.get() || source.contains(from));
                    source.replace(from, to)
                });
                assert!(changed.get(), "{from}");
                found == right
            })
            .collect();
        assert!(undetected.is_empty(), "{undetected:#?}");
    });
}

#[test]
fn a_lost_device_and_vectors_that_do_not_fit_are_errors() {
    let problem = Problem::new();
    on_each_adapter(|gpu| {
        let small = RestGpu::new(&in_chunks(gpu, usize::MAX)).unwrap();
        // 160 MB exceed the binding of the baseline, and 320 MB its buffer.
        for nodes in [10_000_000, 20_000_000] {
            let error = small.equations(nodes).err().unwrap();
            let RestError::Gpu(GpuError::Limit { what, needed, available, .. }) = &error else {
                panic!("{error}")
            };
            assert!(what.contains("rest: "), "{what}");
            assert_eq!(*needed, 16 * nodes as u64);
            assert!([128 << 20, 256 << 20].contains(available), "{available}");
        }
        let device = RestGpu::new(gpu).unwrap();
        let mut equations = problem.loaded(&device);
        gpu.lose();
        let lost = |error: RestError| matches!(error, RestError::Gpu(GpuError::Lost { .. }));
        assert!(lost(equations.begin(&problem.right, 1.0).err().unwrap()));
        assert!(lost(equations.advance(1.0).err().unwrap()));
        assert!(lost(equations.turn(1.0).err().unwrap()));
        assert!(lost(equations.end(0.5, 1.0).err().unwrap()));
        assert!(lost(equations.load(&problem.matrix, &problem.multigrid).err().unwrap().into()));
        assert!(lost(device.equations(10).err().unwrap()) && lost(RestGpu::new(gpu).err().unwrap()));
    });
}
