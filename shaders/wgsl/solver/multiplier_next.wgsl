// A later iteration. The multiplier continues from the iteration before.
@group(1) @binding(3) var<storage, read_write> multipliers: array<f32>;

fn multiplier_of(k: u32) -> f32 {
    return multipliers[k];
}

fn keep_multiplier(k: u32, multiplier: f32) {
    multipliers[k] = multiplier;
}
