// Each deformed tet claims the voxels whose centers it holds or touches within the tolerance. The
// smallest key wins.
@group(0) @binding(4) var<storage, read_write> owners: array<atomic<u32>>;

// Flag in the key of a tet that touches a center only within the tolerance, so that every tet that
// holds the center wins.
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
        if has_moved(tets[t]) {
            atomicOr(&marks[2u * plane() + voxel / 32u], bit);
        }
    }
}
