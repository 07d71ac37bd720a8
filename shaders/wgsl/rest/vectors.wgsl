// The vectors of conjugate gradients, with three unknowns and a zero for each node. A workgroup
// takes some nodes and writes their share of inner products. The host adds these up.
struct Factor {
    // The length of a step, or the ratio of two.
    factor: f32,
    unused_1: f32, unused_2: f32, unused_3: f32,
}

@group(0) @binding(0) var<uniform> scalar: Factor;
@group(0) @binding(1) var<storage, read_write> x: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> residual: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> direction: array<vec4f>;
// The matrix times the direction.
@group(0) @binding(4) var<storage, read_write> product: array<vec4f>;
// The preconditioned residual, and the matrix times it.
@group(0) @binding(5) var<storage, read> z: array<vec4f>;
@group(0) @binding(6) var<storage, read> z_product: array<vec4f>;
// The inner products of each workgroup.
@group(0) @binding(7) var<storage, read_write> shares: array<vec4f>;

// Nodes of a thread, and of a workgroup.
const NODES_OF_THREAD: u32 = 16u;
const NODES: u32 = 64u * NODES_OF_THREAD;

var<workgroup> sums: array<vec4f, 64>;

// Writes the sum over the threads of a workgroup. All of them must call this.
fn write_share(group: u32, thread: u32, own: vec4f) {
    sums[thread] = own;
    workgroupBarrier();
    for (var half = 32u; half > 0u; half /= 2u) {
        if (thread < half) {
            sums[thread] += sums[thread + half];
        }
        workgroupBarrier();
    }
    if (thread == 0u) {
        shares[group] = sums[0];
    }
}

// The last node of a thread, and one more.
fn end_of(group: u32) -> u32 {
    return min((group + 1u) * NODES, arrayLength(&z));
}

// Begins at zero, along the preconditioned residual. Products: the residual times it, and it times
// the matrix times it.
@compute @workgroup_size(64)
fn begin(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let end = end_of(group.x);
    var own = vec4f();
    for (var node = group.x * NODES + thread; node < end; node += 64u) {
        x[node] = vec4f();
        direction[node] = z[node];
        product[node] = z_product[node];
        own.x += dot(residual[node], z[node]);
        own.y += dot(z[node], z_product[node]);
    }
    write_share(group.x, thread, own);
}

// Moves along the direction.
@compute @workgroup_size(64)
fn advance(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let end = min((group.x + 1u) * NODES, arrayLength(&x));
    for (var node = group.x * NODES + thread; node < end; node += 64u) {
        x[node] += scalar.factor * direction[node];
        residual[node] -= scalar.factor * product[node];
    }
}

// Products: the square of `x`, and the residual times the preconditioned one.
@compute @workgroup_size(64)
fn measure(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let end = end_of(group.x);
    var own = vec4f();
    for (var node = group.x * NODES + thread; node < end; node += 64u) {
        own.x += dot(x[node], x[node]);
        own.y += dot(residual[node], z[node]);
    }
    write_share(group.x, thread, own);
}

// Turns the direction. Products: the square of the old one, the old one times the new one, and the
// new one times the matrix times it.
@compute @workgroup_size(64)
fn turn(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let end = end_of(group.x);
    var own = vec4f();
    for (var node = group.x * NODES + thread; node < end; node += 64u) {
        let old = direction[node];
        let turned = z[node] + scalar.factor * old;
        let turned_product = z_product[node] + scalar.factor * product[node];
        direction[node] = turned;
        product[node] = turned_product;
        own += vec4f(dot(old, old), dot(old, turned), dot(turned, turned_product), 0.0);
    }
    write_share(group.x, thread, own);
}
