// One stiffness for all constraints of a kind.
@group(1) @binding(2) var<uniform> stiffness: f32;

fn stiffness_of(k: u32) -> f32 {
    return stiffness;
}
