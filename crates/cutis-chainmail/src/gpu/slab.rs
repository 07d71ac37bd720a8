//! Planes of a chain that share one set of buffers.

use std::ops::Range;

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel};

use super::mirror::Mirror;
use super::uniform::SlabUniform;

/// Largest number of elements in a slab, for any device: the kernel counts them in 32 bits.
const MOST_ELEMENTS: usize = 1 << 28;

/// Consecutive planes of a grid.
pub struct Slab {
    pub planes: Range<usize>,
    /// The elements of these planes.
    pub elements: Range<usize>,
    /// Links, held flags and materials, two elements per word. There is one more plane at either
    /// end.
    bytes: Mirror<u32>,
    /// Positions by coordinate.
    pub x: [Buffer<i32>; 3],
}

impl Slab {
    /// Divides a grid into slabs that the device can bind, with at least one plane each.
    pub fn all(gpu: &Gpu, shape: [usize; 3]) -> Result<Vec<Self>, GpuError> {
        let [nx, ny, nz] = shape;
        let plane = nx * ny;
        let most = (gpu.binding_len(size_of::<i32>()).min(MOST_ELEMENTS) / plane).max(1);
        let slab = |first: usize| {
            let planes = first..nz.min(first + most);
            let x = || gpu.zeroed("chainmail: positions", planes.len() * plane);
            Ok(Self {
                x: [x()?, x()?, x()?],
                bytes: Mirror::new(gpu, "chainmail: elements", (planes.len() + 2) * pitch(shape))?,
                elements: planes.start * plane..planes.end * plane,
                planes,
            })
        };
        (0..nz).step_by(most).map(slab).collect()
    }

    /// The planes whose bytes the slab stores: its own, and the neighboring plane at either end.
    pub fn seen(&self, nz: usize) -> Range<usize> {
        self.planes.start.saturating_sub(1)..nz.min(self.planes.end + 1)
    }

    /// Writes the words of a plane that is [`seen`](Slab::seen).
    pub fn set_plane(&mut self, gpu: &Gpu, plane: usize, words: &[u32]) -> Result<(), GpuError> {
        self.bytes.set(gpu, (plane + 1 - self.planes.start) * words.len(), words)
    }

    /// Size on the device in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes.bytes() + self.x.iter().map(Buffer::bytes).sum::<u64>()
    }
}

/// Number of words that hold the bytes of a plane.
fn pitch([nx, ny, _]: [usize; 3]) -> usize {
    (nx * ny).div_ceil(2)
}

/// The words of a plane, from its links and materials.
pub fn words(links: &[u8], materials: &[u8]) -> Vec<u32> {
    let element = |links: &u8, material: &u8| u32::from(*links) | u32::from(*material) << 8;
    let ((links, last_links), (materials, last_material)) = (links.as_chunks(), materials.as_chunks());
    let pairs = links.iter().zip(materials);
    let pair = |([a, b], [of_a, of_b]): (&[u8; 2], &[u8; 2])| element(a, of_a) | element(b, of_b) << 16;
    let last = last_links.iter().zip(last_material).map(|(links, material)| element(links, material));
    pairs.map(pair).chain(last).collect()
}

/// Bind group 0 of the kernel, by slab and coordinate.
pub fn bind(
    gpu: &Gpu,
    kernel: &Kernel,
    shape: [usize; 3],
    slabs: &[Slab],
) -> Result<Vec<[BindGroup; 3]>, GpuError> {
    // Dummy buffers for the plane below the first slab and above the last one. No link leads there.
    let nothing = [(); 2].map(|()| gpu.zeroed::<i32>("chainmail: nothing", 1));
    let [below_first, above_last] = nothing;
    let (below_first, above_last) = (below_first?, above_last?);
    let group = |number: usize, slab: &Slab| {
        let before = number.checked_sub(1).and_then(|before| slabs.get(before));
        let next = slabs.get(number + 1);
        let words = [shape[0], shape[1], slab.planes.len(), slab.planes.start].map(|n| n as u32);
        let [columns, rows, planes, first] = words;
        let uniform = gpu.uniform(
            "chainmail: slab",
            &SlabUniform {
                columns,
                rows,
                planes,
                first,
                planes_below: before.map_or(0, |slab| slab.planes.len() as u32),
                pitch: pitch(shape) as u32,
                unused: [0; 2],
            },
        )?;
        let bind = |c: usize| {
            let bindings = [
                (0, uniform.whole()),
                (1, slab.bytes.buffer.whole()),
                (2, slab.x[c].whole()),
                (3, before.map_or(&below_first, |slab| &slab.x[c]).whole()),
                (4, next.map_or(&above_last, |slab| &slab.x[c]).whole()),
            ];
            gpu.bind(kernel, 0, &bindings)
        };
        Ok([bind(0)?, bind(1)?, bind(2)?])
    };
    slabs.iter().enumerate().map(|(number, slab)| group(number, slab)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_elements_make_a_word_and_a_last_one_has_room() {
        assert_eq!(words(&[1, 2, 128], &[3, 255, 5]), [0xff02_0301, 0x0580]);
    }
}
