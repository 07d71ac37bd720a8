//! What cuts: a straight edge, swept along a straight line.

/// A parallelogram, in steps of the grid: the segment from `from` to `to`, swept by `along`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blade {
    /// One end of the edge where it begins.
    pub from: [f64; 3],
    /// Its other end.
    pub to: [f64; 3],
    /// How far, and where, it is swept.
    pub along: [f64; 3],
}

impl Blade {
    /// Whether the blade passes between `a` and `b`. A point in its plane counts as on the side that its normal `(to − from) × along`
    /// points away from, so that of two links that meet there one is cut; its rim counts as blade.
    pub fn crosses(&self, a: [f64; 3], b: [f64; 3]) -> bool {
        let edge = minus(self.to, self.from);
        let normal = cross(edge, self.along);
        let height = |p: [f64; 3]| dot(minus(p, self.from), normal);
        let (over_a, over_b) = (height(a), height(b));
        if (over_a > 0.0) == (over_b > 0.0) {
            return false;
        }
        let share = over_a / (over_a - over_b);
        let met = minus([0, 1, 2].map(|c| a[c] + share * (b[c] - a[c])), self.from);
        // met = s·edge + t·along
        let square = dot(normal, normal);
        let s = dot(cross(met, self.along), normal) / square;
        let t = dot(cross(edge, met), normal) / square;
        (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] - b[c])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_through_the_parallelogram_are_crossed_and_others_are_not() {
        let blade = Blade { from: [0.5, 0.0, 0.0], to: [0.5, 2.0, 0.0], along: [0.0, 1.0, 3.0] };
        let link = |y: f64, z: f64| blade.crosses([0.0, y, z], [1.0, y, z]);
        assert!(link(1.0, 1.0) && link(1.5, 3.0) && link(0.0, 0.0) && link(2.9, 2.9));
        assert!(!link(0.2, 3.0) && !link(3.2, 3.0) && !link(1.0, -0.1) && !link(1.0, 3.1));
        assert!(blade.crosses([1.0, 1.0, 1.0], [0.0, 1.0, 1.0]), "from either side");
        assert!(!blade.crosses([0.0, 1.0, 1.0], [0.4, 1.0, 1.0]), "beside it");
        assert!(!blade.crosses([0.5, 0.0, 0.0], [0.5, 2.0, 1.0]), "within it");
        let halves = [[0.0, 0.5], [0.5, 1.0]].map(|[a, b]| blade.crosses([a, 1.0, 1.0], [b, 1.0, 1.0]));
        assert_eq!(
            halves.iter().filter(|crossed| **crossed).count(),
            1,
            "an element in its plane is on one side"
        );
    }

    #[test]
    fn a_blade_without_area_crosses_nothing() {
        for along in [[0.0; 3], [0.0, 2.0, 0.0], [f64::NAN; 3]] {
            let blade = Blade { from: [0.5, -1.0, 0.0], to: [0.5, 1.0, 0.0], along };
            assert!(!blade.crosses([0.0; 3], [1.0, 0.0, 0.0]));
        }
    }
}
