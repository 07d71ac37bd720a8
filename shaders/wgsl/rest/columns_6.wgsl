// Columns with six unknowns, in vectors with eight numbers per node.
const COLUMN_UNKNOWNS: u32 = 6u;

struct Unknowns {
    first: vec3f,
    last: vec3f,
}

fn unknowns_of(node: u32) -> Unknowns {
    let first = x[2u * node];
    let last = x[2u * node + 1u];
    return Unknowns(first.xyz, vec3f(first.w, last.xy));
}

// A row of a block, from its first number on, times the unknowns of a node.
fn row_times(first: u32, of_node: Unknowns) -> f32 {
    return (values[first] * of_node.first.x + values[first + HEIGHT] * of_node.first.y
        + values[first + 2u * HEIGHT] * of_node.first.z)
        + (values[first + 3u * HEIGHT] * of_node.last.x + values[first + 4u * HEIGHT] * of_node.last.y
        + values[first + 5u * HEIGHT] * of_node.last.z);
}
