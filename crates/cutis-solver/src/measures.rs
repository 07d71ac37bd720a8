//! Measurements of a state: residuals, energy, momentum and memory. They are computed on request
//! only. All sums are in `f64` and have a fixed order.

use nalgebra::{Point3, Vector3};

/// Relative violation of the constraints of one kind: `C` over the rest size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Name of the kind.
    pub name: &'static str,
    /// Root mean square.
    pub rms: f64,
    /// Largest absolute value.
    pub max: f64,
}

impl Residual {
    pub(crate) fn of(name: &'static str, ratios: impl Iterator<Item = f64>) -> Self {
        let (mut count, mut square, mut max) = (0usize, 0.0, 0.0f64);
        for ratio in ratios {
            count += 1;
            square += ratio * ratio;
            max = max.max(ratio.abs());
        }
        Self { name, rms: (square / count.max(1) as f64).sqrt(), max }
    }
}

/// Energy of a body in joules. Vertices with inverse mass 0 do not contribute.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// Kinetic energy `Σ ½m|v|²`.
    pub kinetic_j: f64,
    /// Elastic energy `Σ ½C²/α` over all constraints with `α > 0`. `None` if a kind has a PBD
    /// stiffness, which defines no energy.
    pub elastic_j: Option<f64>,
    /// Potential energy `−Σ m g·x` of gravity, zero at the origin of the caller's coordinates.
    pub gravity_j: f64,
    /// Potential energy `−Σ load·x` of the loads, zero at the origin of the caller's coordinates.
    pub load_j: f64,
}

impl Energy {
    /// Returns the sum of the parts that are defined.
    pub fn total_j(&self) -> f64 {
        self.kinetic_j + self.elastic_j.unwrap_or(0.0) + self.gravity_j + self.load_j
    }
}

/// Momentum of the vertices with finite mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum {
    /// Linear momentum `Σ m v` in kg·m/s.
    pub linear: Vector3<f64>,
    /// Angular momentum `Σ m (x − center)×v` in kg·m²/s.
    pub angular: Vector3<f64>,
    /// Center of mass in meters, in the caller's coordinates.
    pub center: Point3<f64>,
}

/// Memory of one part of a solver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryPart {
    /// Name of the part: `vertices`, `loads`, `handles`, or a kind of constraint.
    pub name: &'static str,
    /// Size in bytes.
    pub bytes: usize,
}
