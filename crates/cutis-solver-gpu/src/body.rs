//! The state of the vertices on the device, and the passes over them.

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel, Pass};
use cutis_shaders::solver;
use cutis_solver::{Formulation, Simulation, Step, System};
use nalgebra::Vector3;

/// A binding must start at a multiple of 256 bytes, which is 16 elements of 16 bytes.
const ALIGNMENT: usize = 16;

/// Value of the status while all vertices are finite.
const NONE: u32 = u32::MAX;

/// The state of a body on the device, with the kernels of the passes over vertices.
pub(crate) struct DeviceBody {
    /// Positions and inverse masses.
    pub(crate) vertices: Buffer<[f32; 4]>,
    /// Positions at the start of the substep.
    pub(crate) previous: Buffer<[f32; 4]>,
    pub(crate) velocities: Buffer<[f32; 4]>,
    /// Constant forces in N, if the body has any.
    pub(crate) loads: Option<Buffer<[f32; 4]>>,
    pub(crate) settings: Buffer<[f32; 8]>,
    /// Three numbers: the first vertex that is not finite, the number of finite substeps, and 1
    /// once a substep has started after one that was not finite.
    pub(crate) status: Buffer<u32>,
    pub(crate) predict: VertexKernel,
    /// Prediction after `finish`. Only for vertex block descent, which reads the velocities from
    /// memory.
    pub(crate) predict_next: Option<VertexKernel>,
    pub(crate) finish_and_predict: VertexKernel,
    pub(crate) finish: VertexKernel,
    pub(crate) check: VertexKernel,
    pub(crate) restore: VertexKernel,
}

/// Result of the substeps since the status was cleared.
pub(crate) struct Status {
    /// The first vertex that is not finite.
    pub(crate) vertex: Option<usize>,
    /// Number of substeps with a finite result.
    pub(crate) substeps: u32,
}

/// One kernel over all vertices, split into parts that fit a binding and a dispatch.
pub(crate) struct VertexKernel {
    kernel: Kernel,
    parts: Vec<(BindGroup, usize)>,
}

impl VertexKernel {
    /// Returns the number of dispatches of one run.
    pub(crate) fn dispatches(&self) -> usize {
        self.parts.len()
    }

    pub(crate) fn run(&self, pass: &mut Pass<'_>) {
        for (group, threads) in &self.parts {
            pass.dispatch(&self.kernel, &[group], *threads);
        }
    }
}

impl DeviceBody {
    pub(crate) fn new(gpu: &Gpu, simulation: &Simulation<f32>) -> Result<Self, GpuError> {
        let system = simulation.system();
        let count = system.vertices().len();
        let vertices = gpu.buffer::<[f32; 4]>("vertices", bytemuck::cast_slice(system.vertices()))?;
        let previous = gpu.zeroed::<[f32; 4]>("previous positions", count)?;
        let velocities = gpu.buffer("velocities", &padded(system.velocities()))?;
        let loads = match system.loads() {
            [] => None,
            loads => Some(gpu.buffer("loads", &padded(loads))?),
        };
        let settings = gpu.uniform("settings of a substep", &settings_of(simulation))?;
        let status = gpu.buffer("status", &[NONE, 0, 0])?;

        let part = (gpu.chunk_len(size_of::<[f32; 4]>()) / ALIGNMENT).max(1) * ALIGNMENT;
        let mut parts = Vec::new();
        for start in (0..count).step_by(part) {
            let first = gpu.uniform("first vertex of a part", &u32::try_from(start).unwrap_or(u32::MAX))?;
            parts.push((start..count.min(start + part), first));
        }
        let source = solver::vertices(loads_of(system));
        // Each entry point binds only what it uses.
        let pass = |entry: &str, used: &[u32]| -> Result<VertexKernel, GpuError> {
            let kernel = gpu.kernel(&format!("vertices: {entry}"), &source, entry)?;
            let mut groups = Vec::with_capacity(parts.len());
            for (range, first) in &parts {
                let binding = |&n: &u32| match n {
                    0 => (n, vertices.range(range.clone())),
                    1 => (n, previous.range(range.clone())),
                    2 => (n, velocities.range(range.clone())),
                    3 => (n, settings.whole()),
                    4 => (n, first.whole()),
                    _ => (n, status.whole()),
                };
                let mut bindings: Vec<_> = used.iter().map(binding).collect();
                if let Some(loads) = loads.as_ref().filter(|_| entry.contains("predict")) {
                    bindings.push((6, loads.range(range.clone())));
                }
                groups.push((gpu.bind(&kernel, 0, &bindings)?, range.len()));
            }
            Ok(VertexKernel { kernel, parts: groups })
        };
        let descends = simulation.settings().formulation == Formulation::Vbd;
        Ok(Self {
            predict: pass("predict", &[0, 1, 2, 3])?,
            predict_next: descends.then(|| pass("predict_next", &[0, 1, 2, 3, 5])).transpose()?,
            finish_and_predict: pass("finish_and_predict", &[0, 1, 3, 4, 5])?,
            finish: pass("finish", &[0, 1, 2, 3, 4, 5])?,
            check: pass("check", &[0, 4, 5])?,
            restore: pass("restore", &[0, 1, 2])?,
            vertices,
            previous,
            velocities,
            loads,
            settings,
            status,
        })
    }

    /// Predicts positions. If another substep came before, updates the velocities first.
    pub(crate) fn begin_substep(&self, pass: &mut Pass<'_>, after_another: bool) {
        match (after_another, &self.predict_next) {
            (false, _) => self.predict.run(pass),
            (true, None) => self.finish_and_predict.run(pass),
            (true, Some(predict_next)) => {
                self.finish.run(pass);
                predict_next.run(pass);
            }
        }
    }

    /// Uploads the host's positions, masses, velocities and loads.
    pub(crate) fn upload(&self, gpu: &Gpu, simulation: &Simulation<f32>) -> Result<(), GpuError> {
        let system = simulation.system();
        gpu.write(&self.vertices, 0, bytemuck::cast_slice(system.vertices()))?;
        if let Some(loads) = &self.loads {
            gpu.write(loads, 0, &padded(system.loads()))?;
        }
        gpu.write(&self.velocities, 0, &padded(system.velocities()))
    }

    /// Resets the status.
    pub(crate) fn clear_status(&self, gpu: &Gpu) -> Result<(), GpuError> {
        gpu.write(&self.status, 0, &[NONE, 0, 0])
    }

    /// Waits for the submitted work and reads the status, twelve bytes.
    pub(crate) fn status(&self, gpu: &Gpu) -> Result<Status, GpuError> {
        let words = gpu.read(&self.status, 0..3)?;
        Ok(Status { vertex: (words[0] != NONE).then_some(words[0] as usize), substeps: words[1] })
    }
}

/// Returns the struct `Settings` of the shaders.
fn settings_of(simulation: &Simulation<f32>) -> [f32; 8] {
    let numbers = simulation.integrator();
    let inverse_h_squared = match simulation.projection_step() {
        Some(Step::Xpbd { inverse_h_squared }) => inverse_h_squared,
        Some(Step::Pbd) | None => 0.0,
    };
    let g = numbers.gravity_h;
    [g.x, g.y, g.z, numbers.h, numbers.velocity_factor, inverse_h_squared, numbers.load_h, 0.0]
}

/// Returns whether the shaders of `system` read loads.
pub(crate) fn loads_of(system: &System<f32>) -> solver::Loads {
    if system.loads().is_empty() { solver::Loads::None } else { solver::Loads::Each }
}

fn padded(vectors: &[Vector3<f32>]) -> Vec<[f32; 4]> {
    vectors.iter().map(|v| [v.x, v.y, v.z, 0.0]).collect()
}
