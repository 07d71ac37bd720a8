//! The kernels, and the walk over the tets of a slab, which two of them share.

use cutis_gpu::{BindGroup, Binding, Buffer, Gpu, GpuError, Kernel, Pass, WORKGROUP};
use cutis_shaders::resample as shaders;

/// Most workgroups that work through a list of large tets.
const GROUPS_FOR_LARGE: usize = 256;

/// Every kernel of the resampler.
pub struct Kernels {
    pub place: Kernel,
    pub span: Kernel,
    pub span_removed: Kernel,
    pub clear: Kernel,
    pub claim: Walk,
    pub vacate: Walk,
    pub gather: Kernel,
}

impl Kernels {
    /// Every source passes through `change`.
    pub fn new(gpu: &Gpu, change: &dyn Fn(String) -> String) -> Result<Self, GpuError> {
        let kernel = |label, source, entry| gpu.kernel(label, &change(source), entry);
        Ok(Self {
            place: kernel("resample: place", shaders::place(), shaders::PLACE)?,
            span: kernel("resample: span", shaders::span(), shaders::SPAN)?,
            span_removed: kernel("resample: removed", shaders::span(), shaders::SPAN_REMOVED)?,
            clear: kernel("resample: clear", shaders::clear(), shaders::CLEAR)?,
            claim: Walk::new(gpu, "resample: claim", &change(shaders::claim()))?,
            vacate: Walk::new(gpu, "resample: vacate", &change(shaders::vacate()))?,
            gather: kernel("resample: gather", shaders::gather(), shaders::GATHER)?,
        })
    }
}

/// A walk over the voxels of tets: small ones by a thread each, then the large ones by a workgroup each.
pub struct Walk {
    all: Kernel,
    large: Kernel,
}

/// Bind groups of both kernels of a walk.
pub struct WalkGroups {
    all: BindGroup,
    large: BindGroup,
}

impl Walk {
    fn new(gpu: &Gpu, label: &str, source: &str) -> Result<Self, GpuError> {
        Ok(Self {
            all: gpu.kernel(label, source, shaders::WALK_ALL)?,
            large: gpu.kernel(&format!("{label}, large tets"), source, shaders::WALK_LARGE)?,
        })
    }

    /// Group 0, what belongs to the slab: `bindings` without the reaches, which large tets have behind them.
    pub fn slab<'a>(
        &self,
        gpu: &Gpu,
        bindings: &[(u32, Binding<'a>)],
        reaches: Binding<'a>,
    ) -> Result<WalkGroups, GpuError> {
        let with_reaches = [bindings, &[(5, reaches)]].concat();
        Ok(WalkGroups {
            all: gpu.bind(&self.all, 0, &with_reaches)?,
            large: gpu.bind(&self.large, 0, bindings)?,
        })
    }

    /// Group 1, the tets: `bindings` without the spans, which large tets have behind them.
    pub fn tets(
        &self,
        gpu: &Gpu,
        bindings: &[(u32, Binding<'_>)],
        spans: &Buffer<[u32; 2]>,
    ) -> Result<WalkGroups, GpuError> {
        let with_spans = [bindings, &[(2, spans.whole())]].concat();
        Ok(WalkGroups {
            all: gpu.bind(&self.all, 1, &with_spans)?,
            large: gpu.bind(&self.large, 1, bindings)?,
        })
    }

    /// Walks `tets` tets in `threads` threads; at most `listed` of them can be on the list of the large ones.
    pub fn dispatch(
        &self,
        pass: &mut Pass<'_>,
        slab: &WalkGroups,
        tets: &WalkGroups,
        threads: usize,
        listed: usize,
    ) {
        pass.dispatch(&self.all, &[&slab.all, &tets.all], threads);
        // A full list is rare: two tets for each workgroup then.
        let groups = listed.min(threads).div_ceil(2).min(GROUPS_FOR_LARGE);
        pass.dispatch(&self.large, &[&slab.large, &tets.large], WORKGROUP * groups);
    }
}
