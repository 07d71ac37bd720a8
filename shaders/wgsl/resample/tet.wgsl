// A tet over the voxels: on which side of its faces a center lies, as far as f32 can tell.
//
// Everything is measured from a corner of the tet, so that it is as exact far from the origin as near it. Component c of a
// vec4f belongs to the face opposite corner c.
struct Tet {
    // The corner that each face is measured from: the second corner for the first face, else the first one.
    base_x: vec4f, base_y: vec4f, base_z: vec4f,
    // Normals that point inwards, twice the area of the face long.
    normal_x: vec4f, normal_y: vec4f, normal_z: vec4f,
    // Six times the volume: the height of each corner over its face.
    volume: f32,
    // What the rounding of f32 can make of a height of zero, and that of a point just within the tolerance.
    rounding: vec4f,
    near: vec4f,
}

// Bound of the error of a height, over |edge| · |edge| · reach: 16 roundings of 2⁻²⁴. The differences, the products and the
// sum of a cross product make 5.7 at most, the dot product 4 more.
const ROUNDING: f32 = 9.5367431640625e-7;

fn dot_3(a: vec3f, b: vec3f) -> f32 {
    return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

fn cross_3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

fn length_3(a: vec3f) -> f32 {
    return sqrt(dot_3(a, a));
}

// Six times the signed volume.
fn volume_of(a: vec3f, b: vec3f, c: vec3f, d: vec3f) -> f32 {
    return dot_3(b - a, cross_3(c - a, d - a));
}

fn tet_of(a: vec3f, b: vec3f, c: vec3f, d: vec3f, tolerance: f32) -> Tet {
    let ab = b - a;
    let ac = c - a;
    let ad = d - a;
    let bc = c - b;
    let bd = d - b;
    let n0 = cross_3(bd, bc);
    let n1 = cross_3(ac, ad);
    let n2 = cross_3(ad, ab);
    let n3 = cross_3(ab, ac);
    let signed = dot_3(ab, n1);
    let inwards = select(-1.0, 1.0, signed > 0.0);
    let size = max(max(a, b), max(c, d)) - min(min(a, b), min(c, d));
    let reach = ((size.x + size.y) + size.z) + 4.0 * tolerance;
    let lengths = vec4f(
        length_3(bd) * length_3(bc),
        length_3(ac) * length_3(ad),
        length_3(ad) * length_3(ab),
        length_3(ab) * length_3(ac),
    );
    var tet: Tet;
    tet.base_x = vec4f(b.x, a.x, a.x, a.x);
    tet.base_y = vec4f(b.y, a.y, a.y, a.y);
    tet.base_z = vec4f(b.z, a.z, a.z, a.z);
    tet.normal_x = inwards * vec4f(n0.x, n1.x, n2.x, n3.x);
    tet.normal_y = inwards * vec4f(n0.y, n1.y, n2.y, n3.y);
    tet.normal_z = inwards * vec4f(n0.z, n1.z, n2.z, n3.z);
    tet.volume = inwards * signed;
    tet.rounding = (ROUNDING * reach) * lengths;
    tet.near = tolerance * vec4f(length_3(n0), length_3(n1), length_3(n2), length_3(n3)) + tet.rounding;
    return tet;
}

// False for a tet whose volume cannot be told from zero, or is beyond f32: it holds no center.
fn has_volume(tet: Tet) -> bool {
    return is_finite(tet.volume) && is_finite(tet.near.x + ((tet.near.y + tet.near.z) + tet.near.w))
        && tet.volume > tet.rounding.y;
}

// What the heights of the points of a row along x share.
fn row_of(tet: Tet, y: f32, z: f32) -> vec4f {
    return tet.normal_y * (vec4f(y) - tet.base_y) + tet.normal_z * (vec4f(z) - tet.base_z);
}

// Heights over the four faces, times twice their areas; over `volume` they are the barycentric coordinates.
fn heights(tet: Tet, row: vec4f, x: f32) -> vec4f {
    return tet.normal_x * (vec4f(x) - tet.base_x) + row;
}
