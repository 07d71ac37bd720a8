// Light from a surface point, with a light source on the viewer's side and ambient occlusion.

// Fractions of the occlusion's reach at which the volume is sampled.
const REACHES: array<f32, 3> = array(0.2, 0.5, 1.0);

// 14 times ∂HU/∂index, from central differences over one voxel to each side, averaged over the
// position and its six neighbors.
fn index_gradient(position: vec3f) -> vec3f {
    let x = vec3f(1.0, 0.0, 0.0);
    let y = vec3f(0.0, 1.0, 0.0);
    let z = vec3f(0.0, 0.0, 1.0);
    return vec3f(along(position, x), along(position, y), along(position, z))
        + vec3f(across(position, x, y), 0.0)
        + vec3f(0.0, across(position, y, z))
        + across(position, z, x).yxx * vec3f(1.0, 0.0, 1.0);
}

// The sum of the differences over one and over two voxels.
fn along(position: vec3f, axis: vec3f) -> f32 {
    return hu_at(position + axis) - hu_at(position - axis)
        + hu_at(position + 2.0 * axis) - hu_at(position - 2.0 * axis);
}

// The differences along `a` and along `b` between the four diagonal neighbors.
fn across(position: vec3f, a: vec3f, b: vec3f) -> vec2f {
    let both = hu_at(position + a + b);
    let first = hu_at(position + a - b);
    let second = hu_at(position - a + b);
    let none = hu_at(position - a - b);
    return vec2f(both + first - second - none, both + second - first - none);
}

// Outward unit normal in world space.
fn normal_at(index: vec3f) -> vec3f {
    let gradient = index_gradient(index);
    let size = max(abs(gradient.x), max(abs(gradient.y), abs(gradient.z)));
    if (size == 0.0) {
        return view.toward;
    }
    let unit = gradient / size;
    let rows = view.index_per_spacing;
    let outward = -(rows[0].xyz * unit.x + rows[1].xyz * unit.y + rows[2].xyz * unit.z);
    let length = sqrt(dot(outward, outward));
    return select(outward / max(length, 1e-30), view.toward, length == 0.0);
}

// Fraction of the ambient light that reaches the point: 1 on a convex body, less in a cleft.
fn openness(index: vec3f, normal: vec3f) -> f32 {
    if (view.occlusion == 0.0) {
        return 1.0;
    }
    let start = index + turn(view.index_per_spacing, normal);
    var lit = 0.0;
    var all = 0.0;
    for (var n = 0u; n < 16u; n++) {
        let cosine = dot(view.directions[n].xyz, normal);
        if (cosine <= 0.0) {
            continue;
        }
        all += cosine;
        var free = 0u;
        while (free < 3u && hu_at(start + view.reaches[n].xyz * REACHES[free]) < view.threshold_hu) {
            free++;
        }
        lit += cosine * f32(free) / 3.0;
    }
    return select(1.0, lit / max(all, 1e-30), all > 0.0);
}

// Linear light of a cut face: HU as gray, window 400, level 40.
fn cut_face(index: vec3f) -> vec3f {
    let gray = clamp((hu_at(index) + 160.0) / 400.0, 0.0, 1.0);
    return vec3f(gray * gray * 0.8);
}

// Linear light of the surface.
fn surface(index: vec3f) -> vec3f {
    let normal = normal_at(index);
    let open = openness(index, normal);
    // Light that scatters in tissue becomes red, more so where less light arrives.
    let root = sqrt(open);
    let base = albedo(index, normal) * vec3f(open, open * root, open * root * sqrt(root));
    let diffuse = max(dot(normal, view.light), 0.0);
    let facing = max(dot(normal, view.toward), 0.0);
    let shine = max(dot(normal, view.half_way), 0.0);
    let shine2 = shine * shine;
    let shine4 = shine2 * shine2;
    let shine8 = shine4 * shine4;
    let gloss = shine8 * shine8 * shine8 * 0.06 * open;
    return base * (0.16 + 0.64 * diffuse * (0.25 + 0.75 * open) + 0.24 * facing) + gloss;
}
