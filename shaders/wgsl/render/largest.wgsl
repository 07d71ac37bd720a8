// The largest HU in each block, with one thread per block. Interpolation in a block also reads the
// voxels on its upper faces, so that those voxels belong to two blocks.

@group(0) @binding(2) var<storage, read_write> largest: array<f32>;

@compute @workgroup_size(64)
fn largest_per_block(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let voxels = textureDimensions(volume);
    let shape = block_shape(voxels);
    for (var block = id.x; block < arrayLength(&largest); block += 64u * groups.x) {
        let low = SIDE * vec3u(block % shape.x, block / shape.x % shape.y, block / (shape.x * shape.y));
        let end = min(low + SIDE + 1u, voxels);
        var top = AIR_HU;
        for (var k = low.z; k < end.z; k++) {
            for (var j = low.y; j < end.y; j++) {
                for (var i = low.x; i < end.x; i++) {
                    top = max(top, voxel(volume, volume_scale, vec3u(i, j, k)));
                }
            }
        }
        largest[block] = top;
    }
}
