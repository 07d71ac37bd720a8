//! The largest value around each point of a grid.

use rayon::prelude::*;

/// The largest of the values at each point and its 26 neighbors, in grid order: the largest value
/// in a row of three points along each axis, one axis after the other.
pub(crate) fn largest_around(mut values: Vec<f32>, shape: [usize; 3]) -> Vec<f32> {
    let [nx, ny, nz] = shape;
    let mut other = vec![0.0; values.len()];
    for (count, stride) in [(nx, 1), (ny, nx), (nz, nx * ny)] {
        other.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
            let first = row * nx;
            for (n, out) in out.iter_mut().enumerate() {
                let point = first + n;
                let at = point / stride % count;
                let mut most = values[point];
                if at > 0 {
                    most = most.max(values[point - stride]);
                }
                if at + 1 < count {
                    most = most.max(values[point + stride]);
                }
                *out = most;
            }
        });
        std::mem::swap(&mut values, &mut other);
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_point_gets_the_largest_value_of_its_neighborhood() {
        let shape = [5, 4, 3];
        let value = |[i, j, k]: [usize; 3]| ((7 * i + 11 * j + 13 * k) % 17) as f32 - 8.0;
        let points = || (0..60).map(|n| [n % 5, n / 5 % 4, n / 20]);
        let found = largest_around(points().map(value).collect(), shape);
        for (at, found) in points().zip(found) {
            let near = |other: &[usize; 3]| (0..3).all(|axis| other[axis].abs_diff(at[axis]) <= 1);
            let expected = points().filter(near).map(value).fold(f32::NEG_INFINITY, f32::max);
            assert_eq!(found, expected, "{at:?}");
        }
    }
}
