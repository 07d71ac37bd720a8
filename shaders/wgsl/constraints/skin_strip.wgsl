// Skin strip: tension along a direction of the skin. The same operations as `SkinStrip::eval`.
fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let image = strip_image(x, p.b1, p.b2, vec3f(p.rise_x, p.rise_y, p.rise_z));
    let length = sqrt(dot(image, image));
    inverse_reach_squared = strip_reach(length, p.scan_length);
    let s = length - p.rest_length;
    let e = max(length - p.scan_length, 0.0);
    let stretched = s > 0.0;
    let ratio = e * inverse_or_zero(s);
    let growth = (p.stiffening * inverse_or_zero(p.scan_length)) * e;
    let square = 1.0 + (((1.0 / 3.0) * growth) * ratio) * ratio;
    let q = sqrt(select(p.compression, square, stretched));
    let stiffness = select(p.compression, 1.0 + (0.5 * growth) * ratio, stretched);
    let slope = stiffness * inverse_or_zero(q);
    return Eval(s * q, strip_gradients(image * (inverse_or_zero(length) * slope), p.b1, p.b2));
}
