//! How much of a tet's section along a blade the blade has cut.

/// The section of a tet along a blade: a polygon with three or four corners, in the coordinates of
/// the blade (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    corners: [[f64; 2]; 4],
    count: usize,
}

impl Section {
    /// A section from its corners, in order around it.
    pub fn new(corners: &[[f64; 2]]) -> Self {
        let mut section = Self { corners: [[0.0; 2]; 4], count: corners.len().min(4) };
        section.corners[..section.count].copy_from_slice(&corners[..section.count]);
        section
    }

    /// Share of the area with a length from 0 to `length` and a depth of at most `depth`.
    pub fn cut(&self, length: f64, depth: f64) -> f64 {
        let whole = self.corners[..self.count].to_vec();
        let all = area(&whole);
        if all == 0.0 {
            let middle =
                [0, 1].map(|n| whole.iter().map(|corner| corner[n]).sum::<f64>() / whole.len() as f64);
            return f64::from(u8::from((0.0..=length).contains(&middle[0]) && middle[1] <= depth));
        }
        let after_start = clip(&whole, |[s, _]| s);
        let before_end = clip(&after_start, |[s, _]| length - s);
        area(&clip(&before_end, |[_, t]| depth - t)) / all
    }
}

/// The part of a polygon where a linear function is not negative (Sutherland and Hodgman 1974,
/// doi:10.1145/360767.360802).
fn clip(polygon: &[[f64; 2]], inside: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (n, &to) in polygon.iter().enumerate() {
        let from = polygon[(n + polygon.len() - 1) % polygon.len()];
        let (a, b) = (inside(from), inside(to));
        if (a < 0.0) != (b < 0.0) {
            let part = a / (a - b);
            kept.push([0, 1].map(|n| from[n] + part * (to[n] - from[n])));
        }
        if b >= 0.0 {
            kept.push(to);
        }
    }
    kept
}

fn area(polygon: &[[f64; 2]]) -> f64 {
    let cross = |n: usize| {
        let (a, b) = (polygon[n], polygon[(n + 1) % polygon.len()]);
        a[0] * b[1] - a[1] * b[0]
    };
    (0..polygon.len()).map(cross).sum::<f64>().abs() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_grows_with_length_and_depth() {
        let square = Section::new(&[[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]]);
        for (length, depth, share) in
            [(5.0, 5.0, 1.0), (2.0, 5.0, 0.5), (2.0, 1.5, 0.125), (0.5, 5.0, 0.0), (5.0, 0.9, 0.0)]
        {
            assert!((square.cut(length, depth) - share).abs() < 1e-12, "{length} {depth}");
        }
        let triangle = Section::new(&[[-1.0, 0.0], [1.0, 0.0], [1.0, 2.0]]);
        assert!((triangle.cut(9.0, 9.0) - 0.75).abs() < 1e-12);
        let point = Section::new(&[[1.0, 1.0]; 3]);
        assert_eq!((point.cut(2.0, 2.0), point.cut(0.5, 2.0)), (1.0, 0.0));
    }
}
