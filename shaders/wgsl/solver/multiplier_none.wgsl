// One iteration: the multiplier begins at zero and is not kept.
fn multiplier_of(k: u32) -> f32 {
    return 0.0;
}

fn keep_multiplier(k: u32, multiplier: f32) {
}
