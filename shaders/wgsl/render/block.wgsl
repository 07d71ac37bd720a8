// Blocks of 8 × 8 × 8 cells, to skip empty space.

// Cells per block and axis.
const SIDE: u32 = 8u;

// Blocks per axis of a grid of voxels.
fn block_shape(voxels: vec3u) -> vec3u {
    return max((voxels + (SIDE - 2u)) / SIDE, vec3u(1u));
}
