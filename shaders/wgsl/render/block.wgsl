// Blocks of 8 × 8 × 8 cells. Rays skip blocks without surface.

// Number of cells of a block along each axis.
const SIDE: u32 = 8u;

// Number of blocks along each axis of a grid of voxels.
fn block_shape(voxels: vec3u) -> vec3u {
    return max((voxels + (SIDE - 2u)) / SIDE, vec3u(1u));
}
