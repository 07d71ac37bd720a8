// Each deformed tet claims the voxels that it holds or comes near: the smallest key wins.
@group(0) @binding(4) var<storage, read_write> owners: array<atomic<u32>>;

// In the key of a tet that only comes near a center: any tet that holds it wins.
const NEAR: u32 = 0x80000000u;

fn span_of(t: u32) -> u32 {
    return spans[t].x;
}

fn take(t: u32, tet: Tet, height: vec4f, voxel: u32) {
    let key = chunk.first + t;
    atomicMin(&owners[voxel], select(key | NEAR, key, all(height >= -tet.rounding)));
    if t < chunk.body && all(height > tet.near) {
        let bit = 1u << (voxel & 31u);
        if (atomicOr(&marks[voxel / 32u], bit) & bit) != 0u {
            atomicOr(&marks[plane() + voxel / 32u], bit);
        }
    }
}
