//! Counter-based random numbers. Each value is a pure function of a key and a counter, so it does
//! not depend on order or threads.
//!
//! The functions use only integer operations and floating-point operations that IEEE 754 specifies
//! exactly. Therefore the bits are the same on every machine.

/// The SplitMix64 output function (Steele, Lea & Flood 2014) at position `counter` of the stream
/// `key`.
pub(super) fn hash(key: u64, counter: u64) -> u64 {
    let mut h = key.wrapping_add(counter.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    h = (h ^ (h >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    h ^ (h >> 31)
}

/// A uniform number in `[0, 1)` from the upper 24 bits of a hash.
fn unit(hash: u64) -> f32 {
    (hash >> 40) as f32 * (1.0 / 16_777_216.0)
}

/// A nearly normal number with mean 0 and variance 1: the sum of the eight bytes of a hash,
/// centered and scaled (Irwin–Hall, n = 8).
pub(super) fn normal(hash: u64) -> f32 {
    const PAIRS: u64 = 0x00FF_00FF_00FF_00FF;
    let pairs = (hash & PAIRS) + ((hash >> 8) & PAIRS);
    let sum = pairs.wrapping_mul(0x0001_0001_0001_0001) >> 48;
    // A byte has the mean 127.5 and the variance (256² − 1)/12. For eight bytes these are 1020 and
    // 43690.
    (sum as f32 - 1020.0) * (1.0 / 209.021_53)
}

/// A sequence of random numbers for building the anatomy.
pub(super) struct Random {
    key: u64,
    counter: u64,
}

impl Random {
    /// The sequence with number `stream` of a seed. Different streams are independent.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        Self { key: hash(seed, stream), counter: 0 }
    }

    /// A uniform number in `[low, high)`.
    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        self.counter += 1;
        low + (high - low) * unit(hash(self.key, self.counter))
    }

    /// A point with each coordinate within `reach` of `center`.
    pub(super) fn near(&mut self, center: [f32; 3], reach: f32) -> [f32; 3] {
        center.map(|c| c + self.between(-reach, reach))
    }
}

/// A smooth random field in `[-1, 1]` (value noise): random values on a cubic lattice, interpolated
/// with a cubic ramp.
pub(super) struct Field {
    key: u64,
    cell_mm: f32,
}

impl Field {
    /// The field with number `stream` of a seed. Its features are about `cell_mm` wide.
    pub(super) fn new(seed: u64, stream: u64, cell_mm: f32) -> Self {
        Self { key: hash(seed, stream), cell_mm }
    }

    fn corner(&self, cell: [i32; 3]) -> f32 {
        // 21 bits per axis suffice for any cell in the field of view.
        let packed = cell.iter().fold(0, |bits, &c| (bits << 21) | (c as u64 & 0x1F_FFFF));
        2.0 * unit(hash(self.key, packed)) - 1.0
    }

    fn locate(&self, mm: f32) -> (i32, f32) {
        let scaled = mm / self.cell_mm;
        let cell = scaled.floor();
        let t = scaled - cell;
        (cell as i32, t * t * (3.0 - 2.0 * t))
    }

    /// Computes the values at `(x, y, z)` for each `x` of an ascending row. `columns` is a buffer.
    pub(super) fn fill_row(&self, xs: &[f32], y: f32, z: f32, columns: &mut Vec<f32>, out: &mut [f32]) {
        let (Some(&first), Some(&last)) = (xs.first(), xs.last()) else { return };
        let ((j, v), (k, w)) = (self.locate(y), self.locate(z));
        let (start, end) = (self.locate(first).0, self.locate(last).0 + 1);
        columns.clear();
        columns.extend((start..=end).map(|i| {
            let near = lerp(self.corner([i, j, k]), self.corner([i, j + 1, k]), v);
            let far = lerp(self.corner([i, j, k + 1]), self.corner([i, j + 1, k + 1]), v);
            lerp(near, far, w)
        }));
        for (value, &x) in out.iter_mut().zip(xs) {
            let (i, u) = self.locate(x);
            let column = (i - start) as usize;
            *value = lerp(columns[column], columns[column + 1], u);
        }
    }
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + t * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_has_mean_zero_and_variance_one() {
        let n = 200_000;
        let values: Vec<f64> = (0..n).map(|i| f64::from(normal(hash(7, i)))).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n as f64;
        // Five standard errors of each estimate.
        assert!(mean.abs() < 5.0 / (n as f64).sqrt(), "mean {mean}");
        assert!((variance - 1.0).abs() < 5.0 * (2.0 / n as f64).sqrt(), "variance {variance}");
    }

    #[test]
    fn hash_is_splitmix64() {
        // First outputs of the published generator for the seed 1234567.
        assert_eq!(hash(1_234_567, 0), 6_457_827_717_110_365_317);
        assert_eq!(hash(1_234_567, 1), 3_203_168_211_198_807_973);
    }

    #[test]
    fn field_is_continuous_and_does_not_depend_on_the_row() {
        let field = Field::new(3, 1, 10.0);
        let xs: Vec<f32> = (0..400).map(|i| -200.0 + i as f32).collect();
        let (mut whole, mut part, mut columns) = (vec![0.0; 400], vec![0.0; 100], Vec::new());
        field.fill_row(&xs, 12.0, -7.0, &mut columns, &mut whole);
        field.fill_row(&xs[150..250], 12.0, -7.0, &mut columns, &mut part);
        assert_eq!(whole[150..250], part);
        // The ramp is at most 1.5 times as steep as a straight line, and lattice values differ by
        // at most 2.
        assert!(whole.windows(2).all(|w| (w[1] - w[0]).abs() <= 0.3 + 1e-5));
        assert!(whole.iter().any(|&v| v > 0.3) && whole.iter().any(|&v| v < -0.3));
    }
}
