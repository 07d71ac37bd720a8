// A tet among the voxels: the side of its faces on which a voxel center lies, within f32 rounding.
//
// All distances start at a corner of the tet, so that the accuracy does not depend on the distance
// to the origin. Component c of a vec4f belongs to the face opposite corner c.

// Places of the four corners.
struct Corners {
    a: vec3f,
    b: vec3f,
    c: vec3f,
    d: vec3f,
}

struct Tet {
    // A corner on each face: the second corner for the first face, and the first corner for the
    // others.
    base_x: vec4f, base_y: vec4f, base_z: vec4f,
    // Inward normals, each as long as twice the area of its face.
    normal_x: vec4f, normal_y: vec4f, normal_z: vec4f,
    // Six times the volume. This is also the height of each corner over its face.
    volume: f32,
    // Bound of a computed height whose exact value is zero, and of a point within the tolerance.
    rounding: vec4f,
    near: vec4f,
}

// Bound of the error of a height over |edge| · |edge| · reach: 16 roundings of 2⁻²⁴. The
// differences, products and sums of a cross product contribute at most 5.7, and the dot product 4.
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
fn volume_of(p: Corners) -> f32 {
    return dot_3(p.b - p.a, cross_3(p.c - p.a, p.d - p.a));
}

fn tet_of(p: Corners, tolerance: f32) -> Tet {
    let a = p.a;
    let b = p.b;
    let ab = b - a;
    let ac = p.c - a;
    let ad = p.d - a;
    let bc = p.c - b;
    let bd = p.d - b;
    let n0 = cross_3(bd, bc);
    let n1 = cross_3(ac, ad);
    let n2 = cross_3(ad, ab);
    let n3 = cross_3(ab, ac);
    let signed = dot_3(ab, n1);
    let inwards = select(-1.0, 1.0, signed > 0.0);
    let size = max(max(a, b), max(p.c, p.d)) - min(min(a, b), min(p.c, p.d));
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

// False for a tet whose volume is within rounding of zero or exceeds f32. It holds no voxel center.
fn has_volume(tet: Tet) -> bool {
    return is_finite(tet.volume) && is_finite(tet.near.x + ((tet.near.y + tet.near.z) + tet.near.w))
        && tet.volume > tet.rounding.y;
}

// The part of the heights that all points of a row along x have in common.
fn row_of(tet: Tet, y: f32, z: f32) -> vec4f {
    return tet.normal_y * (vec4f(y) - tet.base_y) + tet.normal_z * (vec4f(z) - tet.base_z);
}

// Heights over the four faces, times twice their areas. Divided by `volume` they are the
// barycentric coordinates.
fn heights(tet: Tet, row: vec4f, x: f32) -> vec4f {
    return tet.normal_x * (vec4f(x) - tet.base_x) + row;
}
