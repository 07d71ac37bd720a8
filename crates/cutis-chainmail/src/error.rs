//! What can be wrong with a chain or with what is asked of it.

/// Why a chain could not be made, or not do what it was told.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChainError {
    /// A grid without elements, or one too large.
    #[error(
        "a grid of {shape:?} elements: each axis must have 1 to {most} of them, and all together at most 4294967294"
    )]
    Shape {
        /// Elements along each axis.
        shape: [usize; 3],
        /// Most along an axis.
        most: usize,
    },
    /// A step of the grid that is no length.
    #[error("steps of {spacing_mm:?} mm: each must be a finite number above 0")]
    Spacing {
        /// Step along each axis, mm.
        spacing_mm: [f64; 3],
    },
    /// An array that does not have one entry for each element.
    #[error("{what}: {found} entries for {expected} elements")]
    Length {
        /// What the array holds.
        what: &'static str,
        /// Its length.
        found: usize,
        /// Elements of the grid.
        expected: usize,
    },
    /// No material, or more than can be numbered.
    #[error("{count} materials: there must be 1 to {most}")]
    MaterialCount {
        /// Number of materials.
        count: usize,
        /// The most.
        most: usize,
    },
    /// A material with a number that makes no sense.
    #[error("material {material}, {key}: {value} must be {range}")]
    Material {
        /// Its place in the list.
        material: usize,
        /// Name of the field.
        key: &'static str,
        /// What it is.
        value: f64,
        /// What would be right.
        range: &'static str,
    },
    /// A material table out of order.
    #[error(
        "entry {entry} of the materials begins at {from_hu} HU; each must begin at a finite number above that of the one before"
    )]
    TableOrder {
        /// Its place in the table.
        entry: usize,
        /// HU from which it holds.
        from_hu: f32,
    },
    /// No preset of that name.
    #[error("there is no preset `{name}` of materials; expected {expected}")]
    NoSuchPreset {
        /// The name.
        name: String,
        /// Those that there are.
        expected: String,
    },
    /// An element names a material that does not exist.
    #[error(
        "element {element} is of material {material}, but there are {count} materials (0 to {count} - 1)"
    )]
    NoSuchMaterial {
        /// The element.
        element: usize,
        /// The material that it names.
        material: u8,
        /// Number of materials.
        count: usize,
    },
    /// An element that is outside the grid, or at which there is nothing.
    #[error(
        "element {element} does not exist: the grid has {count} places, and this one is outside or empty"
    )]
    NoSuchElement {
        /// The element.
        element: u32,
        /// Places of the grid.
        count: usize,
    },
    /// An element that is to go to two places, or to move although it is fixed.
    #[error("element {element} cannot be grabbed: {why}")]
    NotFree {
        /// The element.
        element: u32,
        /// What is in the way.
        why: &'static str,
    },
    /// A place that cannot be named in 32 bits.
    #[error(
        "element {element} cannot go to {to:?} steps: coordinates must be finite and within 4096 steps of the first element"
    )]
    TooFar {
        /// The element.
        element: u32,
        /// Where it was told to go, in steps.
        to: [f64; 3],
    },
    /// A chain of another shape, or of another number of materials, than the device was prepared for.
    #[cfg(feature = "gpu")]
    #[error(
        "the GPU was prepared for a chain of {of_shape:?} elements and {of_materials} materials, and this one has {shape:?} and {materials}"
    )]
    OtherChain {
        /// Elements along each axis.
        shape: [usize; 3],
        /// Number of materials.
        materials: usize,
        /// Elements along each axis of the chain that the device was prepared for.
        of_shape: [usize; 3],
        /// Number of its materials.
        of_materials: usize,
    },
    /// The GPU refused or failed.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] cutis_gpu::GpuError),
}
