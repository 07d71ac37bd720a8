//! How much of a tet's section along a blade the blade has cut.

/// Number of sharp borders that make a blurred one.
const SAMPLES: usize = 8;

/// The border of a cut: its depth, and the lengths over which the cut share falls from 1 to 0, to
/// both sides of its ends and of its bottom. All are in m.
///
/// The corners of tets at a sharp border are joined by the tets beyond it, so these tets do not
/// come apart. The cut would be too short by about 0.4 lattice steps at each end, and by how much
/// depends on where its end lies in a cell. With a blurred border the tets that stay joined are
/// almost uncut, and these errors average out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Border {
    along: f64,
    down: f64,
    depth: f64,
    /// Where the cut begins: at 0, or without a border.
    start: f64,
}

impl Border {
    /// The border of a cut of a length and a depth on a lattice with this step, all in m. It is
    /// blurred over a step, but over no more than a quarter of the length and half of the depth.
    pub fn new(length: f64, depth: f64, step: f64) -> Self {
        Self { along: step.min(0.25 * length), down: step.min(0.5 * depth), depth, start: 0.0 }
    }

    /// The border of a cut that begins at another cut, so that nothing holds where it begins.
    pub fn without_start(self) -> Self {
        Self { start: f64::NEG_INFINITY, ..self }
    }
}

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

    /// Share of the section that a cut with this border has passed, from 0 to 1, if it has reached
    /// a length of `reached` in m.
    pub fn cut(&self, border: &Border, reached: f64) -> f64 {
        let Border { along, down, depth, start } = *border;
        let inner = |[s, t]: &[f64; 2]| (start + along..=reached - along).contains(s) && *t <= depth - down;
        if self.corners[..self.count].iter().all(inner) {
            return 1.0;
        }
        let share = |sample: usize| {
            let inset = (2 * sample + 1) as f64 / SAMPLES as f64 - 1.0;
            self.sharply_cut([start + along * inset, reached - along * inset], depth - down * inset)
        };
        let begun = if reached < along { reached / along } else { 1.0 };
        begun * (0..SAMPLES).map(share).sum::<f64>() / SAMPLES as f64
    }

    /// Share of the area with a length in a range and a depth of at most `depth`.
    fn sharply_cut(&self, [from, to]: [f64; 2], depth: f64) -> f64 {
        let whole = self.corners[..self.count].to_vec();
        let all = area(&whole);
        if all == 0.0 {
            let middle =
                [0, 1].map(|n| whole.iter().map(|corner| corner[n]).sum::<f64>() / whole.len() as f64);
            return f64::from(u8::from((from..=to).contains(&middle[0]) && middle[1] <= depth));
        }
        let after_start = clip(&whole, |[s, _]| s - from);
        let before_end = clip(&after_start, |[s, _]| to - s);
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

    /// A blurred border cuts half of what lies on it, all of what lies a step inside it, and
    /// nothing a step beyond it. Control: a sharp one cuts a small section on its inner side.
    #[test]
    fn a_border_is_blurred_over_a_step() {
        let border = Border::new(40.0, 20.0, 4.0);
        let at = |s: f64, t: f64| {
            let corners = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]];
            Section::new(&corners.map(|[a, b]| [s + a, t + b]))
        };
        let share = |s: f64, t: f64, reached: f64| at(s, t).cut(&border, reached);
        for (s, t) in [(0.0, 5.0), (40.0, 5.0), (20.0, 20.0)] {
            assert!((share(s, t, 40.0) - 0.5).abs() < 0.07, "{s} {t}");
        }
        for (s, t, wanted) in [(4.5, 15.5, 1.0), (35.5, 5.0, 1.0), (-4.5, 5.0, 0.0), (20.0, 24.5, 0.0)] {
            assert_eq!(share(s, t, 40.0), wanted, "{s} {t}");
        }
        let inner = share(39.0, 5.0, 40.0);
        assert!((inner - 0.625).abs() < 0.07, "{inner}");
        assert_eq!(at(39.0, 5.0).sharply_cut([0.0, 40.0], 20.0), 1.0);
        // A cut begins with nothing and only grows.
        let grown: Vec<f64> = (0..=400).map(|n| share(2.0, 5.0, 0.1 * f64::from(n))).collect();
        assert_eq!(grown[0], 0.0);
        assert!(grown.is_sorted() && grown[400] > 0.7, "{grown:?}");
    }

    #[test]
    fn the_share_grows_with_length_and_depth() {
        let square = Section::new(&[[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]]);
        for (length, depth, share) in
            [(5.0, 5.0, 1.0), (2.0, 5.0, 0.5), (2.0, 1.5, 0.125), (0.5, 5.0, 0.0), (5.0, 0.9, 0.0)]
        {
            assert!((square.sharply_cut([0.0, length], depth) - share).abs() < 1e-12, "{length} {depth}");
        }
        let triangle = Section::new(&[[-1.0, 0.0], [1.0, 0.0], [1.0, 2.0]]);
        assert!((triangle.sharply_cut([0.0, 9.0], 9.0) - 0.75).abs() < 1e-12);
        let point = Section::new(&[[1.0, 1.0]; 3]);
        assert_eq!((point.sharply_cut([0.0, 2.0], 2.0), point.sharply_cut([0.0, 0.5], 2.0)), (1.0, 0.0));
    }
}
