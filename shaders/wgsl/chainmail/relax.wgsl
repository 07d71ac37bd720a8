// Half a sweep of the ChainMail relaxation. It moves one coordinate of those elements of a slab
// whose i + j + k is even, or of those whose i + j + k is odd. The same operations as
// `Plane::relax`.
//
// All neighbors of such an element have the other parity, so that no thread reads an element that
// another thread writes. All numbers are integers, and sums wrap as in Rust.
struct Slab {
    // Number of elements of a row, rows of a plane, and planes.
    columns: u32,
    rows: u32,
    planes: u32,
    // Index of the first plane.
    first: u32,
    // Number of planes of the slab below.
    planes_below: u32,
    // Number of words of a plane in `elements`.
    pitch: u32,
    unused_1: u32, unused_2: u32,
}

// The coordinate and the parity of the elements to move.
struct Half {
    coordinate: u32,
    // 0 for elements with even i + j + k, 1 for odd.
    odd: u32,
    materials: u32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> slab: Slab;
// Two elements per word. The low byte of an element has its links and whether it is held, and the
// high byte its material. There is an additional plane at each end.
@group(0) @binding(1) var<storage, read> elements: array<u32>;
@group(0) @binding(2) var<storage, read_write> x: array<i32>;
@group(0) @binding(3) var<storage, read> below: array<i32>;
@group(0) @binding(4) var<storage, read> above: array<i32>;
@group(1) @binding(0) var<uniform> half: Half;
// Lowest and highest difference along a link, by the pair of materials at its ends and its axis.
@group(1) @binding(1) var<storage, read> bounds: array<vec2i>;
// The smallest displacement of an element, by material. Smaller ones are ignored.
@group(1) @binding(2) var<storage, read> least: array<i32>;
// Numbers of elements that moved in the sweep before and in this one, with one word per coordinate
// and parity, so that no word overflows.
@group(2) @binding(0) var<storage, read_write> moved: array<atomic<u32>, 128>;

// Number of words of a sweep in `moved`.
const SWEEP: u32 = 64u;
const HALVES: u32 = 6u;
const NO_MATERIAL: u32 = 255u;
// Bits of an element: links to the next elements along each axis, links to the previous elements,
// and two bits for fixed and grabbed elements.
const AFTER: u32 = 1u;
const BEFORE: u32 = 8u;
const HELD: u32 = 192u;
// Rest length of a link.
const STEP: i32 = 65536;
// Larger than the sum of the requests of six neighbors within their bounds, and small enough to be
// doubled.
const MOST_ASKED: u32 = 1073741824u;

var<workgroup> goes_on: u32;
var<workgroup> moved_here: atomic<u32>;

// The requests of the neighbors of an element: their number, the sum of the requested
// displacements, and the interval of displacements that keep all links within their bounds.
struct Asked {
    count: u32,
    sum: i32,
    lowest: i32,
    highest: i32,
}

// Bits and material of an element. Plane 0 is the plane below the slab.
fn element(plane: u32, place: u32) -> u32 {
    return (elements[plane * slab.pitch + place / 2u] >> (16u * (place & 1u))) & 0xffffu;
}

// Adds the request of a neighbor along `axis` at the difference `apart`. `pairs` is the index of
// the first pair of the element's material.
fn ask(so_far: Asked, apart: i32, pairs: u32, neighbor: u32, axis: u32, after: bool) -> Asked {
    let bound = bounds[3u * (pairs + (neighbor >> 8u)) + axis];
    let rest = select(0, STEP, axis == half.coordinate);
    let asked = apart + select(rest, -rest, after);
    let low = apart + select(bound.x, -bound.y, after);
    let high = apart + select(bound.y, -bound.x, after);
    return Asked(so_far.count + 1u, so_far.sum + asked, max(so_far.lowest, low), min(so_far.highest, high));
}

// The mean, rounded to the nearest integer, with ties toward 0.
fn mean(sum: i32, count: u32) -> i32 {
    let size = min(select(u32(sum), 0u - u32(sum), sum < 0), MOST_ASKED);
    let nearest = i32((2u * size + count - 1u) / (2u * count));
    return select(nearest, -nearest, sum < 0);
}

// The displacement of an element.
fn way(asked: Asked, k: i32) -> i32 {
    // An element with a link beyond its bounds does not move, because a displacement that keeps the
    // other links within their bounds may not exist.
    if (asked.count == 0u || asked.lowest > 0 || asked.highest < 0) {
        return 0;
    }
    let by = mean(asked.sum, asked.count);
    return select(max(min(by, asked.highest), asked.lowest), 0, abs(by) < k);
}

// Moves one element of this parity. Returns 1 if it moved.
fn relax_one(number: u32) -> u32 {
    let columns = (slab.columns + 1u) / 2u;
    let row = number / columns;
    let j = row % slab.rows;
    let k = row / slab.rows;
    let i = 2u * (number % columns) + ((slab.first + k + j + half.odd) & 1u);
    if (i >= slab.columns) {
        return 0u;
    }
    let place = i + slab.columns * j;
    let own = element(k + 1u, place);
    if ((own >> 8u) == NO_MATERIAL || (own & HELD) != 0u) {
        return 0u;
    }
    let plane = slab.columns * slab.rows;
    let at = place + plane * k;
    let here = x[at];
    let pairs = (own >> 8u) * half.materials;
    var asked = Asked(0u, 0, -2147483647 - 1, 2147483647);
    if ((own & AFTER) != 0u) {
        asked = ask(asked, x[at + 1u] - here, pairs, element(k + 1u, place + 1u), 0u, true);
    }
    if ((own & BEFORE) != 0u) {
        asked = ask(asked, x[at - 1u] - here, pairs, element(k + 1u, place - 1u), 0u, false);
    }
    if ((own & (AFTER << 1u)) != 0u) {
        let next = place + slab.columns;
        asked = ask(asked, x[at + slab.columns] - here, pairs, element(k + 1u, next), 1u, true);
    }
    if ((own & (BEFORE << 1u)) != 0u) {
        let next = place - slab.columns;
        asked = ask(asked, x[at - slab.columns] - here, pairs, element(k + 1u, next), 1u, false);
    }
    if ((own & (AFTER << 2u)) != 0u) {
        var there = 0;
        if (k + 1u < slab.planes) {
            there = x[at + plane];
        } else {
            there = above[place];
        }
        asked = ask(asked, there - here, pairs, element(k + 2u, place), 2u, true);
    }
    if ((own & (BEFORE << 2u)) != 0u) {
        var there = 0;
        if (k > 0u) {
            there = x[at - plane];
        } else {
            there = below[place + plane * (slab.planes_below - 1u)];
        }
        asked = ask(asked, there - here, pairs, element(k, place), 2u, false);
    }
    let by = way(asked, least[own >> 8u]);
    x[at] = here + by;
    return select(0u, 1u, by != 0);
}

// True if any element moved in the sweep before.
fn moved_before() -> bool {
    var any = 0u;
    for (var word = 0u; word < HALVES; word++) {
        any = any | atomicLoad(&moved[word]);
    }
    return any != 0u;
}

@compute @workgroup_size(64)
fn relax(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(num_workgroups) groups: vec3u,
) {
    if (local == 0u) {
        goes_on = select(0u, 1u, moved_before());
    }
    if (workgroupUniformLoad(&goes_on) == 0u) {
        return;
    }
    let threads = groups.x * 64u;
    let count = (slab.columns + 1u) / 2u * slab.rows * slab.planes;
    var moves = 0u;
    for (var number = id.x; number < count; number += threads) {
        moves += relax_one(number);
    }
    atomicAdd(&moved_here, moves);
    workgroupBarrier();
    if (local == 0u) {
        atomicAdd(&moved[SWEEP + 2u * half.coordinate + half.odd], atomicLoad(&moved_here));
    }
}
