// The slices that each tet comes near, as it is now and, if it moved, as it was at rest: what lets the passes over a slab skip
// the tets of others after reading four bytes. And the slices that all tets of a chunk come near together, which lets them skip
// whole chunks.
@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<storage, read> places: array<vec4f>;
@group(0) @binding(2) var<storage, read> rest_places: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> counters: array<atomic<u32>>;
// For each list of large tets, that is for each walk over a chunk: first slice and end.
@group(0) @binding(4) var<storage, read_write> reaches: array<atomic<u32>>;
@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var<storage, read> tets: array<vec4u>;
@group(1) @binding(2) var<storage, read_write> spans: array<vec2u>;

// First slice, and the end in the upper half; zero for none.
fn span_of(a: vec3f, b: vec3f, c: vec3f, d: vec3f) -> u32 {
    if !(is_finite_3(a) && is_finite_3(b) && is_finite_3(c) && is_finite_3(d)) {
        return 0u;
    }
    if !has_volume(tet_of(a, b, c, d, grid.tolerance)) {
        return 0u;
    }
    let covered = box_of(a, b, c, d);
    return covered.first.z | (covered.end.z << 16u);
}

fn rest_span_of(corners: vec4u) -> u32 {
    return span_of(
        rest_places[corners.x].xyz,
        rest_places[corners.y].xyz,
        rest_places[corners.z].xyz,
        rest_places[corners.w].xyz,
    );
}

// True if the volume changed its sign or vanished.
fn is_inverted(corners: vec4u) -> bool {
    let now = volume_of(
        places[corners.x].xyz,
        places[corners.y].xyz,
        places[corners.z].xyz,
        places[corners.w].xyz,
    );
    let before = volume_of(
        rest_places[corners.x].xyz,
        rest_places[corners.y].xyz,
        rest_places[corners.z].xyz,
        rest_places[corners.w].xyz,
    );
    return is_finite(now) && is_finite(before) && now * select(1.0, -1.0, before < 0.0) <= 0.0;
}

// Widens the reach of a list by a span. Looking first keeps most threads from waiting for each other.
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
        let corners = tets[t];
        let a = places[corners.x];
        let b = places[corners.y];
        let c = places[corners.z];
        let d = places[corners.w];
        var left = 0u;
        if max(max(a.w, b.w), max(c.w, d.w)) > 0.0 {
            left = rest_span_of(corners);
            if is_inverted(corners) {
                atomicAdd(&counters[0], 1u);
            }
        }
        let now = span_of(a.xyz, b.xyz, c.xyz, d.xyz);
        spans[t] = vec2u(now, left);
        widen(chunk.list, now);
        widen(chunk.list + 1u, left);
    }
}

// The same for tets that exist at rest only.
@compute @workgroup_size(64)
fn span_removed(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var t = id.x; t < chunk.count; t += groups.x * 64u) {
        let left = rest_span_of(tets[t]);
        spans[t] = vec2u(0u, left);
        widen(chunk.list, left);
    }
}
