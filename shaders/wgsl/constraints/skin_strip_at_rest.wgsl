// Skin strip of a body at rest in the scan. The same operations as `SkinStripAtRest::eval`.
fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let image = strip_image(x, p.b1, p.b2, vec3f(p.rise_x, p.rise_y, p.rise_z));
    let length = sqrt(dot(image, image));
    let s = length - p.rest_length;
    let e = length - p.scan_length;
    let t0 = p.scan_length - p.rest_length;
    let slack = s < 0.0;
    let slack_square = exact((p.compression * s) * s) + exact(t0 * (t0 - 2.0 * s));
    let limit = (2.0 * (t0 - p.compression * s)) * inverse_or_zero((t0 - s) * slack_square);
    let slack_reach = select(0.0, limit, slack && (1.0 - p.compression) * t0 > 0.0);
    inverse_reach_squared = max(slack_reach, strip_reach(length, p.scan_length));
    let growth = (p.stiffening * inverse_or_zero(p.scan_length)) * max(e, 0.0);
    let q = sqrt(select(1.0 + (1.0 / 3.0) * growth, slack_square, slack));
    let slope = select(1.0 + 0.5 * growth, t0 - p.compression * s, slack) * inverse_or_zero(q);
    let c = q * select(e, -1.0, slack);
    return Eval(c, strip_gradients(image * (inverse_or_zero(length) * slope), p.b1, p.b2));
}
