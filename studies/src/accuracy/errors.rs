//! The error measures: of positions, residuals and stiffness.

use cutis_solver::{Kind, System};
use nalgebra::{Point3, Vector3};
use serde::Serialize;

/// Root mean square of `found − right` over that of `right − start`, over the vertices that are
/// `free`.
pub fn relative_rms(
    found: &[Point3<f64>],
    right: &[Point3<f64>],
    start: &[Point3<f64>],
    free: &[bool],
) -> f64 {
    let (mut off, mut whole) = (0.0, 0.0);
    for (v, _) in free.iter().enumerate().filter(|(_, free)| **free) {
        off += (found[v] - right[v]).norm_squared();
        whole += (right[v] - start[v]).norm_squared();
    }
    (off / whole).sqrt()
}

/// Factor on the load that would move the body as far as the reference: `u·u / u·u'`, with the
/// displacements `u` of the reference and `u'` of the result, over the vertices that are `free`.
pub fn stiffness_under_load(
    found: &[Point3<f64>],
    right: &[Point3<f64>],
    rest: &[Point3<f64>],
    free: &[bool],
) -> f64 {
    let (mut whole, mut along) = (0.0, 0.0);
    for (v, _) in free.iter().enumerate().filter(|(_, free)| **free) {
        let u = right[v] - rest[v];
        whole += u.norm_squared();
        along += u.dot(&(found[v] - rest[v]));
    }
    whole / along
}

/// Residuals of one kind of constraint (E4), as root mean squares of `C` over rest size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KindError {
    /// Name of the kind.
    pub name: &'static str,
    /// Residual at the resulting positions.
    pub found: f64,
    /// Residual at the equilibrium. It is not zero, because constraints carry the load.
    pub equilibrium: f64,
    /// RMS of the differences between the two, constraint by constraint.
    pub error: f64,
}

/// [`KindError`] of each kind of `system`.
pub fn residuals(system: &System<f64>, found: &[Point3<f64>], equilibrium: &[Point3<f64>]) -> Vec<KindError> {
    let of_kind = |kind: &Kind<f64>| {
        let arity = kind.arity();
        let (mut count, mut sums) = (0u64, [0.0; 3]);
        let mut gradients = vec![Vector3::zeros(); arity];
        for (k, tuple) in kind.indices().chunks_exact(arity).enumerate() {
            let size = kind.rest_size(k);
            let mut ratio = |x: &[Point3<f64>]| {
                let places: Vec<Point3<f64>> = tuple.iter().map(|&v| x[v as usize]).collect();
                kind.evaluate(k, &places, &mut gradients) / size
            };
            let [a, b] = [ratio(found), ratio(equilibrium)];
            if size != 0.0 {
                count += 1;
                sums.iter_mut().zip([a, b, a - b]).for_each(|(sum, c)| *sum += c * c);
            }
        }
        let [found, equilibrium, error] = sums.map(|sum| (sum / count.max(1) as f64).sqrt());
        KindError { name: kind.name(), found, equilibrium, error }
    };
    system.kinds().iter().map(of_kind).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_vertices_do_not_count_and_stiffness_is_the_inverse_of_motion() {
        let at = |x: f64| Point3::new(x, 0.0, 0.0);
        let (rest, right, found) = ([at(0.0), at(1.0)], [at(0.0), at(2.0)], [at(9.0), at(2.5)]);
        assert_eq!(relative_rms(&found, &right, &rest, &[false, true]), 0.5);
        assert!(relative_rms(&found, &right, &rest, &[true, true]) > 9.0);
        assert_eq!(stiffness_under_load(&found, &right, &rest, &[false, true]), 1.0 / 1.5);
    }
}
