// The voxels of a slab that each tet holds or comes near: `take` is called for each. A thread walks a tet alone, unless that is
// large: then it goes on a list, and the threads of a workgroup share its rows. The order does not matter to the result.
//
// The source joined to this declares `span_of`, the slices of a tet, and `take`.
@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<uniform> slab: Slab;
// Three bits for each voxel, 32 voxels to a word: held strictly by a body tet, by two, and left by the body.
@group(0) @binding(2) var<storage, read_write> marks: array<atomic<u32>>;
// Lengths of the lists, then the one that is in use: numbers of tets in their chunk.
@group(0) @binding(3) var<storage, read_write> large: array<atomic<u32>>;
// First slice and end of all that a list's tets come near.
@group(0) @binding(5) var<storage, read> reaches: array<vec2u>;
@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var<storage, read> tets: array<vec4u>;
@group(1) @binding(2) var<storage, read> spans: array<vec2u>;
// Places of the vertices: now, or at rest.
@group(1) @binding(3) var<storage, read> places: array<vec4f>;

// More voxels than this are shared.
const LARGE: u32 = 1024u;

// Words of one plane of `marks`.
fn plane() -> u32 {
    return (slab.voxels + 31u) / 32u;
}

// The part of a tet's box in this slab, which it touches.
fn box_in_slab(corners: vec4u) -> Box {
    var covered = box_of(
        places[corners.x].xyz,
        places[corners.y].xyz,
        places[corners.z].xyz,
        places[corners.w].xyz,
    );
    covered.first.z = max(covered.first.z, slab.first);
    covered.end.z = min(covered.end.z, slab.first + slab.slices);
    return covered;
}

// Rows `start`, `start + step` … of the tet's box.
fn walk_rows(t: u32, covered: Box, start: u32, step: u32) {
    let corners = tets[t];
    let tet = tet_of(
        places[corners.x].xyz,
        places[corners.y].xyz,
        places[corners.z].xyz,
        places[corners.w].xyz,
        grid.tolerance,
    );
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

// Puts a tet on the list if it is large and there is room.
fn is_left_to_others(t: u32, covered: Box) -> bool {
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
        if !is_left_to_others(t, covered) {
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
