//! Vertex block descent on the device: slabs of the body, and chunks of vertices that move in
//! parallel.
//!
//! All vertices of a constraint read it, and these vertices have different colors. Constraints are
//! therefore stored by **slab** and not by color. A slab is a range of vertices whose constraints
//! fit one binding per array. All colors of a slab share its arrays. A body that fits the device's
//! bindings is one slab, and each of its constraints is stored once.

use std::ops::Range;

use cutis_coloring::Incidence;
use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel, Pass};
use cutis_shaders::solver;
use cutis_solver::{ColorPass, ConstraintSet, Descent, DescentStep, Kind, Simulation};

use crate::body::{DeviceBody, loads_of};

/// The struct `VertexForce` of the shaders: force, diagonal and mixed entries, four numbers each.
pub(crate) type PackedVertexForce = [f32; 12];
/// The struct `VertexEntries` of the shaders: the position of a vertex in its chunk, and the start
/// and end of its entries.
pub(crate) type VertexEntries = [u32; 3];

/// Kernels and buffers of the color passes.
pub(crate) struct DescentKernels {
    descend: Kernel,
    /// For each kind, the kernel of its forces and the group that all chunks share.
    forces: Vec<(Kernel, BindGroup)>,
    state: BindGroup,
    /// Chunks of each color.
    colors: Vec<Vec<VertexChunk>>,
}

/// Vertices of one color and one slab.
struct VertexChunk {
    vertices: BindGroup,
    len: usize,
    /// For each kind that acts on these vertices: its index, its bind group and the number of
    /// vertices.
    kinds: Vec<(usize, BindGroup, usize)>,
}

/// The constraints of one kind at the vertices of a slab.
struct SlabConstraints {
    /// Indices of the constraints, ascending.
    constraints: Vec<u32>,
    tuples: Buffer<u32>,
    params: Buffer<f32>,
    /// Inverse compliance and rest size.
    shape: Buffer<[f32; 2]>,
}

impl DescentKernels {
    pub(crate) fn new(
        gpu: &Gpu,
        body: &DeviceBody,
        simulation: &Simulation<f32>,
        descent: &Descent<f32>,
    ) -> Result<Self, GpuError> {
        let kinds = simulation.system().kinds();
        let source = solver::descend(loads_of(simulation.system()));
        let descend = gpu.kernel("vertices: descend", &source, solver::DESCEND)?;
        let most = gpu.chunk_len(size_of::<PackedVertexForce>());
        let groups = descent.groups();
        let largest = groups.iter().map(<[u32]>::len).max().unwrap_or(0).min(most);
        let scratch = gpu.zeroed::<PackedVertexForce>("vertex forces", largest)?;
        let settings = gpu.uniform("settings of a descent", &settings_of(descent.step()))?;
        let mut bindings = vec![
            (0, body.vertices.whole()),
            (1, scratch.whole()),
            (2, body.previous.whole()),
            (3, body.velocities.whole()),
            (4, settings.whole()),
        ];
        bindings.extend(body.loads.as_ref().map(|loads| (6, loads.whole())));
        let state = gpu.bind(&descend, 0, &bindings)?;
        let mut forces = Vec::with_capacity(kinds.len());
        for set in kinds {
            let source = solver::vertex_force(set.arity(), set.wgsl());
            let kernel =
                gpu.kernel(&format!("{}: vertex force", set.name()), &source, solver::VERTEX_FORCE)?;
            let shared = gpu.bind(&kernel, 0, &[(0, body.vertices.whole()), (1, scratch.whole())])?;
            forces.push((kernel, shared));
        }
        let mut kernels =
            Self { descend, forces, state, colors: groups.iter().map(|_| Vec::new()).collect() };
        for slab in slabs(gpu, kinds, descent) {
            kernels.add_slab(gpu, kinds, descent, slab, most)?;
        }
        Ok(kernels)
    }

    /// Adds the constraints of a slab and the chunks of its vertices.
    fn add_slab(
        &mut self,
        gpu: &Gpu,
        kinds: &[Kind<f32>],
        descent: &Descent<f32>,
        slab: Range<u32>,
        most: usize,
    ) -> Result<(), GpuError> {
        let mut constraints = Vec::with_capacity(kinds.len());
        for (set, incidence) in kinds.iter().zip(descent.incidences()) {
            constraints.push(SlabConstraints::new(gpu, &**set, incidence, descent, slab.clone())?);
        }
        for (color, group) in descent.groups().iter().enumerate() {
            let vertices: Vec<u32> = group.iter().copied().filter(|v| slab.contains(v)).collect();
            for indices in vertices.chunks(most) {
                let order = gpu.buffer("vertices of a color", indices)?;
                let vertices = gpu.bind(&self.descend, 1, &[(0, order.whole())])?;
                let mut chunk = VertexChunk { vertices, len: indices.len(), kinds: Vec::new() };
                for (n, (set, incidence)) in kinds.iter().zip(descent.incidences()).enumerate() {
                    let (kernel, _) = &self.forces[n];
                    if let Some((group, len)) =
                        constraints[n].bind(gpu, kernel, &**set, incidence, indices)?
                    {
                        chunk.kinds.push((n, group, len));
                    }
                }
                self.colors[color].push(chunk);
            }
        }
        Ok(())
    }

    /// Encodes the work that moves the vertices of a color.
    pub(crate) fn color_pass(&self, recording: &mut Pass<'_>, pass: &ColorPass) {
        for chunk in &self.colors[pass.color] {
            for (n, group, len) in &chunk.kinds {
                let (kernel, shared) = &self.forces[*n];
                recording.dispatch(kernel, &[shared, group], *len);
            }
            recording.dispatch(&self.descend, &[&self.state, &chunk.vertices], chunk.len);
        }
    }

    /// Returns the numbers of dispatches and threads of an iteration.
    pub(crate) fn workload<'a>(&self, color_passes: impl Iterator<Item = &'a ColorPass>) -> [usize; 2] {
        let chunks: Vec<&VertexChunk> = color_passes.flat_map(|pass| &self.colors[pass.color]).collect();
        let threads =
            |chunk: &&VertexChunk| chunk.len + chunk.kinds.iter().map(|(_, _, len)| len).sum::<usize>();
        [chunks.iter().map(|chunk| 1 + chunk.kinds.len()).sum(), chunks.iter().map(threads).sum()]
    }
}

impl SlabConstraints {
    fn new(
        gpu: &Gpu,
        set: &dyn ConstraintSet<f32>,
        incidence: &Incidence,
        descent: &Descent<f32>,
        slab: Range<u32>,
    ) -> Result<Self, GpuError> {
        let (name, arity, count) = (set.name(), set.arity(), set.param_count());
        let mut used = vec![false; set.len()];
        for &vertex in descent.groups().order.iter().filter(|v| slab.contains(v)) {
            for &entry in incidence.of(vertex) {
                used[entry as usize / arity] = true;
            }
        }
        let constraints: Vec<u32> = (0u32..).zip(&used).filter(|(_, used)| **used).map(|(k, _)| k).collect();
        let rows = |from: usize| constraints.iter().map(move |&k| k as usize * from..(k as usize + 1) * from);
        let tuples: Vec<u32> = rows(arity).flat_map(|row| &set.indices()[row]).copied().collect();
        let params: Vec<f32> = rows(count).flat_map(|row| &set.params()[row]).copied().collect();
        let stiffness = set.stiffness().values();
        let shape = |&k: &u32| [1.0 / stiffness.at(k as usize), set.rest_size(k as usize).abs()];
        let shape: Vec<[f32; 2]> = constraints.iter().map(shape).collect();
        Ok(Self {
            tuples: gpu.buffer(&format!("{name}: vertices"), &tuples)?,
            params: gpu.buffer(&format!("{name}: parameters"), &params)?,
            shape: gpu.buffer(&format!("{name}: stiffness and size"), &shape)?,
            constraints,
        })
    }

    /// Binds the constraints at the vertices `indices` of a chunk. Returns the group and the number
    /// of vertices with constraints, or `None` if there are none.
    fn bind(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
        set: &dyn ConstraintSet<f32>,
        incidence: &Incidence,
        indices: &[u32],
    ) -> Result<Option<(BindGroup, usize)>, GpuError> {
        let arity = set.arity() as u32;
        let (mut entries, mut ranges): (Vec<u32>, Vec<VertexEntries>) = Default::default();
        for (position, &vertex) in (0u32..).zip(indices) {
            let start = entries.len() as u32;
            for &entry in incidence.of(vertex) {
                // The slab contains every constraint of its vertices.
                let k = self.constraints.partition_point(|&k| k < entry / arity) as u32;
                entries.push(k * arity + entry % arity);
            }
            let end = entries.len() as u32;
            if end > start {
                ranges.push([position, start, end]);
            }
        }
        if ranges.is_empty() {
            return Ok(None);
        }
        let name = set.name();
        let entries = gpu.buffer(&format!("{name}: entries"), &entries)?;
        let len = ranges.len();
        let ranges = gpu.buffer(&format!("{name}: ranges of entries"), &ranges)?;
        let bindings = [
            (0, self.tuples.whole()),
            (1, self.params.whole()),
            (2, self.shape.whole()),
            (3, entries.whole()),
            (4, ranges.whole()),
        ];
        Ok(Some((gpu.bind(kernel, 1, &bindings)?, len)))
    }
}

/// Returns ranges of vertices whose constraints and entries fit one binding per array. A vertex
/// that needs more forms a slab by itself. The buffers of such a slab exceed the device's limits.
fn slabs(gpu: &Gpu, kinds: &[Kind<f32>], descent: &Descent<f32>) -> Vec<Range<u32>> {
    let mut order = descent.groups().order.clone();
    order.sort_unstable();
    let room: Vec<[usize; 2]> = kinds
        .iter()
        .map(|set| {
            let row = (set.arity().max(set.param_count()) * 4).max(size_of::<[f32; 2]>());
            [gpu.binding_len(row), gpu.binding_len(size_of::<u32>())]
        })
        .collect();
    // For each constraint the last slab that stores it, counted from 1.
    let mut stored: Vec<Vec<u32>> = kinds.iter().map(|set| vec![0; set.len()]).collect();
    let mut used = vec![[0usize; 2]; kinds.len()];
    let (mut slabs, mut start) = (Vec::new(), 0);
    for &vertex in &order {
        let number = slabs.len() as u32 + 1;
        let mut fits = true;
        let mut more = Vec::with_capacity(kinds.len());
        for (n, (set, incidence)) in kinds.iter().zip(descent.incidences()).enumerate() {
            let entries = incidence.of(vertex);
            let new = entries.iter().filter(|&&e| stored[n][e as usize / set.arity()] != number).count();
            fits &= used[n][0] + new <= room[n][0] && used[n][1] + entries.len() <= room[n][1];
            more.push([new, entries.len()]);
        }
        let number = if fits || used.iter().all(|used| *used == [0, 0]) {
            number
        } else {
            slabs.push(start..vertex);
            start = vertex;
            used.fill([0, 0]);
            for (more, incidence) in more.iter_mut().zip(descent.incidences()) {
                more[0] = incidence.of(vertex).len();
            }
            number + 1
        };
        for (n, (set, incidence)) in kinds.iter().zip(descent.incidences()).enumerate() {
            for &entry in incidence.of(vertex) {
                stored[n][entry as usize / set.arity()] = number;
            }
            used[n] = [used[n][0] + more[n][0], used[n][1] + more[n][1]];
        }
    }
    if let Some(last) = order.last() {
        slabs.push(start..last + 1);
    }
    slabs
}

/// Returns the struct `Descent` of the shaders.
fn settings_of(step: &DescentStep<f32>) -> [f32; 8] {
    let DescentStep { h, gravity_h_squared: g, inverse_h_squared, relaxation } = *step;
    [g.x, g.y, g.z, h, inverse_h_squared, relaxation, 0.0, 0.0]
}
