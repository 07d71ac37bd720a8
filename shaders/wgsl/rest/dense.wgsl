// A dense matrix times a vector. A workgroup computes a row.
struct Dense {
    // Number of rows and of columns.
    size: u32,
    // Unknowns of a node, and the numbers that a vector has for them.
    unknowns: u32,
    lanes: u32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> dense: Dense;
// One row after the other.
@group(0) @binding(1) var<storage, read> matrix: array<f32>;
@group(0) @binding(2) var<storage, read> x: array<f32>;
@group(0) @binding(3) var<storage, read_write> to: array<f32>;

var<workgroup> sums: array<f32, 64>;

// The number of an unknown in a vector.
fn number_of(unknown: u32) -> u32 {
    return dense.lanes * (unknown / dense.unknowns) + unknown % dense.unknowns;
}

@compute @workgroup_size(64)
fn times(@builtin(workgroup_id) row: vec3u, @builtin(local_invocation_index) thread: u32) {
    var sum = 0.0;
    for (var column = thread; column < dense.size; column += 64u) {
        sum += matrix[row.x * dense.size + column] * x[number_of(column)];
    }
    sums[thread] = sum;
    workgroupBarrier();
    for (var half = 32u; half > 0u; half /= 2u) {
        if (thread < half) {
            sums[thread] += sums[thread + half];
        }
        workgroupBarrier();
    }
    if (thread == 0u) {
        to[number_of(row.x)] = sums[0];
    }
}
