// The slices that each tet touches now and, if it moved, at rest. With them the passes over a slab
// skip other tets after reading four bytes. The slices that the tets of a chunk touch together let
// the passes skip whole chunks.
@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<storage, read> places: array<vec4f>;
@group(0) @binding(2) var<storage, read> rest_places: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> counters: array<atomic<u32>>;
// First slice and end for each list of large tets, that is, for each walk over a chunk.
@group(0) @binding(4) var<storage, read_write> reaches: array<atomic<u32>>;
@group(1) @binding(2) var<storage, read_write> spans: array<vec2u>;

// The first slice in the lower half of a word and the end in the upper half. Zero if the tet
// touches no slice.
fn span_of(p: Corners) -> u32 {
    if !(is_finite_3(p.a) && is_finite_3(p.b) && is_finite_3(p.c) && is_finite_3(p.d)) {
        return 0u;
    }
    if !has_volume(tet_of(p, grid.tolerance)) {
        return 0u;
    }
    let covered = box_of(p);
    return covered.first.z | (covered.end.z << 16u);
}

// Places of the corners at rest of the tet with these vertices.
fn rest_corners_of(vertices: vec4u) -> Corners {
    return Corners(
        rest_places[vertices.x].xyz,
        rest_places[vertices.y].xyz,
        rest_places[vertices.z].xyz,
        rest_places[vertices.w].xyz,
    );
}

// True if the volume changed its sign or vanished.
fn is_inverted(vertices: vec4u) -> bool {
    let now = volume_of(corners_of(vertices));
    let before = volume_of(rest_corners_of(vertices));
    return is_finite(now) && is_finite(before) && now * select(1.0, -1.0, before < 0.0) <= 0.0;
}

// Extends the reach of a list by a span. The test before the update avoids most waits of threads
// for each other.
fn widen(list: u32, span: u32) {
    let first = span & 0xffffu;
    let end = span >> 16u;
    if end > 0u && first < atomicLoad(&reaches[2u * list]) {
        atomicMin(&reaches[2u * list], first);
    }
    if end > atomicLoad(&reaches[2u * list + 1u]) {
        atomicMax(&reaches[2u * list + 1u], end);
    }
}

@compute @workgroup_size(64)
fn span(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var t = id.x; t < chunk.count; t += groups.x * 64u) {
        let vertices = tets[t];
        var left = 0u;
        if has_moved(vertices) {
            left = span_of(rest_corners_of(vertices));
            if is_inverted(vertices) {
                atomicAdd(&counters[0], 1u);
            }
        }
        let now = span_of(corners_of(vertices));
        spans[t] = vec2u(now, left);
        widen(chunk.list, now);
        widen(chunk.list + 1u, left);
    }
}

// The spans of tets that exist only at rest.
@compute @workgroup_size(64)
fn span_removed(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var t = id.x; t < chunk.count; t += groups.x * 64u) {
        let left = span_of(rest_corners_of(tets[t]));
        spans[t] = vec2u(0u, left);
        widen(chunk.list, left);
    }
}
