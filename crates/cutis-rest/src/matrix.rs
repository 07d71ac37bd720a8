//! The matrix of a Newton step.

use std::sync::Arc;

use cutis_constraints::prefetch;
use simba::simd::{SimdValue, WideF32x4};

use crate::Body;
use crate::blocks::{AHEAD, Block, Pattern};
use crate::smoother::Operator;

/// The matrix of a step in single precision, applied to differences between neighbors.
///
/// The blocks `A_ij` of a row nearly cancel, because a body that moves as a whole has no new
/// forces. Rounding them would act like springs to fixed points. With `S_i = Σ_j A_ij` in double
/// precision, `A x` at a node is `S_i x_i + Σ_j A_ij (x_j − x_i)`. Then rounding is relative to the
/// strain and not to the displacement.
pub(crate) struct Matrix {
    pub(crate) pattern: Arc<Pattern>,
    /// The blocks one after the other, each column by column, and a zero, so that four numbers can
    /// be read at the last column.
    pub(crate) values: Vec<f32>,
    /// `S_i`, with a zero after each column.
    pub(crate) sums: Vec<[[f32; 4]; 3]>,
}

impl Operator<3, 4> for Matrix {
    fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    fn block(&self, place: usize) -> Block<3, 3> {
        let values = &self.values[9 * place..][..9];
        std::array::from_fn(|column| std::array::from_fn(|row| f64::from(values[3 * column + row])))
    }

    fn diagonal(&self, node: usize) -> Block<3, 3> {
        let mut sum = [[0.0; 3]; 3];
        for (to, from) in sum.iter_mut().zip(&self.sums[node]) {
            for n in 0..3 {
                to[n] = f64::from(from[n]);
            }
        }
        for (column, block) in self.row(node) {
            if column != node {
                for (to, from) in sum.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
                    *to -= from;
                }
            }
        }
        sum
    }

    #[inline(always)]
    fn row_times(&self, node: usize, x: impl Fn(usize) -> [f32; 4]) -> [f32; 4] {
        let own = WideF32x4::from(x(node));
        let mut sum = WideF32x4::splat(0.0);
        let places = self.pattern.places(node);
        let neighbors = &self.pattern.columns[places.clone()];
        let mut values = &self.values[9 * places.start..9 * places.end + 1];
        let mut ahead = 9 * places.start + AHEAD;
        for &neighbor in neighbors {
            // The block, and the number after it.
            let Some(block) = values.first_chunk::<10>() else { break };
            values = &values[9..];
            prefetch(&self.values, ahead);
            ahead += 9;
            let difference = columns(WideF32x4::from(x(neighbor as usize)) - own);
            for (column, difference) in difference.into_iter().enumerate() {
                let block: [f32; 4] = std::array::from_fn(|row| block[3 * column + row]);
                sum += WideF32x4::from(block) * difference;
            }
        }
        // Last, because it may be much larger. Coming first, it would round off all others.
        for (column, own) in self.sums[node].iter().zip(columns(own)) {
            sum += WideF32x4::from(*column) * own;
        }
        let [x, y, z, _] = sum.into();
        [x, y, z, 0.0]
    }
}

/// The first three numbers, each in all lanes.
#[inline(always)]
fn columns(x: WideF32x4) -> [WideF32x4; 3] {
    let x: [f32; 4] = x.into();
    std::array::from_fn(|n| WideF32x4::splat(x[n]))
}

impl Body {
    /// A matrix of zeros with a block for each pair of vertices that share a constraint.
    pub(crate) fn empty_matrix(&self) -> Matrix {
        let count = self.free.len();
        Matrix {
            pattern: self.pattern.clone(),
            values: vec![0.0; 9 * self.pattern.columns.len() + 1],
            sums: vec![[[0.0; 4]; 3]; count],
        }
    }
}
