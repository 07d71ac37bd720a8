//! Points that lie at the same place, though their coordinates have been rounded differently.

use std::collections::HashMap;

use nalgebra::Point3;

/// Distance up to which two points lie at the same place, in lattice steps. Rounding moves a point
/// by less than a thousandth of this.
const TOLERANCE: f64 = 1e-3;

/// Width of the cells in which places are looked up, over the tolerance.
const WIDTH: f64 = 16.0;

/// Places with numbers.
pub(super) struct Places {
    tolerance_m: f64,
    count: u32,
    /// The numbers of the places in each cell.
    cells: HashMap<[i64; 3], Vec<(Point3<f64>, u32)>>,
}

impl Places {
    /// No places yet, in a lattice with this step.
    pub(super) fn new(step_mm: f64) -> Self {
        Self { tolerance_m: TOLERANCE * step_mm / 1000.0, count: 0, cells: HashMap::new() }
    }

    /// The number of the place of a point, in local meters. It gets a new one if no point before
    /// lies at its place.
    pub(super) fn number(&mut self, at: Point3<f32>) -> u32 {
        let at: Point3<f64> = at.cast();
        let tolerance = self.tolerance_m;
        let cell = |coordinate: f64| (coordinate / (WIDTH * tolerance)).floor() as i64;
        let [x, y, z] = [at.x, at.y, at.z].map(|c| cell(c - tolerance)..=cell(c + tolerance));
        for (x, y, z) in x
            .flat_map(|x| y.clone().map(move |y| (x, y)))
            .flat_map(|(x, y)| z.clone().map(move |z| (x, y, z)))
        {
            let known = self.cells.get(&[x, y, z]).into_iter().flatten();
            let same = |(place, _): &&(Point3<f64>, u32)| (place - at).norm() <= tolerance;
            if let Some(&(_, number)) = known.into_iter().find(same) {
                return number;
            }
        }
        let number = self.count;
        self.count += 1;
        self.cells.entry([at.x, at.y, at.z].map(cell)).or_default().push((at, number));
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points a rounding apart are one place, also across the border of two cells, and points a
    /// hundredth of a step apart are two.
    #[test]
    fn rounding_does_not_make_a_new_place() {
        let mut places = Places::new(3.0);
        let border = (5.0 * WIDTH * TOLERANCE * 0.003) as f32;
        for x in [0.1, border, -border, 0.25] {
            let at = Point3::new(x, 0.2, -0.3);
            let number = places.number(at);
            for axis in 0..3 {
                for up in [true, false] {
                    let mut near = at;
                    near[axis] = if up { at[axis].next_up() } else { at[axis].next_down() };
                    assert_eq!(places.number(near), number, "{near}");
                }
                let mut apart = at;
                apart[axis] += 3e-5;
                assert_ne!(places.number(apart), number, "{apart}");
            }
        }
        assert_eq!(places.count, 16);
    }
}
