// The way between two levels.
@group(1) @binding(0) var<storage, read> x: array<vec4f>;
@group(1) @binding(1) var<storage, read_write> to: array<f32>;

fn product_at(place: Place) -> f32 {
    let end = starts[place.slice + 1u];
    var sum = 0.0;
    for (var block = starts[place.slice]; block < end; block++) {
        sum += row_times(row_of(place, block), unknowns_of(column_of(place, block)));
    }
    return sum;
}

// Writes the transposed prolongation times a vector.
@compute @workgroup_size(64)
fn restriction(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    let found = product_at(place);
    if (place.exists) {
        to[place.number] = found;
    }
}

// Adds the prolongation of a vector.
@compute @workgroup_size(64)
fn prolongation(@builtin(workgroup_id) slice: vec3u, @builtin(local_invocation_index) thread: u32) {
    let place = place_of(slice.x, thread);
    let found = product_at(place);
    if (place.exists) {
        to[place.number] += found;
    }
}
