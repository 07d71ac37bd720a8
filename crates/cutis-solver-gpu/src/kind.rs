//! One kind of constraint on the device: chunks of its colors, and the kernels that project them.

use std::ops::Range;

use cutis_gpu::{BindGroup, Binding, Buffer, Gpu, GpuError, Kernel, Pass};
use cutis_shaders::solver::{self, Multiplier, Rule};
use cutis_solver::{ConstraintSet, Formulation, Settings, Sweep, Values};

use crate::body::DeviceBody;

/// A part of a color that fits one binding and one dispatch, with its buffers.
pub(crate) struct ConstraintChunk {
    /// Indices of the constraints in the order of the colors.
    pub(crate) range: Range<usize>,
    pub(crate) tuples: Buffer<u32>,
    pub(crate) params: Buffer<f32>,
    stiffness: Option<Buffer<f32>>,
    multipliers: Option<Buffer<f32>>,
    /// One group per variant of the kernel.
    groups: Vec<BindGroup>,
}

/// A kernel for one treatment of multipliers, with the group that all chunks share.
struct Variant {
    kernel: Kernel,
    shared: BindGroup,
}

/// A kind of constraint on the device.
pub(crate) struct DeviceKind {
    /// The chunks of each color.
    pub(crate) colors: Vec<Vec<ConstraintChunk>>,
    /// One variant for the first iteration, and one for later iterations if they differ.
    variants: Vec<Variant>,
}

impl DeviceKind {
    pub(crate) fn new(
        gpu: &Gpu,
        body: &DeviceBody,
        set: &dyn ConstraintSet<f32>,
        settings: &Settings,
    ) -> Result<Self, GpuError> {
        let (name, arity) = (set.name(), set.arity());
        let rule = match settings.formulation {
            Formulation::Pbd => Rule::Pbd,
            Formulation::Xpbd | Formulation::Vbd => Rule::Xpbd,
        };
        let (stiffness, uniform) = match set.stiffness().values() {
            Values::Uniform(value) => (solver::Stiffness::Uniform, Some(gpu.uniform("stiffness", value)?)),
            Values::Each(_) => (solver::Stiffness::Each, None),
        };
        let multipliers: &[Multiplier] = match settings.keeps_multipliers() {
            true => &[Multiplier::First, Multiplier::Next],
            false => &[Multiplier::None],
        };
        let mut variants = Vec::with_capacity(multipliers.len());
        for &multiplier in multipliers {
            let source = solver::project(arity, set.wgsl(), rule, stiffness, multiplier);
            let kernel = gpu.kernel(&format!("{name}: project"), &source, solver::PROJECT)?;
            let mut bindings = vec![(0, body.vertices.whole())];
            if rule == Rule::Xpbd {
                bindings.push((1, body.settings.whole()));
            }
            let shared = gpu.bind(&kernel, 0, &bindings)?;
            variants.push(Variant { kernel, shared });
        }

        let most = gpu.chunk_len(size_of::<u32>() * arity.max(set.param_count()));
        let mut colors = Vec::with_capacity(set.colors());
        for color in 0..set.colors() {
            let Range { start, end } = set.range(color);
            let mut chunks = Vec::new();
            for first in (start..end).step_by(most) {
                let range = first..end.min(first + most);
                let chunk = ConstraintChunk::new(gpu, set, range, settings.keeps_multipliers())?;
                chunks.push(chunk.bound(gpu, &variants, uniform.as_ref())?);
            }
            colors.push(chunks);
        }
        Ok(Self { colors, variants })
    }

    /// Encodes the projection of a color.
    pub(crate) fn project(&self, pass: &mut Pass<'_>, sweep: &Sweep, iteration: u32) {
        let variant = if iteration == 0 { 0 } else { self.variants.len() - 1 };
        let Variant { kernel, shared } = &self.variants[variant];
        for chunk in &self.colors[sweep.color] {
            pass.dispatch(kernel, &[shared, &chunk.groups[variant]], chunk.range.len());
        }
    }
}

impl ConstraintChunk {
    fn new(
        gpu: &Gpu,
        set: &dyn ConstraintSet<f32>,
        range: Range<usize>,
        keeps_multipliers: bool,
    ) -> Result<Self, GpuError> {
        let (name, len) = (set.name(), range.len());
        let part = |stride: usize| range.start * stride..range.end * stride;
        let tuples = gpu.buffer(&format!("{name}: vertices"), &set.indices()[part(set.arity())])?;
        let params = gpu.buffer(&format!("{name}: parameters"), &set.params()[part(set.param_count())])?;
        let stiffness = match set.stiffness().values() {
            Values::Uniform(_) => None,
            Values::Each(values) => Some(gpu.buffer(&format!("{name}: stiffness"), &values[range.clone()])?),
        };
        let multipliers = match keeps_multipliers {
            true => Some(gpu.zeroed(&format!("{name}: multipliers"), len)?),
            false => None,
        };
        Ok(Self { range, tuples, params, stiffness, multipliers, groups: Vec::new() })
    }

    /// Binds the chunk to each variant of the kernel.
    fn bound(
        mut self,
        gpu: &Gpu,
        variants: &[Variant],
        uniform: Option<&Buffer<f32>>,
    ) -> Result<Self, GpuError> {
        let stiffness = self.stiffness.as_ref().or(uniform);
        let bindings: Vec<(u32, Binding<'_>)> = [Some(&self.params), stiffness, self.multipliers.as_ref()]
            .into_iter()
            .zip(1..)
            .filter_map(|(buffer, n)| Some((n, buffer?.whole())))
            .chain([(0, self.tuples.whole())])
            .collect();
        for variant in variants {
            self.groups.push(gpu.bind(&variant.kernel, 1, &bindings)?);
        }
        Ok(self)
    }
}
