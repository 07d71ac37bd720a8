// Dihedral bending: two triangles keep the angle between them. The twin of `DihedralBending::eval`.
struct Params {
    rest: f32,
}

// 8 · machine epsilon. Below this value a direction is rounding noise.
const NOISE: f32 = 1.0 / 1048576.0;

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let e = x[1] - x[0];
    let d2 = x[2] - x[0];
    let d3 = x[3] - x[0];
    let n1 = cross(e, d2);
    let n2 = cross(d3, e);
    let ee = dot(e, e);
    let n1n1 = dot(n1, n1);
    let n2n2 = dot(n2, n2);
    let noise_squared = NOISE * NOISE;
    let defined = n1n1 > (noise_squared * ee) * dot(d2, d2) && n2n2 > (noise_squared * ee) * dot(d3, d3);
    let m1 = n1 * select(0.0, 1.0 / sqrt(select(1.0, n1n1, defined)), defined);
    let m2 = n2 * select(0.0, 1.0 / sqrt(select(1.0, n2n2, defined)), defined);
    let sum = m1 + m2;
    let two_cosines = sqrt(dot(sum, sum));
    let length = sqrt(ee);
    let sine = dot(cross(m1, m2), e) * select(0.0, 1.0 / select(1.0, length, defined), defined);
    let open = two_cosines > NOISE;
    let bend = select(0.0, (sine + sine) / select(1.0, two_cosines, open), open);
    let steepness = -(two_cosines * 0.5) * length;
    let grad2 = n1 * select(0.0, steepness / select(1.0, n1n1, defined), defined);
    let grad3 = n2 * select(0.0, steepness / select(1.0, n2n2, defined), defined);
    let s2 = select(0.0, dot(d2, e) / select(1.0, ee, defined), defined);
    let s3 = select(0.0, dot(d3, e) / select(1.0, ee, defined), defined);
    let grad1 = -(grad2 * s2 + grad3 * s3);
    let grad0 = -(grad2 * (1.0 - s2) + grad3 * (1.0 - s3));
    return Eval(bend - p.rest, array<vec3f, N>(grad0, grad1, grad2, grad3));
}
