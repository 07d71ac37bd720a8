// A constant force on each vertex, in N.
@group(0) @binding(6) var<storage, read> loads: array<vec4f>;

fn load_of(i: u32) -> vec3f {
    return loads[i].xyz;
}
