// Turn of a skin strip against its load in the scan. The same operations as `SkinStripTurn::eval`.
struct Params {
    b1: f32,
    b2: f32,
    scan_x: f32,
    scan_y: f32,
    scan_z: f32,
    stretch: f32,
    rise_x: f32,
    rise_y: f32,
    rise_z: f32,
}

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let scan = vec3f(p.scan_x, p.scan_y, p.scan_z);
    let scan_length = sqrt(dot(scan, scan));
    let scan_direction = scan * inverse_or_zero(scan_length);
    let image = strip_image(x, p.b1, p.b2, vec3f(p.rise_x, p.rise_y, p.rise_z));
    let length = sqrt(dot(image, image));
    let along = dot(scan_direction, image);
    let moved = select(image, image - scan, 2.0 * length > scan_length);
    let across = moved - scan_direction * dot(scan_direction, moved);
    let ahead = dot(across, across) * inverse_or_zero(length + along);
    let eta = select(length - along, ahead, along > 0.0);
    let c = sqrt((2.0 * p.stretch) * eta);
    let turned = (across - scan_direction * eta) * inverse_or_zero(length);
    return Eval(c, strip_gradients(turned * (p.stretch * inverse_or_zero(c)), p.b1, p.b2));
}
