// Each voxel of the slab gets its value: a voxel with an owner from the rest shape, a voxel that
// the body left becomes air, and the others keep their value. A thread fills two voxels, the halves
// of one word. A dispatch fills the voxels that the tets of its chunk own, if the chunk touches the
// slab. The dispatch of the first chunk also fills the voxels without an owner.
@group(0) @binding(0) var<uniform> grid: Grid;
@group(0) @binding(1) var<uniform> slab: Slab;
@group(0) @binding(2) var<storage, read> owners: array<u32>;
@group(0) @binding(3) var<storage, read> marks: array<u32>;
@group(0) @binding(4) var<storage, read_write> counters: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> values: array<u32>;
@group(0) @binding(6) var source: texture_3d<i32>;
@group(0) @binding(7) var<storage, read> reaches: array<vec2u>;
@group(1) @binding(2) var<storage, read> places: array<vec4f>;
@group(1) @binding(3) var<storage, read> rest_places: array<vec4f>;

const NONE: u32 = 0xffffffffu;
const NEAR: u32 = 0x80000000u;

// Numbers of moved, vacated and folded voxels.
var<workgroup> counted: array<atomic<u32>, 3>;

fn mark(plane: u32, voxel: u32) -> u32 {
    return (marks[plane * ((slab.voxels + 31u) / 32u) + voxel / 32u] >> (voxel & 31u)) & 1u;
}

fn voxel_at(i: i32, j: i32, k: i32) -> i32 {
    return textureLoad(source, vec3i(i, j, k), 0).x;
}

fn is_padding(value: i32) -> bool {
    return value < grid.scanned_low || value > grid.scanned_high;
}

fn between(a: f32, b: f32, fraction: f32) -> f32 {
    return a + fraction * (b - a);
}

// The trilinear value at a place, rounded to the nearest stored value, halves upwards. Next to
// other values, padding counts as the nearest value that is not padding.
fn trilinear(place: vec3f) -> i32 {
    let first = vec3f(grid.first_x, grid.first_y, grid.first_z);
    let last = vec3f(grid.last_x, grid.last_y, grid.last_z);
    let at = clamp(place, first, last);
    let low = floor(at);
    let f = at - low;
    let center = vec3i(grid.center_i, grid.center_j, grid.center_k);
    let l = vec3i(low) + center;
    let h = min(l + vec3i(1), vec3i(last) + center);
    var v = array<i32, 8>(
        voxel_at(l.x, l.y, l.z), voxel_at(h.x, l.y, l.z), voxel_at(l.x, h.y, l.z), voxel_at(h.x, h.y, l.z),
        voxel_at(l.x, l.y, h.z), voxel_at(h.x, l.y, h.z), voxel_at(l.x, h.y, h.z), voxel_at(h.x, h.y, h.z),
    );
    var padding = 0u;
    for (var n = 0u; n < 8u; n++) {
        padding += select(0u, 1u, is_padding(v[n]));
    }
    if padding > 0u && padding < 8u {
        if all(f == vec3f(0.0)) {
            return v[0];
        }
        for (var n = 0u; n < 8u; n++) {
            v[n] = clamp(v[n], grid.scanned_low, grid.scanned_high);
        }
    }
    let y0 = between(between(f32(v[0]), f32(v[1]), f.x), between(f32(v[2]), f32(v[3]), f.x), f.y);
    let y1 = between(between(f32(v[4]), f32(v[5]), f.x), between(f32(v[6]), f32(v[7]), f.x), f.y);
    return i32(floor(between(y0, y1, f.z) + 0.5));
}

// The rest place of a point in a deformed tet. A point just outside is moved into the tet, even a
// very thin one.
fn rest_place(corners: vec4u, point: vec3f, held: bool) -> vec3f {
    let tet = tet_of(corners_of(corners), grid.tolerance);
    let height = heights(tet, row_of(tet, point.y, point.z), point.x);
    let inner = max(height, vec4f(0.0));
    let sum = ((inner.x + inner.y) + inner.z) + inner.w;
    let whole = select(sum, tet.volume, held);
    let share = select(inner, height, held) / select(1.0, whole, whole > 0.0);
    let a = rest_places[corners.x].xyz;
    let ab = rest_places[corners.y].xyz - a;
    let ac = rest_places[corners.z].xyz - a;
    let ad = rest_places[corners.w].xyz - a;
    return a + ((ab * share.y + ac * share.z) + ad * share.w);
}

@compute @workgroup_size(64)
fn gather(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    var moved = 0u;
    var vacated = 0u;
    var folds = 0u;
    let reach = reaches[chunk.list];
    let serves = chunk.first == 0u || touches(slab, reach.x, reach.y);
    let pairs = select(0u, (slab.voxels + 1u) / 2u, serves);
    for (var pair = id.x; pair < pairs; pair += groups.x * 64u) {
        var word = values[pair];
        for (var half = 0u; half < 2u; half++) {
            let voxel = 2u * pair + half;
            if voxel >= slab.voxels {
                break;
            }
            let i = voxel % grid.columns;
            let j = (voxel / grid.columns) % grid.rows;
            let k = slab.first + voxel / (grid.columns * grid.rows);
            let point = vec3f(grid.region_x + f32(i), grid.region_y + f32(j), grid.region_z + f32(k));
            let input = vec3i(point) + vec3i(grid.center_i, grid.center_j, grid.center_k);
            let owner = owners[voxel];
            let t = (owner & ~NEAR) - chunk.first;
            var value = 0;
            if owner == NONE {
                if chunk.first != 0u {
                    continue;
                }
                let gone = mark(3u, voxel);
                value = select(voxel_at(input.x, input.y, input.z), grid.air, gone != 0u);
                vacated += gone;
            } else {
                if t >= chunk.count {
                    continue;
                }
                let corners = tets[t];
                folds += mark(1u, voxel) & mark(2u, voxel);
                if has_moved(corners) {
                    moved += 1u;
                    value = trilinear(rest_place(corners, point, (owner & NEAR) == 0u));
                } else {
                    value = voxel_at(input.x, input.y, input.z);
                }
            }
            let shift = 16u * half;
            word = (word & ~(0xffffu << shift)) | ((u32(value) & 0xffffu) << shift);
        }
        values[pair] = word;
    }
    atomicAdd(&counted[0], moved);
    atomicAdd(&counted[1], vacated);
    atomicAdd(&counted[2], folds);
    workgroupBarrier();
    if lane < 3u {
        atomicAdd(&counters[slab.counts + lane], atomicLoad(&counted[lane]));
    }
}
