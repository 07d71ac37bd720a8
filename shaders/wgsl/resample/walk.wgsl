// Calls `take` for each voxel of a slab whose center a tet holds or touches within the tolerance.
// One thread processes a small tet. A large tet goes to a list, and the threads of a workgroup
// process its rows. The result does not depend on the order.
//
// The source joined to this declares `take` and `span_of`, the slices of a tet.
@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<uniform> slab: Slab;
// Four bits per voxel, in planes of 32 voxels per word: strictly inside a tet of the body, inside
// two of them, inside one that moved, and left by the body.
@group(0) @binding(2) var<storage, read_write> marks: array<atomic<u32>>;
// The lengths of the lists, then the present list: indices of tets in their chunk.
@group(0) @binding(3) var<storage, read_write> large: array<atomic<u32>>;
// First slice and end of the tets of each list.
@group(0) @binding(5) var<storage, read> reaches: array<vec2u>;
@group(1) @binding(2) var<storage, read> spans: array<vec2u>;
// Places of the vertices, now or at rest.
@group(1) @binding(3) var<storage, read> places: array<vec4f>;

// Tets with more voxels than this are large.
const LARGE: u32 = 1024u;

// Words of one plane of `marks`.
fn plane() -> u32 {
    return (slab.voxels + 31u) / 32u;
}

// The part of a tet's box in this slab. The tet must touch the slab.
fn box_in_slab(vertices: vec4u) -> Box {
    var covered = box_of(corners_of(vertices));
    covered.first.z = max(covered.first.z, slab.first);
    covered.end.z = min(covered.end.z, slab.first + slab.slices);
    return covered;
}

// Processes the rows `start`, `start + step`, … of the tet's box.
fn walk_rows(t: u32, covered: Box, start: u32, step: u32) {
    let tet = tet_of(corners_of(tets[t]), grid.tolerance);
    let rows = covered.end.y - covered.first.y;
    let count = rows * (covered.end.z - covered.first.z);
    for (var r = start; r < count; r += step) {
        let j = covered.first.y + r % rows;
        let k = covered.first.z + r / rows;
        let row = row_of(tet, grid.region_y + f32(j), grid.region_z + f32(k));
        let first = ((k - slab.first) * grid.rows + j) * grid.columns;
        for (var i = covered.first.x; i < covered.end.x; i++) {
            let height = heights(tet, row, grid.region_x + f32(i));
            if all(height >= -tet.near) {
                take(t, tet, height, first + i);
            }
        }
    }
}

// Adds a tet to the list if it is large and the list has space. Returns true if it did.
fn is_deferred(t: u32, covered: Box) -> bool {
    let size = covered.end - covered.first;
    if size.x * size.y * size.z <= LARGE {
        return false;
    }
    let at = atomicAdd(&large[chunk.list], 1u) + slab.lists;
    if at >= arrayLength(&large) {
        return false;
    }
    atomicStore(&large[at], t);
    return true;
}

@compute @workgroup_size(64)
fn walk(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let reach = reaches[chunk.list];
    if !touches(slab, reach.x, reach.y) {
        return;
    }
    for (var t = id.x; t < chunk.count; t += groups.x * 64u) {
        let span = span_of(t);
        if !touches(slab, span & 0xffffu, span >> 16u) {
            continue;
        }
        let covered = box_in_slab(tets[t]);
        if !is_deferred(t, covered) {
            walk_rows(t, covered, 0u, 1u);
        }
    }
}

@compute @workgroup_size(64)
fn walk_large(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let listed = min(atomicLoad(&large[chunk.list]), arrayLength(&large) - slab.lists);
    for (var at = group.x; at < listed; at += groups.x) {
        let t = atomicLoad(&large[slab.lists + at]);
        walk_rows(t, box_in_slab(tets[t]), lane, 64u);
    }
}
