// One thread per ray. xyz of a ray is its start as a continuous index, and w is its length in
// steps, negative for a ray that misses the volume. The result is the linear light. Its w is the
// number of steps to the surface, or −1 if the ray does not hit the surface.

@group(0) @binding(4) var<storage, read> rays: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> found: array<vec4f>;

@compute @workgroup_size(64)
fn raymarch(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= arrayLength(&rays)) {
        return;
    }
    let ray = rays[id.x];
    let n = march(ray.xyz, ray.w);
    let index = ray.xyz + view.step * n;
    var light = vec3f(0.0);
    if (n == 0.0) {
        light = cut_face(index);
    } else if (n > 0.0) {
        light = surface(index);
    }
    found[id.x] = vec4f(light, n);
}
