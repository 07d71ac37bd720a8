//! The side from which a body is seen, and the orientation letters of a picture.

use nalgebra::Vector3;

use crate::RenderError;

/// Position of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    /// In front of the patient; the patient's right is on the left of the picture.
    Anterior,
    /// Behind the patient.
    Posterior,
    /// At the patient's left; anterior is on the left of the picture.
    Left,
    /// At the patient's right; anterior is on the right of the picture.
    Right,
    /// Above the head; anterior is up.
    Superior,
    /// Below the feet, as for axial slices; anterior is up.
    Inferior,
    /// Along any direction from the patient to the viewer, RAS+.
    From([f64; 3]),
}

impl Side {
    /// Direction from the patient to the viewer, RAS+, not normalized.
    pub fn direction(self) -> [f64; 3] {
        match self {
            Side::Anterior => [0.0, 1.0, 0.0],
            Side::Posterior => [0.0, -1.0, 0.0],
            Side::Left => [-1.0, 0.0, 0.0],
            Side::Right => [1.0, 0.0, 0.0],
            Side::Superior => [0.0, 0.0, 1.0],
            Side::Inferior => [0.0, 0.0, -1.0],
            Side::From(direction) => direction,
        }
    }
}

/// The orthonormal axes of a picture, RAS+.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Towards the right of the picture.
    pub right: Vector3<f64>,
    /// Towards the top of the picture.
    pub up: Vector3<f64>,
    /// Towards the viewer.
    pub toward: Vector3<f64>,
}

impl Axes {
    /// The axes of a side. Superior is up, or anterior if the view is within 10° of the body's
    /// axis.
    ///
    /// # Errors
    /// [`RenderError::Setting`] for a direction without length.
    pub fn new(side: Side) -> Result<Self, RenderError> {
        let direction = Vector3::from(side.direction());
        let toward = direction / direction.amax();
        let length = toward.norm();
        if !length.is_finite() {
            let expected = "a direction of finite length other than zero";
            return Err(RenderError::Setting { key: "side", value: direction.norm(), expected });
        }
        let toward = toward / length;
        let upright = if toward.z.abs() < 10.0_f64.to_radians().cos() { Vector3::z() } else { Vector3::y() };
        let right = upright.cross(&toward).normalize();
        Ok(Self { right, up: toward.cross(&right), toward })
    }

    /// The letters at the left, right, top and bottom edge of a picture. An oblique direction has
    /// two.
    pub fn letters(&self) -> [String; 4] {
        [-self.right, self.right, self.up, -self.up].map(|direction| letters(&direction))
    }
}

/// Letters of the body directions that make up a direction, the strongest first. Components of less
/// than a quarter are omitted.
fn letters(direction: &Vector3<f64>) -> String {
    let names = [["L", "R"], ["P", "A"], ["I", "S"]];
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| direction[b].abs().total_cmp(&direction[a].abs()));
    let named = axes.into_iter().filter(|&axis| direction[axis].abs() > 0.25 * direction.norm());
    named.map(|axis| names[axis][usize::from(direction[axis] > 0.0)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_follow_the_radiological_convention() {
        let letters = |side| Axes::new(side).unwrap().letters().join(" ");
        assert_eq!(letters(Side::Anterior), "R L S I");
        assert_eq!(letters(Side::Posterior), "L R S I");
        assert_eq!(letters(Side::Left), "A P S I");
        assert_eq!(letters(Side::Right), "P A S I");
        assert_eq!(letters(Side::Superior), "L R A P");
        assert_eq!(letters(Side::Inferior), "R L A P");
        assert_eq!(letters(Side::From([-1.0, 1.0, 0.0])), "RA LP S I");
        assert_eq!(letters(Side::From([0.0, 1e-300, 0.0])), "R L S I");
        assert!(Axes::new(Side::From([0.0; 3])).is_err());
        assert!(Axes::new(Side::From([f64::NAN, 1.0, 0.0])).is_err());
    }
}
