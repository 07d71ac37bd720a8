//! Errors of the ChainMail model.

/// Errors of creating a chain and of using it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChainError {
    /// The grid has no elements or too many.
    #[error(
        "a grid of {shape:?} elements: each axis must have 1 to {most} of them, and all axes together at most \
         4294967294"
    )]
    Shape {
        /// Grid points along each axis.
        shape: [usize; 3],
        /// Largest number along an axis.
        most: usize,
    },
    /// The grid spacing is not a positive length.
    #[error("a spacing of {spacing_mm:?} mm: each number must be finite and above 0")]
    Spacing {
        /// Spacing along each axis, mm.
        spacing_mm: [f64; 3],
    },
    /// An array does not have one entry for each grid point.
    #[error("{what}: {found} entries for {expected} elements")]
    Length {
        /// Contents of the array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// Number of grid points.
        expected: usize,
    },
    /// There is no material, or there are too many.
    #[error("{count} materials: there must be 1 to {most}")]
    MaterialCount {
        /// Number of materials.
        count: usize,
        /// Largest number of materials.
        most: usize,
    },
    /// A number of a material is out of range.
    #[error("material {material}, {key}: {value} must be {range}")]
    Material {
        /// Index of the material in its list.
        material: usize,
        /// Name of the field.
        key: &'static str,
        /// Value of the field.
        value: f64,
        /// Allowed values.
        range: &'static str,
    },
    /// The entries of a material table are out of order.
    #[error(
        "entry {entry} of the material table begins at {from_hu} HU: each entry must begin at a finite HU above the \
         previous one"
    )]
    TableOrder {
        /// Index of the entry.
        entry: usize,
        /// HU at which the entry begins.
        from_hu: f32,
    },
    /// There is no preset with this name.
    #[error("there is no material preset `{name}`; expected {expected}")]
    NoSuchPreset {
        /// The name.
        name: String,
        /// The names of all presets.
        expected: String,
    },
    /// A grid point has a material number that does not exist.
    #[error(
        "element {element} has material {material}, but there are only {count} materials, numbered from 0"
    )]
    NoSuchMaterial {
        /// The grid point.
        element: usize,
        /// Its material number.
        material: u8,
        /// Number of materials.
        count: usize,
    },
    /// The element number is outside the grid, or there is no element at this grid point.
    #[error(
        "element {element} does not exist: it is outside the grid of {count} points, or its point is empty"
    )]
    NoSuchElement {
        /// The element.
        element: u32,
        /// Number of grid points.
        count: usize,
    },
    /// An element has two targets, or a fixed element has a target elsewhere.
    #[error("element {element} cannot be grabbed: {why}")]
    NotFree {
        /// The element.
        element: u32,
        /// Why it cannot be grabbed.
        why: &'static str,
    },
    /// A target is too far away for 32-bit coordinates.
    #[error(
        "element {element} cannot go to {to:?} steps: coordinates must be finite and within 4096 steps of the first \
         element"
    )]
    TooFar {
        /// The element.
        element: u32,
        /// Its target in steps.
        to: [f64; 3],
    },
    /// The chain has another shape or another number of materials than the one for which the device
    /// was prepared.
    #[cfg(feature = "gpu")]
    #[error(
        "the GPU was prepared for a chain of {of_shape:?} elements with {of_materials} materials, but this one has \
         {shape:?} elements with {materials} materials"
    )]
    OtherChain {
        /// Grid points along each axis.
        shape: [usize; 3],
        /// Number of materials.
        materials: usize,
        /// Grid points along each axis of the chain for which the device was prepared.
        of_shape: [usize; 3],
        /// Number of its materials.
        of_materials: usize,
    },
    /// The GPU rejected the work or failed.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] cutis_gpu::GpuError),
}
