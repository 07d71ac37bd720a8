//! What is measured about a state, on request only: residuals, energy, momentum, memory. All sums are in `f64` and in
//! a fixed order.

use nalgebra::{Point3, Vector3};

/// How far the constraints of a kind are from being met: `C` over the rest size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Kind of constraint.
    pub name: &'static str,
    /// Root of the mean square.
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

/// Energy in joules; vertices with inverse mass 0 have none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// `Σ ½m|v|²`.
    pub kinetic_j: f64,
    /// `Σ ½C²/α` over all constraints with `α > 0`; `None` where a kind has a PBD stiffness, which stands for no
    /// energy.
    pub elastic_j: Option<f64>,
    /// `−Σ m g·x`, zero at the origin of the caller's coordinates.
    pub gravity_j: f64,
}

impl Energy {
    /// Sum of the parts that are defined.
    pub fn total_j(&self) -> f64 {
        self.kinetic_j + self.elastic_j.unwrap_or(0.0) + self.gravity_j
    }
}

/// Momentum of the vertices with finite mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum {
    /// `Σ m v` in kg·m/s.
    pub linear: Vector3<f64>,
    /// `Σ m (x − center)×v` in kg·m²/s.
    pub angular: Vector3<f64>,
    /// Center of mass in meters.
    pub center: Point3<f64>,
}

/// One line of the memory profile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryPart {
    /// What is stored: `vertices`, or a kind of constraint.
    pub name: &'static str,
    /// Bytes on the host.
    pub bytes: usize,
}
