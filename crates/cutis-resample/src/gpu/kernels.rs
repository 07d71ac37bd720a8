//! The kernels, and the visit of a slab's tets that two of them share.

use cutis_gpu::{BindGroup, Binding, Buffer, Gpu, GpuError, Kernel, Pass, WORKGROUP};
use cutis_shaders::resample as shaders;

/// Largest number of workgroups for a list of large tets.
const GROUPS_FOR_LARGE: usize = 256;

/// All kernels of the resampler.
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
    /// Compiles the kernels. Every source passes through `change`.
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

/// Two kernels that visit the voxels of tets: one thread for each small tet, one workgroup for each
/// large one.
pub struct Walk {
    all: Kernel,
    large: Kernel,
}

/// Bind groups of both kernels.
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

    /// Binds group 0, the slab. Only the kernel for all tets needs the reaches.
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

    /// Binds group 1, the tets. Only the kernel for all tets needs the spans.
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

    /// Visits tets with `threads` threads. At most `listed` of them are on the list of large tets.
    pub fn dispatch(
        &self,
        pass: &mut Pass<'_>,
        slab: &WalkGroups,
        tets: &WalkGroups,
        threads: usize,
        listed: usize,
    ) {
        pass.dispatch(&self.all, &[&slab.all, &tets.all], threads);
        // A full list is rare; each workgroup then processes two tets.
        let groups = listed.min(threads).div_ceil(2).min(GROUPS_FOR_LARGE);
        pass.dispatch(&self.large, &[&slab.large, &tets.large], WORKGROUP * groups);
    }
}
