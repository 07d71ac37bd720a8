// One stiffness per constraint.
@group(1) @binding(2) var<storage, read> stiffness: array<f32>;

fn stiffness_of(k: u32) -> f32 {
    return stiffness[k];
}
