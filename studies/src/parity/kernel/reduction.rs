//! Residuals: the reduction of a workgroup against the same tree in scalar `f32`.

use anyhow::bail;
use cutis_conformance::Alteration;
use cutis_constraints::{Constraint, Distance, Params, SkinTension, SkinTensionPaper, Volume};
use cutis_gpu::{Gpu, WORKGROUP};
use cutis_shaders::solver::{self, RESIDUAL};
use cutis_solver::{ConstraintSet, Formulation, System};

use super::replaced;
use crate::parity::bench::{Bench, Failure};
use crate::parity::bodies::{ConstraintKind, Plan, STEP};
use crate::parity::comparison::Ring;
use crate::parity::difference::Difference;

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let system = Plan {
        size: [9, 8, 7],
        formulation: Formulation::Pbd,
        kinds: &ConstraintKind::ALL,
        each: false,
        fixed: true,
        handles: false,
        softness: 1.0,
    }
    .system()?;
    let [distance, volume, skin, paper] = system.kinds() else {
        bail!("a body with all kinds does not have four");
    };
    compare::<Distance, 2>(bench, &system, &**distance)?;
    compare::<Volume, 4>(bench, &system, &**volume)?;
    compare::<SkinTension, 3>(bench, &system, &**skin)?;
    compare::<SkinTensionPaper, 3>(bench, &system, &**paper)
}

fn compare<C: Constraint<N>, const N: usize>(
    bench: &mut Bench<'_, '_>,
    system: &System<f32>,
    set: &dyn ConstraintSet<f32>,
) -> Result<(), Failure> {
    let name = format!("residual of {}: sums and largest of workgroups", set.name());
    let moved: Vec<[f32; 4]> = system
        .vertices()
        .iter()
        .enumerate()
        .map(|(n, vertex)| {
            let (p, phase) = (vertex.position(), n as f32);
            let push = 0.1 * STEP as f32;
            [p.x + push * phase.sin(), p.y + push * phase.cos(), p.z, vertex.inverse_mass()]
        })
        .collect();
    let expected = |most: usize| -> Vec<f32> {
        let chunks = (0..set.len()).step_by(most).map(|first| first..set.len().min(first + most));
        chunks.flat_map(|chunk| twin::<C, N>(&moved, set, chunk)).collect()
    };
    let measure = |gpu: &Gpu, policy, source: &str| {
        let most = gpu.chunk_len(size_of::<f32>() * set.arity().max(set.param_count()));
        let (found, expected) = (on_gpu(gpu, source, &moved, set, most)?, expected(most));
        let largest = expected.iter().fold(0.0, |most: f32, &x| most.max(x));
        Ok(Difference::default().add(found, expected, largest.into()).judged(policy))
    };
    let source = |constraint: &str| solver::residual(N, constraint);
    bench.compare(Ring::Kernel, &name, |gpu, policy| measure(gpu, policy, &source(C::WGSL)))?;
    bench.control(Ring::Kernel, &name, "value × 1.001", |gpu, policy| {
        measure(gpu, policy, &source(&Alteration::Value.wgsl(C::WGSL)))
    })?;
    for (what, from, to) in
        [("half of a workgroup", "half = 32u", "half = 16u"), ("not squared", "ratio * ratio", "ratio")]
    {
        bench.control(Ring::Kernel, &name, what, |gpu, policy| {
            measure(gpu, policy, &replaced(&source(C::WGSL), from, to)?)
        })?;
    }
    Ok(())
}

/// Sum of squares and largest value over rest size of each workgroup.
fn twin<C: Constraint<N>, const N: usize>(
    vertices: &[[f32; 4]],
    set: &dyn ConstraintSet<f32>,
    chunk: std::ops::Range<usize>,
) -> Vec<f32> {
    let ratio = |k: usize| -> f32 {
        let x = std::array::from_fn(|i| {
            let [x, y, z, _] = vertices[set.indices()[k * N + i] as usize];
            nalgebra::Point3::new(x, y, z)
        });
        let stride = set.param_count();
        let params: C::Params<f32> = Params::from_fn(|i| set.params()[k * stride + i]);
        (C::eval(&x, &params).c * inverse_rest_size(set, k)).abs()
    };
    let ratios: Vec<f32> = chunk.map(ratio).collect();
    let mut found = Vec::new();
    for group in ratios.chunks(WORKGROUP) {
        let mut sums = [[0.0f32; 2]; WORKGROUP];
        for (sum, &ratio) in sums.iter_mut().zip(group) {
            *sum = [ratio * ratio, ratio];
        }
        let mut half = WORKGROUP / 2;
        while half > 0 {
            for local in 0..half {
                let [square, largest] = sums[local + half];
                sums[local] = [sums[local][0] + square, sums[local][1].max(largest)];
            }
            half /= 2;
        }
        found.extend(sums[0]);
    }
    found
}

fn inverse_rest_size(set: &dyn ConstraintSet<f32>, k: usize) -> f32 {
    match set.rest_size(k) {
        0.0 => 0.0,
        size => 1.0 / size,
    }
}

fn on_gpu(
    gpu: &Gpu,
    source: &str,
    vertices: &[[f32; 4]],
    set: &dyn ConstraintSet<f32>,
    most: usize,
) -> Result<Vec<f32>, Failure> {
    let kernel = gpu.kernel("residual", source, RESIDUAL)?;
    let vertices = gpu.buffer("vertices", vertices)?;
    let shared = gpu.bind(&kernel, 0, &[(0, vertices.whole())])?;
    let mut found = Vec::new();
    for first in (0..set.len()).step_by(most) {
        let chunk = first..set.len().min(first + most);
        let part = |stride: usize| chunk.start * stride..chunk.end * stride;
        let inverses: Vec<f32> = chunk.clone().map(|k| inverse_rest_size(set, k)).collect();
        let tuples = gpu.buffer("tuples", &set.indices()[part(set.arity())])?;
        let params = gpu.buffer("params", &set.params()[part(set.param_count())])?;
        let inverses = gpu.buffer("inverse rest sizes", &inverses)?;
        let partial = gpu.zeroed::<[f32; 2]>("partial", chunk.len().div_ceil(WORKGROUP))?;
        let bindings =
            [(0, tuples.whole()), (1, params.whole()), (2, inverses.whole()), (3, partial.whole())];
        let group = gpu.bind(&kernel, 1, &bindings)?;
        let mut pass = gpu.pass("residual");
        pass.dispatch(&kernel, &[&shared, &group], chunk.len());
        pass.submit()?;
        found.extend(gpu.read(&partial, 0..partial.len())?.into_flattened());
    }
    Ok(found)
}
