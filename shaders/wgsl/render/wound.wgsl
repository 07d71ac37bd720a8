// Skin, or tissue by its HU where the surface was deep inside the body at rest.

@group(0) @binding(6) var depth: texture_3d<i32>;

fn albedo(index: vec3f, normal: vec3f) -> vec3f {
    let rows = view.depth_index;
    let below = turn(rows, index) + vec3f(rows[0].w, rows[1].w, rows[2].w) - turn(view.depth_per_spacing, normal);
    let depth_mm = sample(depth, Scale(view.depth_slope, view.depth_intercept), below) - view.depth_spacing_mm;
    let deep = clamp(depth_mm * view.skins_per_mm - 1.0, 0.0, 1.0);
    let exposed = deep * deep * (3.0 - 2.0 * deep);
    let inward = turn(view.index_per_spacing, -normal);
    let hu = (hu_at(index + inward) + hu_at(index + 2.0 * inward)) / 2.0;
    return view.skin + exposed * (tissue(hu) - view.skin);
}

// Color of tissue by HU.
fn tissue(hu: f32) -> vec3f {
    var color = view.tissue[0].xyz;
    for (var n = 1u; n < 6u; n++) {
        let low = view.tissue[n - 1u];
        let high = view.tissue[n];
        let part = clamp((hu - low.w) / (high.w - low.w), 0.0, 1.0);
        color += part * (high.xyz - low.xyz);
    }
    return color;
}
