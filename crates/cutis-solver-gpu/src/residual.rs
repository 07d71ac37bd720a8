//! Residuals by reduction on the device. The host reads two numbers per workgroup.

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel, WORKGROUP};
use cutis_shaders::solver;
use cutis_solver::{ConstraintSet, Residual};

use crate::body::DeviceBody;
use crate::kind::DeviceKind;

/// The reduction of one kind, built on its first use.
pub(crate) struct Reduction {
    name: &'static str,
    kernel: Kernel,
    shared: BindGroup,
    chunks: Vec<(BindGroup, usize, Buffer<[f32; 2]>)>,
    /// Number of constraints with a rest size.
    count: usize,
}

impl Reduction {
    pub(crate) fn new(
        gpu: &Gpu,
        body: &DeviceBody,
        kind: &DeviceKind,
        set: &dyn ConstraintSet<f32>,
    ) -> Result<Self, GpuError> {
        let source = solver::residual(set.arity(), set.wgsl());
        let kernel = gpu.kernel(&format!("{}: residual", set.name()), &source, solver::RESIDUAL)?;
        let shared = gpu.bind(&kernel, 0, &[(0, body.vertices.whole())])?;
        let mut chunks = Vec::new();
        let mut count = 0;
        for chunk in kind.colors.iter().flatten() {
            let inverse = |k: usize| match set.rest_size(k) {
                0.0 => 0.0,
                size => 1.0 / size,
            };
            let inverses: Vec<f32> = chunk.range.clone().map(inverse).collect();
            count += inverses.iter().filter(|&&inverse| inverse != 0.0).count();
            let inverses = gpu.buffer("inverse rest sizes", &inverses)?;
            let partial = gpu.zeroed("partial residuals", chunk.range.len().div_ceil(WORKGROUP))?;
            let bindings = [
                (0, chunk.tuples.whole()),
                (1, chunk.params.whole()),
                (2, inverses.whole()),
                (3, partial.whole()),
            ];
            chunks.push((gpu.bind(&kernel, 1, &bindings)?, chunk.range.len(), partial));
        }
        Ok(Self { name: set.name(), kernel, shared, chunks, count })
    }

    /// Returns `C` over the rest size at the present state. Ratios and sums over 64 ratios are
    /// `f32`. The sums over workgroups are `f64`.
    pub(crate) fn run(&self, gpu: &Gpu) -> Result<Residual, GpuError> {
        let mut pass = gpu.pass("residual");
        for (group, threads, _) in &self.chunks {
            pass.dispatch(&self.kernel, &[&self.shared, group], *threads);
        }
        pass.submit()?;
        let (mut square, mut max) = (0.0f64, 0.0f64);
        for (_, _, partial) in &self.chunks {
            for [sum, largest] in gpu.read(partial, 0..partial.len())? {
                square += f64::from(sum);
                max = max.max(f64::from(largest));
            }
        }
        let rms = (square / self.count.max(1) as f64).sqrt();
        Ok(Residual { name: self.name, rms, max })
    }
}
