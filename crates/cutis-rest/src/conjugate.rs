//! Conjugate gradients with a preconditioner.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::RestError;
use crate::blocks::ROWS;

/// An approximate solution.
pub(crate) struct Solution {
    pub x: Vec<Vector3<f64>>,
    /// Number of cycles of the preconditioner.
    pub cycles: usize,
    /// Whether a direction was found along which the matrix is not positive.
    pub indefinite: bool,
}

/// Equations with a preconditioner, and the vectors of conjugate gradients: the solution `x`, its
/// residual, the preconditioned residual `z`, a direction, and the matrix times `z` and times the
/// direction. The vectors have single precision, which is enough for the tolerances of a Newton
/// step, and stay where the equations are solved. Only inner products come back.
pub(crate) trait Equations {
    /// Begins at `x = 0` with the right-hand side over `largest`, and makes a cycle. Its result is
    /// the first direction.
    fn begin(&mut self, right: &[Vector3<f64>], largest: f64) -> Result<Begin, RestError>;

    /// Adds `length · direction` to `x`, takes `length` times its product from the residual, and
    /// makes a cycle.
    fn advance(&mut self, length: f32) -> Result<Advance, RestError>;

    /// Replaces the direction by `z + ratio · direction`, and its product with the matrix in the
    /// same way.
    fn turn(&mut self, ratio: f32) -> Result<Turn, RestError>;

    /// Adds `length · direction` to `x`, and returns the solution times `largest`.
    fn end(&mut self, length: f32, largest: f64) -> Result<Vec<Vector3<f64>>, RestError>;
}

/// Inner products of the first cycle.
#[derive(Clone, Copy, Default)]
pub(crate) struct Begin {
    /// The residual times `z`.
    pub energy: f64,
    /// The direction times its product with the matrix.
    pub curvature: f64,
}

/// Inner products after a step and a cycle.
#[derive(Clone, Copy, Default)]
pub(crate) struct Advance {
    /// Square of `x`.
    pub square: f64,
    /// The residual times `z`.
    pub energy: f64,
}

/// Inner products when the direction turns.
#[derive(Clone, Copy, Default)]
pub(crate) struct Turn {
    /// Square of the old direction, and its product with the new one.
    pub square: f64,
    pub along: f64,
    /// The new direction times its product with the matrix.
    pub curvature: f64,
}

/// Solves the equations with this right-hand side until the residual, in the norm of the
/// preconditioner, is `tolerance` of that at zero, and the way that is still to come, as the last
/// steps suggest, is `tolerance` of the length of `x`. The residual alone says little about the
/// length where some forces are much stiffer than others. Ends early where the matrix is not
/// positive definite. In the end the solution moves along the direction that the last cycle found,
/// which needs no cycle.
///
/// The product of the matrix and a direction follows from those of the cycles, which have them at
/// hand (Chronopoulos and Gear, J. Comput. Appl. Math. 25, 1989).
pub(crate) fn solve(
    equations: &mut impl Equations,
    right: &[Vector3<f64>],
    tolerance: f64,
    most_cycles: usize,
) -> Result<Solution, RestError> {
    // Single precision has a smaller range of exponents.
    let largest = right.par_iter().with_min_len(ROWS).map(Vector3::amax).reduce(|| 0.0, f64::max);
    let Begin { mut energy, mut curvature } = equations.begin(right, largest)?;
    let first = energy;
    // Of `x`.
    let mut square = 0.0;
    let (mut cycles, mut indefinite, mut is_spent) = (1, false, false);
    let mut steps = Steps::default();
    while cycles < most_cycles
        && energy > 0.0
        && (energy > tolerance * tolerance * first || steps.to_come() > tolerance * f64::sqrt(square))
    {
        if curvature.is_nan() || curvature <= 0.0 {
            indefinite = true;
            break;
        }
        let length = energy / curvature;
        let after = equations.advance(length as f32)?;
        square = after.square;
        cycles += 1;
        if after.energy.is_nan() || after.energy <= 0.0 {
            is_spent = true;
            break;
        }
        let ratio = (after.energy / energy) as f32;
        energy = after.energy;
        let turn = equations.turn(ratio)?;
        steps.push(length, turn.square, turn.along);
        curvature = turn.curvature;
    }
    let last = match energy / curvature {
        _ if is_spent => 0.0,
        length if energy > 0.0 && curvature > 0.0 => length,
        // There is no other solution than the result of the first cycle.
        _ if cycles == 1 => 1.0,
        _ => 0.0,
    };
    Ok(Solution { x: equations.end(last as f32, largest)?, cycles, indefinite })
}

/// The last steps of an iteration. The length of a single one says little, so they count in pairs.
#[derive(Default)]
struct Steps {
    /// Square of the last step, and its length along the direction of the next one, over the factor
    /// of that one.
    last: Option<(f64, f64)>,
    /// Lengths of the last pairs, the latest at the end.
    pairs: Vec<f64>,
}

impl Steps {
    /// Adds the step `length · d`, with the square of `d` and its product with the next direction.
    fn push(&mut self, length: f64, square: f64, along: f64) {
        let step = length * length * square;
        if let Some((before, product)) = self.last {
            self.pairs.push((step + before + 2.0 * length * product).max(0.0).sqrt());
        }
        self.last = Some((step, length * along));
    }

    /// Estimate of the length of all steps after these: pairs shrink by a constant ratio.
    fn to_come(&self) -> f64 {
        let [.., before, _, last] = self.pairs[..] else { return f64::INFINITY };
        let ratio = (last / before).max(0.5);
        if ratio < 1.0 { last * ratio / (1.0 - ratio) } else { f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::Body;
    use crate::curvature::Curvature;
    use crate::host::{HostEquations, Vectors, unscaled};
    use crate::multigrid::Multigrid;
    use crate::settle::dot;
    use crate::smoother::Operator;
    use crate::springs::block;

    /// The solution after some cycles uses the result of the last one: what is left is orthogonal
    /// to it.
    #[test]
    fn each_cycle_gives_a_direction_of_the_solution() {
        let body = Body::of(&block(), [0.0; 3]).unwrap();
        let mut matrix = body.empty_matrix();
        body.fill(&mut matrix, &body.start, Curvature::Stretched, 0.0);
        let places: Vec<_> = body.free.iter().map(|&v| body.start[v as usize]).collect();
        let mut multigrid = Multigrid::new(&matrix, &places);
        let right: Vec<_> = places.iter().map(|x| Vector3::new((40.0 * x.z).sin(), x.x, 1.0)).collect();
        let residual = |x: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            let of_row = |row: usize| {
                let mut left = right[row];
                matrix.for_each(row, |column, block| left -= Matrix3::from(block) * x[column]);
                left
            };
            (0..x.len()).map(of_row).collect()
        };
        let mut vectors = Vectors::default();
        let mut before = vec![Vector3::zeros(); right.len()];
        for most in 1..5 {
            let mut equations =
                HostEquations { matrix: &matrix, multigrid: &mut multigrid, vectors: &mut vectors };
            let found = solve(&mut equations, &right, 0.0, most).unwrap();
            assert_eq!((found.cycles, found.indefinite), (most, false));
            let left = residual(&before);
            equations.begin(&left, 1.0).unwrap();
            let cycle: Vec<_> = vectors.z.iter().map(|z| unscaled(z, 1.0)).collect();
            let along = dot(&residual(&found.x), &cycle) / dot(&left, &cycle);
            assert!(along.abs() < 1e-4, "{along:e} after {most} cycles");
            // Control: of a shorter last direction as much is left as is missing.
            let shorter: Vec<_> = before.iter().zip(&found.x).map(|(a, b)| a + (b - a) * 0.9).collect();
            let along = dot(&residual(&shorter), &cycle) / dot(&left, &cycle);
            assert!((along - 0.1).abs() < 1e-2, "control: {along}");
            before = found.x;
        }
    }
}
