//! The crate's error type.

use std::path::PathBuf;

/// Everything that can be wrong with a lattice, a mesh, an incision or a mesh file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A lattice needs a cell along every axis, and its points must be countable in 32 bits.
    #[error(
        "a lattice of {shape:?} vertices is not possible: each axis needs at least 2, and all together at most {max}"
    )]
    LatticeSize {
        /// Vertices per axis.
        shape: [usize; 3],
        /// Largest number of vertices.
        max: usize,
    },
    /// The lattice's extent cannot be held in 32-bit meters.
    #[error("lattice steps of {spacing_mm:?} mm over {shape:?} vertices cannot be held in 32-bit meters")]
    LatticeExtent {
        /// Step along each axis, mm.
        spacing_mm: [f64; 3],
        /// Vertices per axis.
        shape: [usize; 3],
    },
    /// An array given per lattice vertex has another length.
    #[error("the array `{array}` has {found} values; the lattice has {expected} vertices")]
    Length {
        /// Which array.
        array: &'static str,
        /// Vertices of the lattice or mesh.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A HU value is NaN or infinite.
    #[error("the HU value at lattice vertex {point:?} is {hu}; it must be finite")]
    NotFinite {
        /// Lattice vertex `(i, j, k)`.
        point: [usize; 3],
        /// The value.
        hu: f32,
    },
    /// No tetrahedron has tissue at all four corners.
    #[error(
        "no tissue: none of the {tets} tetrahedra has tissue at all four corners ({tissue_vertices} of {vertices} vertices are tissue on the kept side of the cut planes); check the air threshold, the lattice spacing and the cut planes"
    )]
    NoTissue {
        /// Tetrahedra of the lattice.
        tets: usize,
        /// Vertices of the lattice that are tissue and not cut away.
        tissue_vertices: usize,
        /// Vertices of the lattice.
        vertices: usize,
    },
    /// A half-space needs a finite point and a finite normal other than zero.
    #[error(
        "the plane through {point_mm:?} mm with normal {normal:?} is no plane: the point must be finite, the normal finite and not zero"
    )]
    Plane {
        /// A point of the plane, mm.
        point_mm: [f64; 3],
        /// Its normal.
        normal: [f64; 3],
    },
    /// The through axis of a skin search is not an index axis.
    #[error("through axis {axis} does not exist; it must be 0, 1 or 2")]
    Axis {
        /// The axis given.
        axis: usize,
    },
    /// An index names no vertex.
    #[error("`{array}`[{position}] names vertex {vertex}; there are {vertices}")]
    VertexIndex {
        /// Which array.
        array: &'static str,
        /// Entry in that array.
        position: usize,
        /// The vertex named.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A number of an incision is not usable.
    #[error("incision {incision}: `{key}` is {value}; it must be finite and positive")]
    IncisionSize {
        /// Which incision, from 0.
        incision: usize,
        /// `depth_mm`, `width_mm`, or `length` (the distance from `from_mm` to `to_mm`).
        key: &'static str,
        /// The value given.
        value: f64,
    },
    /// The incision's segment lies too far from the skin.
    #[error(
        "incision {incision}: the segment {from_mm:?} → {to_mm:?} mm is {distance_mm:.1} mm from the skin; it must lie within {reach_mm:.1} mm of it"
    )]
    IncisionOffSkin {
        /// Which incision, from 0.
        incision: usize,
        /// Start, mm.
        from_mm: [f64; 3],
        /// End, mm.
        to_mm: [f64; 3],
        /// Distance from the segment to the nearest skin triangle's center, mm; infinite without skin.
        distance_mm: f64,
        /// The distance allowed, mm.
        reach_mm: f64,
    },
    /// The segment runs into the skin and not along it, so "down" has no meaning.
    #[error(
        "incision {incision}: the segment {from_mm:?} → {to_mm:?} mm pierces the skin instead of running along it (the skin's mean outward normal there is {normal:?})"
    )]
    IncisionThroughSkin {
        /// Which incision, from 0.
        incision: usize,
        /// Start, mm.
        from_mm: [f64; 3],
        /// End, mm.
        to_mm: [f64; 3],
        /// Mean outward normal of the skin near the segment; short where normals cancel.
        normal: [f64; 3],
    },
    /// The slit holds no vertex and crosses no edge.
    #[error(
        "incision {incision} cuts nothing: no vertex lies in it and no edge crosses it; make it longer than the lattice step of {step_mm:.1} mm, deeper, or the lattice finer"
    )]
    IncisionEmpty {
        /// Which incision, from 0.
        incision: usize,
        /// Longest lattice step, mm.
        step_mm: f64,
    },
    /// The slit touches vertices of the body that a region froze, or that lie where a graded lattice is coarse.
    #[error(
        "incision {incision} is not all inside: a vertex of the body at {at_mm:.1?} mm, {distance_mm:.1} mm from the middle of the slit, is touched by it and lies {}",
        if *coarse { "where the lattice is coarse" } else { "outside the region" }
    )]
    IncisionBeyond {
        /// Which incision, from 0.
        incision: usize,
        /// How far the farthest such vertex is from the surface in the middle of the slit, mm.
        distance_mm: f64,
        /// Where it is, mm.
        at_mm: [f64; 3],
        /// It lies where a graded lattice is coarse; else a region froze it.
        coarse: bool,
    },
    /// A region holds no vertex of the body.
    #[error("the region holds none of the {vertices} vertices of the body")]
    RegionEmpty {
        /// Vertices of the whole body.
        vertices: usize,
    },
    /// The fine zone of a graded lattice is not within the lattice.
    #[error(
        "along axis {axis} the fine zone reaches from step {from} to step {to} of the even lattice; it must begin before it ends and meet the lattice's {steps} steps"
    )]
    FineZone {
        /// Index axis.
        axis: usize,
        /// Where the zone begins, in steps of the even lattice.
        from: f64,
        /// Where it ends.
        to: f64,
        /// Steps of the even lattice.
        steps: usize,
    },
    /// A number of a grading is out of range.
    #[error("the grading's `{key}` is {value}; it must lie between {low} and {high}")]
    Grading {
        /// `growth` or `coarsest`.
        key: &'static str,
        /// The value given.
        value: f64,
        /// Lowest value allowed.
        low: f64,
        /// Highest value allowed.
        high: f64,
    },
    /// The slit leaves no skin vertices on one of its sides.
    #[error(
        "incision {incision} leaves no lips: {left} skin vertices to the left of the slit and {right} to the right"
    )]
    IncisionWithoutLips {
        /// Which incision, from 0.
        incision: usize,
        /// Skin vertices on the left lip.
        left: usize,
        /// Skin vertices on the right lip.
        right: usize,
    },
    /// A mesh file holds more than its format's counters can tell.
    #[error("{path}: {cells} cells are too many for 32-bit offsets")]
    TooManyCells {
        /// The file.
        path: PathBuf,
        /// Number of cells.
        cells: usize,
    },
    /// A `.vtp` file holds triangles only.
    #[error("{path}: tetrahedra do not fit into a surface file; write a .vtu file")]
    NotASurface {
        /// The file.
        path: PathBuf,
    },
    /// A point array of a mesh file does not fit the mesh.
    #[error("{path}: the array `{array}` has {found} values; the mesh has {expected} points")]
    PointData {
        /// The file.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// Points of the mesh.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A name cannot stand in a mesh file.
    #[error("{path}: `{name}` cannot name an array; use letters, digits, `_`, `-` and `.`")]
    ArrayName {
        /// The file.
        path: PathBuf,
        /// The name.
        name: String,
    },
    /// A mesh file could not be created or put in its place.
    #[error(transparent)]
    File(#[from] cutis_volume::VolumeError),
    /// A mesh file could not be written.
    #[error("{path}: cannot be written: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}
