// The numbers of a substep. The twin of `Integrator`.
struct Settings {
    gravity_h: vec3f,
    h: f32,
    velocity_factor: f32,
    inverse_h_squared: f32,
}
