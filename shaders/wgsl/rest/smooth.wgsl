// Chebyshev smoothing in stages, as `sweep.rs` of the crate cutis-rest has it. A stage reads at the
// neighbors what the stage before has written.

// The factors of a change of the solution.
struct Factors {
    // For the change before.
    old: f32,
    // For the inverse of the diagonal times the residual.
    step: f32,
    unused_1: f32, unused_2: f32,
}

// The vector that a matrix applies to: the solution, or the change before.
@group(1) @binding(0) var<storage, read> x: array<vec4f>;
@group(1) @binding(1) var<storage, read> right: array<f32>;
@group(1) @binding(2) var<storage, read_write> residual: array<f32>;
// The next change, or the product.
@group(1) @binding(3) var<storage, read_write> next: array<f32>;
// The first change.
@group(1) @binding(4) var<storage, read> change: array<f32>;
@group(1) @binding(5) var<storage, read_write> solution: array<f32>;
@group(1) @binding(6) var<uniform> factors: Factors;
// The nodes of a patch: a matrix with some rows of another one, which belong to these nodes.
@group(1) @binding(7) var<storage, read> nodes: array<u32>;

// The block on the diagonal, its inverse, and the first one of the neighbors.
const OWN: u32 = 0u;
const INVERSE: u32 = 1u;
const NEIGHBORS: u32 = 2u;

var<workgroup> numbers: array<f32, 64>;

// The matrix times `x`.
fn product_at(place: Place) -> f32 {
    return product_of(place, place.node);
}

// The row of a place times `x`, which belongs to a node.
fn product_of(place: Place, node: u32) -> f32 {
    let own_block = starts[place.slice] + OWN;
    let end = starts[place.slice + 1u];
    let own = unknowns_of(node);
    var sum = 0.0;
    for (var block = starts[place.slice] + NEIGHBORS; block < end; block++) {
        let neighbor = unknowns_of(column_of(place, block));
        sum += row_times(row_of(place, block), relative(neighbor, own));
    }
    // Last, because it may be much larger. Coming first, it would round off all others.
    return sum + row_times(row_of(place, own_block), own);
}

// The inverse of the diagonal times a vector, of which each thread has its number. All threads of
// the workgroup must call this.
fn inverse_times(place: Place, thread: u32, number: f32) -> f32 {
    numbers[thread] = number;
    workgroupBarrier();
    let node = thread - thread % ROW_LANES;
    let first = row_of(place, starts[place.slice] + INVERSE);
    var sum = 0.0;
    for (var n = 0u; n < ROW_UNKNOWNS; n++) {
        sum += values[first + n * HEIGHT] * numbers[node + n];
    }
    return sum;
}

// The number of `x` that belongs to a thread.
fn own_number(place: Place) -> f32 {
    return x[place.number / 4u][place.number % 4u];
}

// Writes the residual and the next change, after the change or solution `x`. All threads of the
// workgroup must call this.
fn write_change(place: Place, thread: u32, rest: f32) {
    let step = inverse_times(place, thread, rest);
    if (place.exists) {
        residual[place.number] = rest;
        next[place.number] = factors.old * own_number(place) + factors.step * step;
    }
}

// Writes a multiple of the inverse of the diagonal times the right-hand side to the solution.
@compute @workgroup_size(64)
fn start(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    let all = select(0.0, right[place.number], place.exists);
    let step = inverse_times(place, thread, all);
    if (place.exists) {
        solution[place.number] = factors.step * step;
    }
}

// Writes the residual of the solution `x`, and the first change.
@compute @workgroup_size(64)
fn first(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    let rest = select(0.0, right[place.number], place.exists) - product_at(place);
    write_change(place, thread, rest);
}

// Subtracts the product with the change `x` from the residual, and writes the next change.
@compute @workgroup_size(64)
fn second(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    let rest = select(0.0, residual[place.number], place.exists) - product_at(place);
    write_change(place, thread, rest);
}

// Subtracts the product with the second change `x` from the residual. Adds the first, the second
// and a third change to the solution.
@compute @workgroup_size(64)
fn third(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    let rest = select(0.0, residual[place.number], place.exists) - product_at(place);
    let step = inverse_times(place, thread, rest);
    if (place.exists) {
        residual[place.number] = rest;
        let second = own_number(place);
        let third = factors.old * second + factors.step * step;
        solution[place.number] = ((solution[place.number] + change[place.number]) + second) + third;
    }
}

// Writes the matrix times `x`.
@compute @workgroup_size(64)
fn product(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    let found = product_at(place);
    if (place.exists) {
        next[place.number] = found;
    }
}

// The number of a vector of the whole matrix for a number of a patch.
fn whole_number(place: Place) -> u32 {
    return nodes[place.node] * ROW_LANES + place.number % ROW_LANES;
}

// Writes the residual at the nodes of a patch to a vector of the patch.
@compute @workgroup_size(64)
fn gather(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    if (place.exists) {
        next[place.number] = residual[whole_number(place)];
    }
}

// Adds the vector `x` of a patch to the solution.
@compute @workgroup_size(64)
fn scatter(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    if (place.exists) {
        solution[whole_number(place)] += own_number(place);
    }
}

// Writes the residual of the solution `x` at the nodes of a patch.
@compute @workgroup_size(64)
fn residual_at_nodes(
    @builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32
) {
    let place = place_of(slice.x, thread);
    let product = product_of(place, nodes[place.node]);
    if (place.exists) {
        let number = whole_number(place);
        residual[number] = right[number] - product;
    }
}
