//! Vertex block descent on the device: slabs of the body, and the chunks of vertices that move at once.
//!
//! A constraint is read by each of its vertices, and these are of different colors. So constraints are not stored by
//! color but by **slab**: a range of vertices whose constraints fit one binding each. All colors of a slab share its tables. A body
//! that fits the device's bindings is one slab, and each of its constraints is stored once.

use std::ops::Range;

use cutis_coloring::Incidence;
use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel, Pass};
use cutis_shaders::solver;
use cutis_solver::{ColorPass, ConstraintSet, Descent, DescentStep, Kind, Simulation};

use crate::body::Body;

/// Numbers of a vertex's vertex_force: force, diagonal and mixed entries, four each.
pub(crate) type VertexForceRow = [f32; 12];
/// A vertex of a chunk and its range of the slab's places.
pub(crate) type Share = [u32; 3];

/// All that the color passes of an iteration need.
pub(crate) struct DescentOnDevice {
    descend: Kernel,
    /// One per kind.
    forces: Vec<(Kernel, BindGroup)>,
    moved: BindGroup,
    /// Chunks of each color.
    colors: Vec<Vec<Chunk>>,
}

/// Vertices of one color and one slab.
struct Chunk {
    vertices: BindGroup,
    len: usize,
    /// Kinds with constraints on them.
    kinds: Vec<(usize, BindGroup, usize)>,
}

/// The constraints of one kind that touch a slab.
struct Table {
    /// Ascending.
    constraints: Vec<u32>,
    tuples: Buffer<u32>,
    params: Buffer<f32>,
    shape: Buffer<[f32; 2]>,
}

impl DescentOnDevice {
    pub(crate) fn new(
        gpu: &Gpu,
        body: &Body,
        simulation: &Simulation<f32>,
        descent: &Descent<f32>,
    ) -> Result<Self, GpuError> {
        let kinds = simulation.system().kinds();
        let source = solver::descend();
        let descend = gpu.kernel("vertices: descend", &source, solver::DESCEND)?;
        let most = gpu.chunk_len(size_of::<VertexForceRow>());
        let groups = descent.groups();
        let largest = groups.iter().map(<[u32]>::len).max().unwrap_or(0).min(most);
        let scratch = gpu.zeroed::<VertexForceRow>("vertex forces", largest)?;
        let settings = gpu.uniform("settings of a descent", &settings_of(descent.step()))?;
        let bindings = [
            (0, body.vertices.whole()),
            (1, scratch.whole()),
            (2, body.previous.whole()),
            (3, body.velocities.whole()),
            (4, settings.whole()),
        ];
        let moved = gpu.bind(&descend, 0, &bindings)?;
        let mut forces = Vec::with_capacity(kinds.len());
        for set in kinds {
            let source = solver::vertex_force(set.arity(), set.wgsl());
            let kernel =
                gpu.kernel(&format!("{}: vertex force", set.name()), &source, solver::VERTEX_FORCE)?;
            let shared = gpu.bind(&kernel, 0, &[(0, body.vertices.whole()), (1, scratch.whole())])?;
            forces.push((kernel, shared));
        }
        let mut made = Self { descend, forces, moved, colors: groups.iter().map(|_| Vec::new()).collect() };
        for slab in slabs(gpu, kinds, descent) {
            made.add_slab(gpu, kinds, descent, slab, most)?;
        }
        Ok(made)
    }

    /// Stores the constraints of a slab and the chunks of its vertices.
    fn add_slab(
        &mut self,
        gpu: &Gpu,
        kinds: &[Kind<f32>],
        descent: &Descent<f32>,
        slab: Range<u32>,
        most: usize,
    ) -> Result<(), GpuError> {
        let mut tables = Vec::with_capacity(kinds.len());
        for (set, incidence) in kinds.iter().zip(descent.incidences()) {
            tables.push(Table::new(gpu, &**set, incidence, descent, slab.clone())?);
        }
        for (color, group) in descent.groups().iter().enumerate() {
            let chosen: Vec<u32> = group.iter().copied().filter(|v| slab.contains(v)).collect();
            for chosen in chosen.chunks(most) {
                let order = gpu.buffer("vertices of a color", chosen)?;
                let vertices = gpu.bind(&self.descend, 1, &[(0, order.whole())])?;
                let mut chunk = Chunk { vertices, len: chosen.len(), kinds: Vec::new() };
                for (n, (set, incidence)) in kinds.iter().zip(descent.incidences()).enumerate() {
                    let (kernel, _) = &self.forces[n];
                    if let Some((group, len)) = tables[n].bind(gpu, kernel, &**set, incidence, chosen)? {
                        chunk.kinds.push((n, group, len));
                    }
                }
                self.colors[color].push(chunk);
            }
        }
        Ok(())
    }

    /// Moves the vertices of a color.
    pub(crate) fn color_pass(&self, recording: &mut Pass<'_>, pass: &ColorPass) {
        for chunk in &self.colors[pass.color] {
            for (n, group, len) in &chunk.kinds {
                let (kernel, shared) = &self.forces[*n];
                recording.dispatch(kernel, &[shared, group], *len);
            }
            recording.dispatch(&self.descend, &[&self.moved, &chunk.vertices], chunk.len);
        }
    }

    /// Dispatches of an iteration, and their threads.
    pub(crate) fn load<'a>(&self, color_passes: impl Iterator<Item = &'a ColorPass>) -> [usize; 2] {
        let chunks: Vec<&Chunk> = color_passes.flat_map(|pass| &self.colors[pass.color]).collect();
        let threads = |chunk: &&Chunk| chunk.len + chunk.kinds.iter().map(|(_, _, len)| len).sum::<usize>();
        [chunks.iter().map(|chunk| 1 + chunk.kinds.len()).sum(), chunks.iter().map(threads).sum()]
    }
}

impl Table {
    fn new(
        gpu: &Gpu,
        set: &dyn ConstraintSet<f32>,
        incidence: &Incidence,
        descent: &Descent<f32>,
        slab: Range<u32>,
    ) -> Result<Self, GpuError> {
        let (name, arity, count) = (set.name(), set.arity(), set.param_count());
        let mut touched = vec![false; set.len()];
        for &vertex in descent.groups().order.iter().filter(|v| slab.contains(v)) {
            for &place in incidence.of(vertex) {
                touched[place as usize / arity] = true;
            }
        }
        let constraints: Vec<u32> = (0u32..).zip(&touched).filter(|(_, t)| **t).map(|(k, _)| k).collect();
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

    /// Binds the constraints on `chosen`; nothing if there are none.
    fn bind(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
        set: &dyn ConstraintSet<f32>,
        incidence: &Incidence,
        chosen: &[u32],
    ) -> Result<Option<(BindGroup, usize)>, GpuError> {
        let arity = set.arity() as u32;
        let (mut places, mut shares): (Vec<u32>, Vec<Share>) = Default::default();
        for (vertex, &v) in (0u32..).zip(chosen) {
            let start = places.len() as u32;
            for &place in incidence.of(v) {
                // Every constraint of a chosen vertex is in the table.
                let k = self.constraints.partition_point(|&k| k < place / arity) as u32;
                places.push(k * arity + place % arity);
            }
            let end = places.len() as u32;
            if end > start {
                shares.push([vertex, start, end]);
            }
        }
        if shares.is_empty() {
            return Ok(None);
        }
        let name = set.name();
        let places = gpu.buffer(&format!("{name}: places"), &places)?;
        let len = shares.len();
        let shares = gpu.buffer(&format!("{name}: shares"), &shares)?;
        let bindings = [
            (0, self.tuples.whole()),
            (1, self.params.whole()),
            (2, self.shape.whole()),
            (3, places.whole()),
            (4, shares.whole()),
        ];
        Ok(Some((gpu.bind(kernel, 1, &bindings)?, len)))
    }
}

/// Ranges of vertices whose constraints, and the places of whose vertices, fit one binding per array. A vertex with more than
/// that is a slab of its own, and the device's limits refuse it.
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
    // For each constraint the slab that stored it last, counted from 1.
    let mut stored: Vec<Vec<u32>> = kinds.iter().map(|set| vec![0; set.len()]).collect();
    let mut used = vec![[0usize; 2]; kinds.len()];
    let (mut slabs, mut start) = (Vec::new(), 0);
    for &vertex in &order {
        let number = slabs.len() as u32 + 1;
        let mut fits = true;
        let mut more = Vec::with_capacity(kinds.len());
        for (n, (set, incidence)) in kinds.iter().zip(descent.incidences()).enumerate() {
            let places = incidence.of(vertex);
            let new = places.iter().filter(|&&p| stored[n][p as usize / set.arity()] != number).count();
            fits &= used[n][0] + new <= room[n][0] && used[n][1] + places.len() <= room[n][1];
            more.push([new, places.len()]);
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
            for &place in incidence.of(vertex) {
                stored[n][place as usize / set.arity()] = number;
            }
            used[n] = [used[n][0] + more[n][0], used[n][1] + more[n][1]];
        }
    }
    if let Some(last) = order.last() {
        slabs.push(start..last + 1);
    }
    slabs
}

/// The struct `Descent` of the shaders.
fn settings_of(step: &DescentStep<f32>) -> [f32; 8] {
    let DescentStep { h, gravity_h_squared: g, inverse_h_squared, relaxation } = *step;
    [g.x, g.y, g.z, h, inverse_h_squared, relaxation, 0.0, 0.0]
}
