// Constants of a substep, as in `Integrator`.
struct Settings {
    gravity_h: vec3f,
    h: f32,
    velocity_factor: f32,
    inverse_h_squared: f32,
    load_h: f32,
}
