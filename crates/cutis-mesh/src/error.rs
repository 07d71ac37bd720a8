//! The crate's error type.

use std::path::PathBuf;

/// Errors of lattices, meshes, skin detection, incisions and mesh files.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A lattice has fewer than two points along an axis, or too many for 32-bit indices.
    #[error(
        "a lattice of {shape:?} vertices is not possible: expected at least 2 along each axis, and at most {max} in total"
    )]
    LatticeSize {
        /// Vertices per axis.
        shape: [usize; 3],
        /// Largest number of vertices.
        max: usize,
    },
    /// The steps or the extent of a lattice exceed the range of 32-bit meters.
    #[error("lattice steps of {spacing_mm:?} mm over {shape:?} vertices exceed the range of 32-bit meters")]
    LatticeExtent {
        /// Step along each axis in mm.
        spacing_mm: [f64; 3],
        /// Vertices per axis.
        shape: [usize; 3],
    },
    /// An array does not have one value per vertex.
    #[error("the array `{array}` has {found} values; expected {expected}, one per vertex")]
    Length {
        /// Name of the array.
        array: &'static str,
        /// Number of vertices of the lattice or mesh.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// A HU value of a mesh vertex is NaN or infinite.
    #[error("the HU value at lattice vertex {point:?} is {hu}; it must be finite")]
    NotFinite {
        /// Lattice vertex `(i, j, k)`.
        point: [usize; 3],
        /// The HU value.
        hu: f32,
    },
    /// No tetrahedron has four tissue corners.
    #[error(
        "no tissue: none of the {tets} tetrahedra has four tissue corners ({tissue_vertices} of {vertices} vertices are tissue and not cut away); check the air threshold, the lattice spacing and the cut planes"
    )]
    NoTissue {
        /// Number of tetrahedra of the lattice.
        tets: usize,
        /// Number of vertices that are tissue and not cut away.
        tissue_vertices: usize,
        /// Number of vertices of the lattice.
        vertices: usize,
    },
    /// The point or normal of a half-space is not finite, or the normal is zero.
    #[error(
        "the plane through {point_mm:?} mm with normal {normal:?} is not valid: both must be finite, and the normal must not be zero"
    )]
    Plane {
        /// A point of the plane in mm.
        point_mm: [f64; 3],
        /// Normal of the plane.
        normal: [f64; 3],
    },
    /// A lattice point cannot be moved.
    #[error(
        "move {position} moves point {point} by {mm:?} mm; points must be below {count} and ascend, and displacements must be finite"
    )]
    Move {
        /// Position in the list of moves.
        position: usize,
        /// Flat index of the point.
        point: u32,
        /// Its displacement in mm.
        mm: [f64; 3],
        /// Number of points.
        count: usize,
    },
    /// The through axis of a skin detection is not an index axis.
    #[error("through axis {axis} does not exist; it must be 0, 1 or 2")]
    Axis {
        /// The given axis.
        axis: usize,
    },
    /// A vertex index is out of range.
    #[error("`{array}`[{position}] names vertex {vertex}; there are {vertices}")]
    VertexIndex {
        /// Name of the array.
        array: &'static str,
        /// Position in that array.
        position: usize,
        /// The vertex index.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A length, depth or width of an incision is not finite and positive.
    #[error("incision {incision}: `{key}` is {value}; it must be finite and positive")]
    IncisionSize {
        /// Number of the incision, from 0.
        incision: usize,
        /// `depth_mm`, `width_mm`, or `length` of a segment.
        key: &'static str,
        /// The given value.
        value: f64,
    },
    /// The path of an incision cannot be cut.
    #[error("incision {incision}: its path cannot be cut: {why}")]
    IncisionPath {
        /// Number of the incision, from 0.
        incision: usize,
        /// What is wrong, and what would be right.
        why: String,
    },
    /// A stitch has no skin at one of its ends, or nothing is cut between its ends.
    #[error(
        "a stitch across incision {incision} has no skin of its own within {reach_mm:.1} mm of {at_mm:.1?} mm; use a finer lattice, make it shorter or longer, or place it where the incision is"
    )]
    StitchOffSkin {
        /// Number of the incision, from 0.
        incision: usize,
        /// Where the end of the stitch should be, in mm.
        at_mm: [f64; 3],
        /// Largest allowed distance in mm.
        reach_mm: f64,
    },
    /// A stitch between two given points cannot be made.
    #[error("pair {pair} of points to stitch: {why}")]
    StitchPair {
        /// Number of the pair, from 0.
        pair: usize,
        /// What is wrong.
        why: String,
    },
    /// There would be more than 1000 stitches.
    #[error(
        "stitches across incision {incision} every {every_mm} mm are too many; give at least {least_mm:.3} mm"
    )]
    TooManyStitches {
        /// Number of the incision, from 0.
        incision: usize,
        /// Distance between stitches in mm.
        every_mm: f64,
        /// Least possible distance in mm.
        least_mm: f64,
    },
    /// The segment of an incision is too far from the skin.
    #[error(
        "incision {incision}: the segment {from_mm:?} → {to_mm:?} mm is {distance_mm:.1} mm from the skin, its start {:.1} mm and its end {:.1} mm; it must lie within {reach_mm:.1} mm of the skin",
        ends_mm[0], ends_mm[1]
    )]
    IncisionOffSkin {
        /// Number of the incision, from 0.
        incision: usize,
        /// Start of the segment in mm.
        from_mm: [f64; 3],
        /// End of the segment in mm.
        to_mm: [f64; 3],
        /// Distance in mm from the segment to the nearest center of a skin triangle.
        distance_mm: f64,
        /// The same for its start and its end.
        ends_mm: [f64; 2],
        /// Largest allowed distance in mm.
        reach_mm: f64,
    },
    /// The segment pierces the skin instead of running along it, so the direction of depth is
    /// undefined.
    #[error(
        "incision {incision}: the segment {from_mm:?} → {to_mm:?} mm pierces the skin instead of running along it (the skin's mean outward normal there is {normal:?})"
    )]
    IncisionThroughSkin {
        /// Number of the incision, from 0.
        incision: usize,
        /// Start of the segment in mm.
        from_mm: [f64; 3],
        /// End of the segment in mm.
        to_mm: [f64; 3],
        /// Mean outward normal of the skin near the segment. It is short if normals cancel.
        normal: [f64; 3],
    },
    /// A cut needs a skin to be placed on, and there is none.
    #[error("incision {incision} has no skin to lie on: the skin has no triangles")]
    IncisionWithoutSkin {
        /// Number of the incision, from 0.
        incision: usize,
    },
    /// The segment of an incision leaves the skin and runs through the body.
    #[error(
        "incision {incision}: the segment {from_mm:?} → {to_mm:?} mm runs through the body instead of along the skin: it passes {below_mm:.1} mm below the skin at {at_mm:.1?} mm; add points along the skin between its ends"
    )]
    IncisionThroughBody {
        /// Number of the incision, from 0.
        incision: usize,
        /// Start of the segment in mm.
        from_mm: [f64; 3],
        /// End of the segment in mm.
        to_mm: [f64; 3],
        /// Largest depth of the segment below the skin in mm.
        below_mm: f64,
        /// Where that is, in mm.
        at_mm: [f64; 3],
    },
    /// The segment of an incision has skin below or above it along less than half of its length.
    #[error(
        "incision {incision}: only {:.0} % of the segment {from_mm:?} → {to_mm:?} mm has skin within {reach_mm:.1} mm above or below it; at least half is needed: end it where the skin ends, or add points along the skin",
        100.0 * share
    )]
    IncisionOverGap {
        /// Number of the incision, from 0.
        incision: usize,
        /// Start of the segment in mm.
        from_mm: [f64; 3],
        /// End of the segment in mm.
        to_mm: [f64; 3],
        /// Share of its length with skin.
        share: f64,
        /// Largest distance in mm at which skin counts.
        reach_mm: f64,
    },
    /// The slit contains no vertex and crosses no edge.
    #[error(
        "incision {incision} cuts nothing: it contains no vertex and crosses no edge; make it longer than the lattice step of {step_mm:.1} mm, or deeper, or use a finer lattice"
    )]
    IncisionEmpty {
        /// Number of the incision, from 0.
        incision: usize,
        /// Longest lattice step in mm.
        step_mm: f64,
    },
    /// The slit touches a vertex of the body outside the region, or in the coarse part of a graded
    /// lattice.
    #[error(
        "incision {incision} touches a vertex of the body at {at_mm:.1?} mm, {distance_mm:.1} mm from the middle of the slit, that lies {}",
        if *coarse { "in the coarse part of the lattice" } else { "outside the region" }
    )]
    IncisionBeyond {
        /// Number of the incision, from 0.
        incision: usize,
        /// Distance in mm of the farthest such vertex from the middle surface of the slit.
        distance_mm: f64,
        /// Position of that vertex in mm.
        at_mm: [f64; 3],
        /// True if the vertex is in the coarse part of a graded lattice, false if it is outside the
        /// region.
        coarse: bool,
    },
    /// An undermining cannot be made.
    #[error("undermining {undermining} cannot be made: {why}")]
    Undermining {
        /// Number of the undermining, from 0.
        undermining: usize,
        /// What is wrong, and what would be right.
        why: String,
    },
    /// An excision cannot be made.
    #[error("excision {excision} cannot be made: {why}")]
    Excision {
        /// Number of the excision, from 0.
        excision: usize,
        /// What is wrong, and what would be right.
        why: String,
    },
    /// Too many cuts of no width meet in one tetrahedron.
    #[error(
        "{cuts} cuts meet in one lattice cell at {at_mm:.1?} mm; at most 8 can: use a finer lattice, or keep the cuts apart"
    )]
    TooManyCuts {
        /// Number of cuts.
        cuts: usize,
        /// A corner of the cell in mm.
        at_mm: [f64; 3],
    },
    /// A region contains no vertex of the body.
    #[error("the region contains none of the {vertices} vertices of the body")]
    RegionEmpty {
        /// Number of vertices of the body.
        vertices: usize,
    },
    /// The fine zone of a graded lattice is empty or outside the lattice.
    #[error(
        "along axis {axis} the fine zone reaches from step {from} to step {to} of the even lattice; it must not end before it begins, and must overlap the {steps} steps of the lattice"
    )]
    FineZone {
        /// Index axis.
        axis: usize,
        /// Start of the zone in steps of the even lattice.
        from: f64,
        /// End of the zone in steps of the even lattice.
        to: f64,
        /// Number of steps of the even lattice.
        steps: usize,
    },
    /// A parameter of a grading is out of range.
    #[error("the grading's `{key}` is {value}; it must lie between {low} and {high}")]
    Grading {
        /// `growth` or `coarsest`.
        key: &'static str,
        /// The given value.
        value: f64,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
    },
    /// The slit leaves no skin vertices on one side.
    #[error(
        "incision {incision} leaves no lips: {left} skin vertices to the left of the slit and {right} to the right"
    )]
    IncisionWithoutLips {
        /// Number of the incision, from 0.
        incision: usize,
        /// Number of skin vertices on the left lip.
        left: usize,
        /// Number of skin vertices on the right lip.
        right: usize,
    },
    /// A mesh has too many cells for the 32-bit offsets of the file format.
    #[error("{path}: {cells} cells are too many for 32-bit offsets")]
    TooManyCells {
        /// Path of the file.
        path: PathBuf,
        /// Number of cells.
        cells: usize,
    },
    /// A `.vtp` file can hold only triangles.
    #[error("{path}: a surface file cannot hold tetrahedra; write a .vtu file")]
    NotASurface {
        /// Path of the file.
        path: PathBuf,
    },
    /// An array for a mesh file does not have one value per point or per cell.
    #[error("{path}: the array `{array}` has {found} values; the mesh has {expected} {elements}")]
    ArrayLength {
        /// Path of the file.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// `points` or `cells`.
        elements: &'static str,
        /// Number of points or cells of the mesh.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// A name of an array has characters that a mesh file does not allow.
    #[error("{path}: `{name}` is not a valid name of an array; use letters, digits, `_`, `-` and `.`")]
    ArrayName {
        /// Path of the file.
        path: PathBuf,
        /// The invalid name.
        name: String,
    },
    /// A mesh file could not be created, or a volume could not be sampled on a lattice.
    #[error(transparent)]
    Volume(#[from] cutis_volume::VolumeError),
    /// A mesh file could not be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
}
