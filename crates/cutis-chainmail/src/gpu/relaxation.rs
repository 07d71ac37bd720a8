//! Memory of a chain on the device, and the relaxation there.

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel};
use cutis_shaders::chainmail as shaders;
use cutis_shaders::chainmail::{SWEEP_HALVES, SWEEP_WORDS};

use super::mirror::Mirror;
use super::slab::{self, Slab};
use super::uniform::HalfUniform;
use crate::{Chain, ChainError, Relaxation};

/// Largest number of sweeps in a submission.
const MOST_SWEEPS: usize = 64;
/// Largest number of element visits in a submission. A desktop resets a device that is busy for
/// seconds.
const ELEMENTS_AT_ONCE: usize = 1 << 28;

/// Relaxation on a GPU, for chains of one shape and one number of materials.
///
/// It takes 14 bytes on the device for each grid point, in buffers of whole planes that fit the
/// limits of the device. See [`RelaxGpu::bytes`].
///
/// ```
/// use cutis_chainmail::{Chain, Drag, Material, Order, RelaxGpu};
/// use cutis_gpu::{Gpu, GpuError, GpuOptions};
///
/// let gpu = match Gpu::open(&GpuOptions::default()) {
///     Err(GpuError::NoAdapter) => return Ok(()), // nothing to run on
///     opened => opened?,
/// };
/// let soft = Material::isotropic(0.5, 2.0, 0.5, 0.0);
/// let mut chain = Chain::new([9, 1, 1], [1.0; 3], &[soft], vec![0; 9])?;
/// chain.drag(&[Drag { element: 8, to: [12.0, 0.0, 0.0] }], Order::Fifo)?;
/// let mut same = chain.clone();
/// let relaxed = RelaxGpu::new(&gpu, &chain)?.relax(&mut chain, 1000, &[8])?;
/// assert_eq!(relaxed, same.relax(1000, &[8]));
/// assert_eq!(chain.units(4), same.units(4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct RelaxGpu {
    gpu: Gpu,
    kernel: Kernel,
    shape: [usize; 3],
    materials: usize,
    slabs: Vec<Slab>,
    /// Bind group 0, by slab and coordinate.
    slab_groups: Vec<[BindGroup; 3]>,
    /// Bounds for each coordinate, as `[lo, hi]` by pair of materials and axis.
    bounds: [Mirror<[i32; 2]>; 3],
    k: Mirror<i32>,
    /// Bind group 1, by coordinate and half.
    half_groups: Vec<[BindGroup; 2]>,
    /// Move counters, [`SWEEP_WORDS`] each: first those of the sweep before a submission, then
    /// those of its sweeps.
    moved: Buffer<u32>,
    /// Bind group 2, by sweep: the counters of the previous sweep and its own.
    sweep_groups: Vec<BindGroup>,
}

impl RelaxGpu {
    /// Bytes on the device for each grid point. Limits and counters are additional.
    pub const BYTES_PER_PLACE: usize = 14;

    /// Allocates memory and compiles the kernel for chains with the shape of `chain`. Its contents
    /// are not uploaded yet.
    ///
    /// # Errors
    /// [`ChainError::Gpu`] if the device has too little memory, is lost, or cannot bind one plane
    /// of the grid.
    pub fn new(gpu: &Gpu, chain: &Chain) -> Result<Self, ChainError> {
        Self::with_source(gpu, chain, &|source| source)
    }

    /// As [`RelaxGpu::new`], with the kernel source passed through `change`. Parity tests use it to
    /// show that they detect a wrong kernel.
    ///
    /// # Errors
    /// The errors of [`RelaxGpu::new`].
    pub fn with_source(
        gpu: &Gpu,
        chain: &Chain,
        change: &dyn Fn(String) -> String,
    ) -> Result<Self, ChainError> {
        let kernel = gpu.kernel("chainmail: relax", &change(shaders::relax()), shaders::RELAX)?;
        let (shape, materials) = (chain.shape(), chain.structure.limits.all_k().len());
        let slabs = Slab::all(gpu, shape)?;
        let slab_groups = slab::bind(gpu, &kernel, shape, &slabs)?;
        let table = || Mirror::new(gpu, "chainmail: bounds", 3 * materials * materials);
        let bounds = [table()?, table()?, table()?];
        let k = Mirror::new(gpu, "chainmail: k", materials)?;
        let half = |coordinate: usize, odd: usize| {
            let [coordinate_word, odd, materials] = [coordinate, odd, materials].map(|n| n as u32);
            let half = HalfUniform { coordinate: coordinate_word, odd, materials, unused: 0 };
            let half = gpu.uniform("chainmail: half", &half)?;
            let bindings = [(0, half.whole()), (1, bounds[coordinate].buffer.whole()), (2, k.buffer.whole())];
            gpu.bind(&kernel, 1, &bindings)
        };
        let half_groups = (0..3).map(|c| Ok([half(c, 0)?, half(c, 1)?])).collect::<Result<_, GpuError>>()?;
        let sweeps = (ELEMENTS_AT_ONCE / chain.places()).clamp(1, MOST_SWEEPS);
        let moved = gpu.zeroed("chainmail: moved", (sweeps + 1) * SWEEP_WORDS)?;
        let two = |sweep: usize| moved.range(sweep * SWEEP_WORDS..(sweep + 2) * SWEEP_WORDS);
        let sweep_groups =
            (0..sweeps).map(|sweep| gpu.bind(&kernel, 2, &[(0, two(sweep))])).collect::<Result<_, _>>()?;
        Ok(Self {
            gpu: gpu.clone(),
            kernel,
            shape,
            materials,
            slabs,
            slab_groups,
            bounds,
            k,
            half_groups,
            moved,
            sweep_groups,
        })
    }

    /// Relaxes a chain on the device, with the same positions and counts as [`Chain::relax`]. Waits
    /// for the result.
    ///
    /// The chain must have the shape and the number of materials of the one passed to
    /// [`RelaxGpu::new`]. Positions are uploaded with every call; links, fixed elements, materials
    /// and limits only where they differ from the last call.
    ///
    /// # Errors
    /// [`ChainError::OtherChain`], [`ChainError::Gpu`]; then the chain is unchanged.
    pub fn relax(&mut self, chain: &mut Chain, most: u32, held: &[u32]) -> Result<Relaxation, ChainError> {
        self.check(chain)?;
        let mut done = Relaxation::default();
        if most == 0 {
            return Ok(done);
        }
        self.upload(chain, held)?;
        while !done.settled && done.sweeps < most {
            let sweeps = self.sweep_groups.len().min((most - done.sweeps) as usize);
            for moves in self.sweep(sweeps)? {
                done.sweeps += 1;
                done.moves += moves;
                done.settled = moves == 0;
                if done.settled {
                    break;
                }
            }
        }
        if done.moves > 0 {
            chain.positions = [self.positions(0)?, self.positions(1)?, self.positions(2)?];
        }
        // The rows that the next relaxation on the host has to visit.
        chain.changed.fill(!done.settled);
        let held: Vec<u32> = held.iter().copied().filter(|&element| chain.has_element(element)).collect();
        chain.mark_held(&held);
        Ok(done)
    }

    /// Number of slabs in which the grid is stored on the device.
    pub fn slabs(&self) -> usize {
        self.slabs.len()
    }

    /// Memory on the device in bytes, without some hundred bytes for each slab and each sweep of a
    /// submission.
    pub fn bytes(&self) -> u64 {
        let tables = self.bounds.iter().map(Mirror::bytes).sum::<u64>() + self.k.bytes();
        self.slabs.iter().map(Slab::bytes).sum::<u64>() + tables + self.moved.bytes()
    }

    fn check(&self, chain: &Chain) -> Result<(), ChainError> {
        let (shape, materials) = (chain.shape(), chain.structure.limits.all_k().len());
        let (of_shape, of_materials) = (self.shape, self.materials);
        if (shape, materials) == (of_shape, of_materials) {
            return Ok(());
        }
        Err(ChainError::OtherChain { shape, materials, of_shape, of_materials })
    }

    /// Uploads positions, and all other data that changed.
    fn upload(&mut self, chain: &mut Chain, held: &[u32]) -> Result<(), GpuError> {
        for slab in &self.slabs {
            for (x, positions) in slab.x.iter().zip(&chain.positions) {
                self.gpu.write(x, 0, &positions[slab.elements.clone()])?;
            }
        }
        for (coordinate, bounds) in self.bounds.iter_mut().enumerate() {
            bounds.set(&self.gpu, 0, &chain.structure.limits.table(coordinate))?;
        }
        self.k.set(&self.gpu, 0, chain.structure.limits.all_k())?;
        let held: Vec<u32> = held.iter().copied().filter(|&element| chain.has_element(element)).collect();
        held.iter().for_each(|&element| chain.structure.links.set_grabbed(element, true));
        let uploaded = self.upload_elements(chain);
        held.iter().for_each(|&element| chain.structure.links.set_grabbed(element, false));
        uploaded
    }

    fn upload_elements(&mut self, chain: &Chain) -> Result<(), GpuError> {
        let [nx, ny, nz] = self.shape;
        let planes =
            chain.structure.links.bits().chunks(nx * ny).zip(chain.structure.materials.chunks(nx * ny));
        for (plane, (links, materials)) in planes.enumerate() {
            let words = slab::words(links, materials);
            for slab in self.slabs.iter_mut().filter(|slab| slab.seen(nz).contains(&plane)) {
                slab.set_plane(&self.gpu, plane, &words)?;
            }
        }
        Ok(())
    }

    /// Runs sweeps in one submission and returns how many coordinates each sweep changed.
    fn sweep(&self, sweeps: usize) -> Result<Vec<u64>, GpuError> {
        // The counters before the first sweep say that something moved, so that it runs.
        let mut before = vec![0; (sweeps + 1) * SWEEP_WORDS];
        before[0] = 1;
        self.gpu.write(&self.moved, 0, &before)?;
        let mut pass = self.gpu.pass("chainmail: relaxation");
        for sweep in &self.sweep_groups[..sweeps] {
            for odd in 0..2 {
                for (slab, groups) in self.slabs.iter().zip(&self.slab_groups) {
                    let threads = slab.elements.len().div_ceil(2).min(self.gpu.chunk_len(1));
                    for (group, halves) in groups.iter().zip(&self.half_groups) {
                        pass.dispatch(&self.kernel, &[group, &halves[odd], sweep], threads);
                    }
                }
            }
        }
        pass.submit()?;
        let moved = self.gpu.read(&self.moved, SWEEP_WORDS..before.len())?;
        let total = |words: &[u32]| words[..SWEEP_HALVES].iter().map(|&word| u64::from(word)).sum();
        Ok(moved.chunks(SWEEP_WORDS).map(total).collect())
    }

    /// One coordinate of every element.
    fn positions(&self, coordinate: usize) -> Result<Vec<i32>, GpuError> {
        let mut all = Vec::with_capacity(self.shape.iter().product());
        for slab in &self.slabs {
            all.extend(self.gpu.read(&slab.x[coordinate], 0..slab.elements.len())?);
        }
        Ok(all)
    }
}
