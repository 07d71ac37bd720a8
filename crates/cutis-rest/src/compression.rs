//! How strongly a body resists a change of its volume.

use nalgebra::Point3;

use crate::matrix::Matrix;
use crate::smoother::Operator;

/// Rows that count together, and the most groups of rows.
const GROUP: usize = 2;
const MOST_GROUPS: usize = 4096;

/// The modulus of compression along an axis over the shear modulus, `(λ + 2μ)/μ` in an isotropic
/// body: the median over pairs of rows of the matrix, with nodes at these places. NaN without rows.
///
/// Inside a body of one material, a row times the displacement `x_b² e_a` around its node is
/// `−2V c`, with the volume `V` of a node. `c` is the modulus of compression for `a = b`, and the
/// shear modulus otherwise.
pub(crate) fn compression_over_shear(matrix: &Matrix, places: &[Point3<f64>]) -> f64 {
    let nodes = matrix.nodes();
    // The rows of neighboring nodes count together, because a lattice may have two kinds of nodes.
    let of_group = |first: usize| {
        let (mut along, mut across) = (0.0, 0.0);
        for row in first..(first + GROUP).min(nodes) {
            matrix.for_each(row, |column, block| {
                let squares = (places[column] - places[row]).map(|x| x * x);
                for (a, of_column) in block.iter().enumerate() {
                    along += of_column[a] * squares[a];
                    across += of_column[a] * (squares.sum() - squares[a]) / 2.0;
                }
            });
        }
        along / across
    };
    let step = nodes.div_ceil(MOST_GROUPS).max(GROUP);
    let mut ratios: Vec<f64> = (0..nodes).step_by(step).map(of_group).collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Body;
    use crate::curvature::Curvature;
    use crate::springs::{SPACING_M, STIFFNESS_N_PER_M, cube_with_bulk_modulus};

    /// A node has springs to six neighbors at `h`, six at `√2 h` and two at `√3 h`. They sum to
    /// `14 k h²` along the axes and to `5 k h²` across. Volumes add `2 K h³` for each axis.
    #[test]
    fn springs_and_volumes_have_the_ratio_of_their_lattice() {
        let spring = STIFFNESS_N_PER_M * SPACING_M.powi(2);
        for bulk_modulus_pa in [1.0, 1e4, 1e6] {
            let body = Body::of(&cube_with_bulk_modulus(bulk_modulus_pa), [0.0; 3]).unwrap();
            let mut matrix = body.empty_matrix();
            body.fill(&mut matrix, &body.start, Curvature::Stretched, 0.0);
            let places: Vec<_> = body.free.iter().map(|&v| body.start[v as usize]).collect();
            let expected = (14.0 * spring + 6.0 * bulk_modulus_pa * SPACING_M.powi(3)) / (5.0 * spring);
            let found = compression_over_shear(&matrix, &places);
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} in place of {expected}");
        }
    }
}
