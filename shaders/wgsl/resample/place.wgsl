// Maps the positions of the vertices to places. w is 1 if the position of a vertex differs from
// that at rest in any bit.
@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<storage, read> positions: array<vec4f>;
@group(0) @binding(2) var<storage, read> rest: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> places: array<vec4f>;

@compute @workgroup_size(64)
fn place(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var v = id.x; v < arrayLength(&places); v += groups.x * 64u) {
        let p = positions[v].xyz;
        let moved = any(p != rest[v].xyz) || !is_finite_3(p);
        places[v] = vec4f(
            ((grid.xx * p.x + grid.xy * p.y) + grid.xz * p.z) + grid.offset_x,
            ((grid.yx * p.x + grid.yy * p.y) + grid.yz * p.z) + grid.offset_y,
            ((grid.zx * p.x + grid.zy * p.y) + grid.zz * p.z) + grid.offset_z,
            select(0.0, 1.0, moved),
        );
    }
}
