// The forces of one kind of constraint on the vertices of a chunk, and the matrices of their
// quadratic models. The same operations as `VertexForce::add`.
struct VertexForce {
    force: vec4f,
    // Entries xx, yy, zz.
    diagonal: vec4f,
    // Entries xy, xz, yz.
    mixed: vec4f,
}

// The position of a vertex in the chunk, and the range of its `entries`.
struct VertexEntries {
    position: u32,
    start: u32,
    end: u32,
}

@group(0) @binding(0) var<storage, read> vertices: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> forces: array<VertexForce>;
@group(1) @binding(0) var<storage, read> tuples: array<array<u32, N>>;
@group(1) @binding(1) var<storage, read> params: array<Params>;
// Inverse compliance and absolute rest size.
@group(1) @binding(2) var<storage, read> shape: array<vec2f>;
// Index of a constraint times N, plus the position of the vertex in its tuple.
@group(1) @binding(3) var<storage, read> entries: array<u32>;
@group(1) @binding(4) var<storage, read> ranges: array<VertexEntries>;

@compute @workgroup_size(64)
fn vertex_force(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= arrayLength(&ranges)) {
        return;
    }
    hidden_zero = select(0u, 1u, arrayLength(&tuples) == 0u);
    let range = ranges[id.x];
    var force = forces[range.position].force.xyz;
    var diagonal = forces[range.position].diagonal.xyz;
    var mixed = forces[range.position].mixed.xyz;
    for (var n = range.start; n < range.end; n++) {
        let k = entries[n] / N;
        let corner = entries[n] % N;
        var tuple = tuples[k];
        var x: array<vec3f, N>;
        for (var i = 0u; i < N; i++) {
            x[i] = vertices[tuple[i]].xyz;
        }
        var found = eval(x, params[k]);
        let c = exact(found.c);
        let g = exact3(found.grad[corner]);
        let stiffness = shape[k].x;
        let kg = exact3(g * stiffness);
        let stretch = max(c, 0.0);
        let size = stretch + shape[k].y;
        let sized = size > 0.0;
        let ratio = select(0.0, stretch / select(1.0, size, sized), sized);
        let curvature = exact(stiffness * (dot(g, g) * ratio));
        force = force - exact3(kg * c);
        diagonal = diagonal + (exact3(kg * g) + vec3f(curvature));
        mixed = mixed + exact3(vec3f(kg.x * g.y, kg.x * g.z, kg.y * g.z));
    }
    forces[range.position].force = vec4f(force, 0.0);
    forces[range.position].diagonal = vec4f(diagonal, 0.0);
    forces[range.position].mixed = vec4f(mixed, 0.0);
}
