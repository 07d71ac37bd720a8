//! Compute kernels and their bind groups.

use std::{borrow::Cow, fmt, ops::Range, sync::Arc};

use crate::{
    Gpu, GpuError, WORKGROUP,
    counters::{Memory, add},
    device::Fault,
};

/// The range of a binding must start at a multiple of this number of bytes (WebGPU's baseline).
const BINDING_ALIGNMENT: u64 = 256;

/// A compiled compute kernel. Its bindings are exactly those that the entry point uses in the
/// source.
pub struct Kernel {
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) label: String,
}

/// The resources of one `@group` of one kernel. It keeps them alive and works with no other kernel.
pub struct BindGroup {
    pub(crate) raw: wgpu::BindGroup,
    pub(crate) group: u32,
    /// Memory that counts as existing as long as the group exists.
    _memory: Vec<Arc<Memory>>,
}

/// A resource to bind, from [`Buffer::whole`](crate::Buffer::whole),
/// [`Buffer::range`](crate::Buffer::range) or [`Texture3d::whole`](crate::Texture3d::whole).
#[derive(Clone, Debug)]
pub struct Binding<'a>(Resource<'a>);

#[derive(Clone, Debug)]
enum Resource<'a> {
    Buffer { raw: &'a wgpu::Buffer, memory: &'a Arc<Memory>, label: &'a str, bytes: Range<u64> },
    Outside { label: &'a str, range: Range<usize>, len: usize },
    Texture { view: &'a wgpu::TextureView, memory: &'a Arc<Memory> },
}

impl Gpu {
    /// Compiles the entry point `entry` of a WGSL source. This takes milliseconds to tenths of a
    /// second. There is no cache, so compile each kernel once.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::Shader`] with the compiler's message if the source is invalid, has no
    /// such entry point, or the entry point is not `@compute @workgroup_size(64)`. Returns
    /// [`GpuError::Lost`] if the device was lost.
    pub fn kernel(&self, label: &str, wgsl: &str, entry: &str) -> Result<Kernel, GpuError> {
        self.alive()?;
        let shader_error = |message: String| GpuError::Shader { label: label.to_owned(), message };
        check_entry(wgsl, entry).map_err(shader_error)?;
        let explain = |fault| match fault {
            Fault::Invalid(message) => shader_error(message),
            Fault::Memory => fault.of(format!("kernel '{label}'"), wgsl.len() as u64),
        };
        let device = &self.shared.device;
        let source = wgpu::ShaderSource::Wgsl(Cow::Borrowed(wgsl));
        let module = self.checked(explain, || {
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
        })?;
        let descriptor = wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: None,
            module: &module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            cache: None,
        };
        let pipeline = self.checked(explain, || device.create_compute_pipeline(&descriptor))?;
        add(&self.shared.tally.kernels, 1);
        Ok(Kernel { pipeline, label: label.to_owned() })
    }

    /// Binds resources to `@group(group)` of a kernel, each with its `@binding`. The bindings must
    /// be exactly those of this group that the kernel's entry point uses.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::Validation`] if the bindings are not those of the kernel,
    /// [`GpuError::Range`] if a range exceeds its buffer or is empty, [`GpuError::Alignment`] if it
    /// does not start at a multiple of 256 bytes, [`GpuError::Limit`] if it exceeds the largest
    /// binding, and [`GpuError::Lost`].
    pub fn bind(
        &self,
        kernel: &Kernel,
        group: u32,
        bindings: &[(u32, Binding<'_>)],
    ) -> Result<BindGroup, GpuError> {
        self.alive()?;
        let what = || format!("group {group} of kernel '{}'", kernel.label);
        let entries = bindings
            .iter()
            .map(|(binding, Binding(resource))| {
                let resource = self.resource(resource, &what)?;
                Ok(wgpu::BindGroupEntry { binding: *binding, resource })
            })
            .collect::<Result<Vec<_>, GpuError>>()?;
        let raw = self.checked(
            |fault| fault.of(what(), 0),
            || {
                let layout = kernel.pipeline.get_bind_group_layout(group);
                self.shared.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some(&kernel.label),
                    layout: &layout,
                    entries: &entries,
                })
            },
        )?;
        let memory = bindings.iter().filter_map(|(_, Binding(resource))| resource.memory());
        Ok(BindGroup { raw, group, _memory: memory.cloned().collect() })
    }

    fn resource<'a>(
        &self,
        resource: &Resource<'a>,
        what: &impl Fn() -> String,
    ) -> Result<wgpu::BindingResource<'a>, GpuError> {
        match resource {
            Resource::Texture { view, .. } => Ok(wgpu::BindingResource::TextureView(view)),
            Resource::Outside { label, range, len } => Err(GpuError::Range {
                what: format!("{}, buffer '{label}'", what()),
                start: range.start,
                end: range.end,
                len: *len,
            }),
            Resource::Buffer { raw, label, bytes, .. } => {
                let what = || format!("{}, buffer '{label}'", what());
                if !bytes.start.is_multiple_of(BINDING_ALIGNMENT) {
                    return Err(GpuError::Alignment {
                        what: what(),
                        offset: bytes.start,
                        multiple: BINDING_ALIGNMENT,
                    });
                }
                let size = bytes.end - bytes.start;
                let most = self.limits().max_binding_bytes;
                if size > most {
                    return Err(self.over_limit(format!("bytes bound to {}", what()), size, most));
                }
                Ok(wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer: raw,
                    offset: bytes.start,
                    size: wgpu::BufferSize::new(size),
                }))
            }
        }
    }
}

impl Resource<'_> {
    fn memory(&self) -> Option<&Arc<Memory>> {
        match self {
            Resource::Buffer { memory, .. } | Resource::Texture { memory, .. } => Some(memory),
            Resource::Outside { .. } => None,
        }
    }
}

impl<'a> Binding<'a> {
    pub(crate) fn buffer(
        raw: &'a wgpu::Buffer,
        memory: &'a Arc<Memory>,
        label: &'a str,
        bytes: Range<u64>,
    ) -> Binding<'a> {
        Binding(Resource::Buffer { raw, memory, label, bytes })
    }

    pub(crate) fn outside(label: &'a str, range: Range<usize>, len: usize) -> Binding<'a> {
        Binding(Resource::Outside { label, range, len })
    }

    pub(crate) fn texture(view: &'a wgpu::TextureView, memory: &'a Arc<Memory>) -> Binding<'a> {
        Binding(Resource::Texture { view, memory })
    }
}

impl fmt::Debug for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Kernel").field("label", &self.label).finish_non_exhaustive()
    }
}

impl fmt::Debug for BindGroup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BindGroup").field("group", &self.group).finish_non_exhaustive()
    }
}

/// Parses the source and checks the entry point. A kernel with another workgroup size would run
/// with a wrong number of threads.
fn check_entry(wgsl: &str, entry: &str) -> Result<(), String> {
    let module =
        naga::front::wgsl::parse_str(wgsl).map_err(|error| error.emit_to_string(wgsl).trim().to_owned())?;
    let named = |point: &&naga::EntryPoint| point.name == entry;
    let Some(point) = module.entry_points.iter().find(named) else {
        let names: Vec<_> = module.entry_points.iter().map(|point| point.name.as_str()).collect();
        return Err(format!("no entry point '{entry}'; expected one of: {}", names.join(", ")));
    };
    if point.stage != naga::ShaderStage::Compute || point.workgroup_size != [WORKGROUP as u32, 1, 1] {
        let [x, y, z] = point.workgroup_size;
        return Err(format!(
            "entry point '{entry}' has a workgroup of {x} x {y} x {z} threads; \
             it must be @compute @workgroup_size({WORKGROUP})"
        ));
    }
    Ok(())
}
