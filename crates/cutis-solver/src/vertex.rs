//! A vertex: position and inverse mass in one value, because every projection needs both.

use bytemuck::{Pod, Zeroable};
use cutis_constraints::Scalar;
use nalgebra::Point3;

/// Position in meters and inverse mass in 1/kg (0 = fixed), as four scalars (16 bytes in `f32`).
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Vertex<T>([T; 4]);

impl<T: Scalar> Vertex<T> {
    /// Returns a vertex at `position` (m) with `inverse_mass` (1/kg).
    #[inline(always)]
    pub fn new(position: Point3<T>, inverse_mass: T) -> Self {
        Self([position.x, position.y, position.z, inverse_mass])
    }

    /// Returns the position in meters, relative to [`System::origin`](crate::System::origin).
    #[inline(always)]
    pub fn position(&self) -> Point3<T> {
        Point3::new(self.0[0], self.0[1], self.0[2])
    }

    /// Returns the inverse mass in 1/kg. 0 = fixed or kinematic.
    #[inline(always)]
    pub fn inverse_mass(&self) -> T {
        self.0[3]
    }

    /// Returns x, y, z and the inverse mass.
    #[inline(always)]
    pub(crate) fn components(self) -> [T; 4] {
        self.0
    }

    /// Returns a vertex from x, y, z and the inverse mass.
    #[inline(always)]
    pub(crate) fn from_components(components: [T; 4]) -> Self {
        Self(components)
    }

    pub(crate) fn to_f64(self) -> Vertex<f64> {
        Vertex(self.0.map(T::to_f64))
    }

    /// Moves the vertex without changing its mass.
    #[inline(always)]
    pub fn set_position(&mut self, position: Point3<T>) {
        *self = Self::new(position, self.inverse_mass());
    }

    /// True if all three coordinates are finite.
    #[inline(always)]
    pub fn is_finite(&self) -> bool {
        self.0[..3].iter().all(|value| value.is_finite())
    }
}
