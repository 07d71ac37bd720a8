// The intersection of a ray with the surface, in steps from the start of the ray.

// Number of bisections of the step that crosses the surface.
const HALVINGS: u32 = 6u;
// Larger than the number of steps of any ray.
const FAR: f32 = 1e30;

@group(0) @binding(3) var<storage, read> largest: array<f32>;

// The number of steps until a ray at `position` leaves its block, or −1 if the block may contain
// surface.
fn free_steps(position: vec3f) -> f32 {
    let shape = block_shape(textureDimensions(volume));
    let block = min(vec3u(max(position, vec3f(0.0))) / SIDE, shape - 1u);
    if (largest[block.x + shape.x * (block.y + shape.y * block.z)] >= view.threshold_hu) {
        return -1.0;
    }
    let ahead = select(vec3u(0u), vec3u(1u), view.step > vec3f(0.0));
    let wall = vec3f(SIDE * (block + ahead));
    let steps = select((wall - position) * view.steps_per_index, vec3f(FAR), view.step == vec3f(0.0));
    return max(min(steps.x, min(steps.y, steps.z)), 0.0);
}

// The crossing within the step that ends at `n`.
fn refine(start: vec3f, n: f32) -> f32 {
    if (n == 0.0) {
        return 0.0;
    }
    var outside = n - 1.0;
    var inside = n;
    for (var halving = 0u; halving < HALVINGS; halving++) {
        let middle = (outside + inside) * 0.5;
        if (hu_at(start + view.step * middle) >= view.threshold_hu) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    return inside;
}

// The first point at or above the threshold, or −1 if there is none up to `length`.
fn march(start: vec3f, length: f32) -> f32 {
    var n = 0.0;
    while (n <= length) {
        let position = start + view.step * n;
        let free = free_steps(position);
        if (free >= 0.0) {
            // Continue with the first sample behind the block. Samples stay a whole step apart.
            n = max(floor(n + free), n) + 1.0;
            continue;
        }
        if (hu_at(position) >= view.threshold_hu) {
            return refine(start, n);
        }
        n += 1.0;
    }
    return -1.0;
}
