//! `tet.wgsl` and `box.wgsl`: a tet over the voxels, and the voxels that it may hold.

use cutis_resample::GridUniform;

/// Three components of a `vec3f`.
pub type Vec3 = [f32; 3];
/// Four components of a `vec4f`.
pub type Vec4 = [f32; 4];

/// A tet over the voxels, for finding the side of its faces on which a center lies. Component c of
/// a [`Vec4`] belongs to the face opposite corner c.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tet {
    /// The corner from which the height over each face is measured.
    pub base: [Vec4; 3],
    /// Normals that point inwards, with a length of twice the area of the face.
    pub normal: [Vec4; 3],
    /// Six times the volume.
    pub volume: f32,
    /// Bound of the rounding error of a height of zero.
    pub rounding: Vec4,
    /// Bound of the rounding error of a height just within the tolerance.
    pub near: Vec4,
}

/// Bound of the error of a height, relative to |edge| · |edge| · reach: 16 roundings of 2⁻²⁴.
pub const ROUNDING: f32 = 1.0 / (1 << 20) as f32;

fn sub(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|n| a[n] - b[n])
}

/// Reduces each component of four corners by `f32::min` or `f32::max`.
fn extreme(pick: fn(f32, f32) -> f32, [a, b, c, d]: [Vec3; 4]) -> Vec3 {
    std::array::from_fn(|n| pick(pick(a[n], b[n]), pick(c[n], d[n])))
}

fn dot_3(a: Vec3, b: Vec3) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

fn cross_3(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn length_3(a: Vec3) -> f32 {
    dot_3(a, a).sqrt()
}

/// Six times the signed volume.
pub fn volume_of(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> f32 {
    dot_3(sub(b, a), cross_3(sub(c, a), sub(d, a)))
}

/// The tet with these corners.
pub fn tet_of(a: Vec3, b: Vec3, c: Vec3, d: Vec3, tolerance: f32) -> Tet {
    let (ab, ac, ad) = (sub(b, a), sub(c, a), sub(d, a));
    let (bc, bd) = (sub(c, b), sub(d, b));
    let n0 = cross_3(bd, bc);
    let n1 = cross_3(ac, ad);
    let n2 = cross_3(ad, ab);
    let n3 = cross_3(ab, ac);
    let signed = dot_3(ab, n1);
    let inwards = if signed > 0.0 { 1.0 } else { -1.0 };
    let size = sub(extreme(f32::max, [a, b, c, d]), extreme(f32::min, [a, b, c, d]));
    let reach = ((size[0] + size[1]) + size[2]) + 4.0 * tolerance;
    let lengths = [
        length_3(bd) * length_3(bc),
        length_3(ac) * length_3(ad),
        length_3(ad) * length_3(ab),
        length_3(ab) * length_3(ac),
    ];
    let rounding = lengths.map(|length| (ROUNDING * reach) * length);
    let normals = [n0, n1, n2, n3];
    Tet {
        base: std::array::from_fn(|n| [b[n], a[n], a[n], a[n]]),
        normal: std::array::from_fn(|n| normals.map(|normal| inwards * normal[n])),
        volume: inwards * signed,
        rounding,
        near: std::array::from_fn(|c| tolerance * length_3(normals[c]) + rounding[c]),
    }
}

/// False if the volume cannot be distinguished from zero, or exceeds `f32`. Such a tet holds no
/// center.
pub fn has_volume(tet: &Tet) -> bool {
    tet.volume.is_finite()
        && (tet.near[0] + ((tet.near[1] + tet.near[2]) + tet.near[3])).is_finite()
        && tet.volume > tet.rounding[1]
}

/// The part of the heights that all points of a row along x share.
pub fn row_of(tet: &Tet, y: f32, z: f32) -> Vec4 {
    let [_, normal_y, normal_z] = tet.normal;
    let [_, base_y, base_z] = tet.base;
    std::array::from_fn(|c| normal_y[c] * (y - base_y[c]) + normal_z[c] * (z - base_z[c]))
}

/// Heights over the four faces, times twice their areas. Divided by `volume` they are the
/// barycentric coordinates.
pub fn heights(tet: &Tet, row: Vec4, x: f32) -> Vec4 {
    std::array::from_fn(|c| tet.normal[0][c] * (x - tet.base[0][c]) + row[c])
}

/// A box of voxels, with `first` included and `end` excluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VoxelBox {
    /// First voxel.
    pub first: [u32; 3],
    /// End, excluded; zero for an empty box.
    pub end: [u32; 3],
}

/// The voxels that the tet may hold or come near.
pub fn box_of(a: Vec3, b: Vec3, c: Vec3, d: Vec3, grid: &GridUniform) -> VoxelBox {
    let low = extreme(f32::min, [a, b, c, d]).map(|x| x - grid.tolerance);
    let high = extreme(f32::max, [a, b, c, d]).map(|x| x + grid.tolerance);
    let first: Vec3 = std::array::from_fn(|n| (low[n].ceil() - grid.region[n]).max(0.0));
    let end: Vec3 =
        std::array::from_fn(|n| (high[n].floor() - grid.region[n]).min((grid.shape[n] - 1) as f32));
    if (0..3).any(|n| first[n] > end[n]) {
        return VoxelBox { first: [0; 3], end: [0; 3] };
    }
    VoxelBox { first: first.map(|x| x as u32), end: end.map(|x| x as u32 + 1) }
}
