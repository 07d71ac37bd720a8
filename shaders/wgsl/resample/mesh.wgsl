// The tets of a chunk, and the corners of a tet. The source joined to this declares `places`.
@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var<storage, read> tets: array<vec4u>;

// Places of the corners of the tet with these vertices.
fn corners_of(vertices: vec4u) -> Corners {
    return Corners(
        places[vertices.x].xyz,
        places[vertices.y].xyz,
        places[vertices.z].xyz,
        places[vertices.w].xyz,
    );
}

// True if a corner of the tet with these vertices has moved.
fn has_moved(vertices: vec4u) -> bool {
    return max(
        max(places[vertices.x].w, places[vertices.y].w),
        max(places[vertices.z].w, places[vertices.w].w),
    ) > 0.0;
}
