// The volume, its region to fill, and the map from positions to voxels.
//
// A place is a voxel index relative to the voxel `center` of the volume, so that the numbers are
// small near the body.
struct Grid {
    // place = linear · position + offset
    xx: f32, xy: f32, xz: f32,
    yx: f32, yy: f32, yz: f32,
    zx: f32, zy: f32, zz: f32,
    offset_x: f32, offset_y: f32, offset_z: f32,
    // Accuracy of a position in voxels.
    tolerance: f32,
    // The region: the place of its first voxel, and its shape.
    region_x: f32, region_y: f32, region_z: f32,
    columns: u32, rows: u32, slices: u32,
    // The volume: the places of its first and last voxel, and the voxel at place zero.
    first_x: f32, first_y: f32, first_z: f32,
    last_x: f32, last_y: f32, last_z: f32,
    center_i: i32, center_j: i32, center_k: i32,
    // Stored values: air for vacated voxels, and the range of values that are not padding.
    air: i32, scanned_low: i32, scanned_high: i32,
    unused: u32,
}

// The slices of the region that one pass fills.
struct Slab {
    first: u32,
    slices: u32,
    voxels: u32,
    // Number of lists of large tets. `large` starts with their lengths.
    lists: u32,
    // Index of the first count of this slab in `counters`.
    counts: u32,
    unused_1: u32, unused_2: u32, unused_3: u32,
}

// Tets in one buffer.
struct Chunk {
    // Index of the first tet among all tets.
    first: u32,
    count: u32,
    // Number of tets of the body, which come first.
    body: u32,
    // Index of the list of large tets.
    list: u32,
}

// True if slices `first..end` touch the slab.
fn touches(slab: Slab, first: u32, end: u32) -> bool {
    return first < slab.first + slab.slices && end > slab.first;
}

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn is_finite_3(x: vec3f) -> bool {
    return is_finite(x.x) && is_finite(x.y) && is_finite(x.z);
}
