//! The matrix of a Newton step.

use simba::simd::{SimdValue, WideF32x4};

use crate::Body;
use crate::blocks::Block;
use crate::smoother::Operator;
use crate::symmetric::Above;

/// The matrix of a step in single precision, applied to differences between neighbors.
///
/// The blocks `A_ij` of a row nearly cancel, because a body that moves as a whole has no new
/// forces. Rounding them would act like springs to fixed points. With `S_i = Σ_j A_ij` in double
/// precision, `A x` at a node is `S_i x_i + Σ_j A_ij (x_j − x_i)`. Then rounding is relative to the
/// strain and not to the displacement.
pub(crate) struct Matrix {
    pub(crate) above: Above<3>,
    /// `S_i`, with a zero after each column.
    pub(crate) sums: Vec<[[f32; 4]; 3]>,
}

impl Operator<3, 4> for Matrix {
    fn above(&self) -> &Above<3> {
        &self.above
    }

    fn diagonal(&self, node: usize) -> Block<3, 3> {
        let mut diagonal = [[0.0; 3]; 3];
        self.for_each(node, |_, block| diagonal = block);
        diagonal
    }

    #[inline]
    fn for_each(&self, row: usize, mut each: impl FnMut(usize, Block<3, 3>)) {
        let mut diagonal: Block<3, 3> =
            self.sums[row].map(|column| std::array::from_fn(|n| f64::from(column[n])));
        for (column, block) in self.above.row(row) {
            for (to, from) in diagonal.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
                *to -= from;
            }
            each(column, block);
        }
        each(row, diagonal);
    }

    #[inline(always)]
    fn row_times(&self, node: usize, x: impl Fn(usize) -> [f32; 4]) -> [f32; 4] {
        let own = WideF32x4::from(x(node));
        let [mut sum] = self.above.row_times(node, |neighbor| [WideF32x4::from(x(neighbor)) - own]);
        // Last, because it may be much larger. Coming first, it would round off all others.
        let own: [f32; 4] = own.into();
        for (column, own) in self.sums[node].iter().zip(own) {
            sum += WideF32x4::from(*column) * WideF32x4::splat(own);
        }
        let [x, y, z, _] = sum.into();
        [x, y, z, 0.0]
    }
}

impl Body {
    /// A matrix of zeros with a block for each pair of vertices that share a constraint.
    pub(crate) fn empty_matrix(&self) -> Matrix {
        Matrix { above: Above::zeros(self.neighbors.clone()), sums: vec![[[0.0; 4]; 3]; self.free.len()] }
    }
}
