// The parameters of a skin strip, in the order of `skin_strip::params`.
struct Params {
    b1: f32,
    b2: f32,
    rest_length: f32,
    scan_length: f32,
    stiffening: f32,
    compression: f32,
    rise_x: f32,
    rise_y: f32,
    rise_z: f32,
}
