// Columns with three unknowns, in vectors with four numbers per node.
const COLUMN_UNKNOWNS: u32 = 3u;

alias Unknowns = vec3f;

fn unknowns_of(node: u32) -> Unknowns {
    return x[node].xyz;
}

fn difference(a: Unknowns, b: Unknowns) -> Unknowns {
    return a - b;
}

// A row of a block, from its first number on, times the unknowns of a node.
fn row_times(first: u32, of_node: Unknowns) -> f32 {
    return values[first] * of_node.x + values[first + HEIGHT] * of_node.y
        + values[first + 2u * HEIGHT] * of_node.z;
}
