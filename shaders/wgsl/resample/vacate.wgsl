// Each tet that moved or was removed marks the voxels that it held at rest.
fn span_of(t: u32) -> u32 {
    return spans[t].y;
}

fn take(_t: u32, _tet: Tet, _height: vec4f, voxel: u32) {
    atomicOr(&marks[3u * plane() + voxel / 32u], 1u << (voxel & 31u));
}
