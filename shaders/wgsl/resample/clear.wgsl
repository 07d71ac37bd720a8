// Resets a slab: no voxel has an owner or a mark, and the lists of large tets are empty.
@group(0) @binding(0) var<uniform> slab: Slab;
@group(0) @binding(1) var<storage, read_write> owners: array<u32>;
@group(0) @binding(2) var<storage, read_write> marks: array<u32>;
@group(0) @binding(3) var<storage, read_write> large: array<u32>;

@compute @workgroup_size(64)
fn clear(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let threads = groups.x * 64u;
    for (var voxel = id.x; voxel < slab.voxels; voxel += threads) {
        owners[voxel] = 0xffffffffu;
    }
    for (var word = id.x; word < 4u * ((slab.voxels + 31u) / 32u); word += threads) {
        marks[word] = 0u;
    }
    for (var list = id.x; list < slab.lists; list += threads) {
        large[list] = 0u;
    }
}
