// A body without loads: only gravity acts from outside.
fn load_of(i: u32) -> vec3f {
    return vec3f(0.0);
}
