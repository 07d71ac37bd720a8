//! Evenly spaced lines along a field of directions in the plane.
//!
//! Each line begins at the least distance from another line and follows the field until it comes
//! too close to a line, as in Jobard, Lefer: *Creating Evenly-Spaced Streamlines of Arbitrary
//! Density*, Visualization in Scientific Computing 1997. Directions have no sign, so a line goes on
//! in the direction that turns least.

/// A direction in the plane and how visible its line is.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// Unit vector. The sign has no meaning.
    pub direction: [f64; 2],
    /// From 0 to 1.
    pub opacity: f32,
}

/// A point of a line.
#[derive(Clone, Copy)]
pub(super) struct LinePoint {
    pub place: [f64; 2],
    pub opacity: f32,
}

/// Length of a step over the spacing of lines.
const STEP: f64 = 1.0 / 12.0;
/// Distance over the spacing at which a line ends at another line.
const TOO_CLOSE: f64 = 0.5;
/// Share of the spacing that the beginning of a line keeps from other lines. It is below 1 so that
/// rounding does not refuse a neighbor.
const BEGIN: f64 = 0.98;
/// Length of the shortest line over the spacing.
const SHORTEST: f64 = 2.0;
/// Opacity at which a line ends.
const LEAST_OPACITY: f32 = 0.04;

/// Lines about `spacing` apart in the rectangle from the origin to `size`.
pub(super) fn evenly_spaced(
    field: impl Fn([f64; 2]) -> Option<Sample>,
    size: [f64; 2],
    spacing: f64,
) -> Vec<Vec<LinePoint>> {
    let mut plane = Plane::new(field, size, spacing);
    let [columns, rows] = size.map(|length| (length / spacing).ceil() as usize);
    for n in 0..columns * rows {
        plane.begin([n % columns, n / columns].map(|step| (step as f64 + 0.5) * spacing));
        plane.begin_next_to_lines();
    }
    plane.lines
}

/// Lines and a grid of cells to find those near a place.
struct Plane<F> {
    field: F,
    spacing: f64,
    lines: Vec<Vec<LinePoint>>,
    /// Lines before this one have been asked for neighbors.
    asked: usize,
    /// Cells in a row; a cell is as wide as the spacing.
    columns: usize,
    cells: Vec<Vec<[f64; 2]>>,
}

impl<F: Fn([f64; 2]) -> Option<Sample>> Plane<F> {
    fn new(field: F, size: [f64; 2], spacing: f64) -> Self {
        let [columns, rows] = size.map(|length| (length / spacing) as usize + 1);
        let cells = vec![Vec::new(); columns * rows];
        Self { field, spacing, lines: Vec::new(), asked: 0, columns, cells }
    }

    /// The field at a place where a line can be seen.
    fn visible(&self, place: [f64; 2]) -> Option<Sample> {
        (self.field)(place).filter(|sample| sample.opacity >= LEAST_OPACITY)
    }

    /// Adds the line through a place, if it can be seen there, is not too short, and is far enough
    /// from all lines.
    fn begin(&mut self, place: [f64; 2]) {
        let Some(sample) = self.visible(place).filter(|_| self.is_free(place, BEGIN)) else { return };
        let here = LinePoint { place, opacity: sample.opacity };
        let [x, y] = sample.direction;
        let mut line = self.follow(here, [-x, -y], &[]);
        line.reverse();
        line.push(here);
        let ahead = self.follow(here, [x, y], &line);
        line.extend(ahead);
        if line.len() as f64 * STEP < SHORTEST {
            return;
        }
        for point in &line {
            if let Some(cell) = self.cell(point.place) {
                self.cells[cell].push(point.place);
            }
        }
        self.lines.push(line);
    }

    /// Begins lines on both sides of all lines, including those that this adds.
    fn begin_next_to_lines(&mut self) {
        while let Some(line) = self.lines.get(self.asked).cloned() {
            self.asked += 1;
            for point in line.iter().step_by((1.0 / STEP) as usize) {
                let Some(Sample { direction: [x, y], .. }) = self.visible(point.place) else { continue };
                for side in [-self.spacing, self.spacing] {
                    self.begin([point.place[0] - y * side, point.place[1] + x * side]);
                }
            }
        }
    }

    /// The points after `from` in a direction, up to the end of the line. `before` are the points
    /// behind `from`, which the line does not meet again either.
    fn follow(&self, from: LinePoint, direction: [f64; 2], before: &[LinePoint]) -> Vec<LinePoint> {
        let step = STEP * self.spacing;
        let recent = (1.0 / STEP) as usize;
        let (mut line, mut place, mut heading) = (Vec::new(), from.place, direction);
        while let Some(middle) = self.turned(ahead(place, heading, step / 2.0), heading) {
            let next = ahead(place, middle.direction, step);
            let Some(sample) = self.turned(next, middle.direction) else { break };
            let mut own = before.iter().chain(&line).rev().skip(recent);
            let meets_itself = own.any(|point| apart(point.place, next) < TOO_CLOSE * self.spacing);
            if meets_itself || !self.is_free(next, TOO_CLOSE) {
                break;
            }
            line.push(LinePoint { place: next, opacity: sample.opacity });
            (place, heading) = (next, sample.direction);
        }
        line
    }

    /// The visible field at a place, with the sign that turns least.
    fn turned(&self, place: [f64; 2], heading: [f64; 2]) -> Option<Sample> {
        let sample = self.visible(place)?;
        let [x, y] = sample.direction;
        let forward = x * heading[0] + y * heading[1] >= 0.0;
        Some(if forward { sample } else { Sample { direction: [-x, -y], ..sample } })
    }

    /// Whether no line is closer than a share of the spacing.
    fn is_free(&self, place: [f64; 2], share: f64) -> bool {
        let Some(cell) = self.cell(place) else { return false };
        let (column, row) = (cell % self.columns, cell / self.columns);
        let near = |n: usize, count: usize| n.saturating_sub(1)..(n + 2).min(count);
        let rows = self.cells.len() / self.columns;
        let mut cells = near(row, rows)
            .flat_map(|row| near(column, self.columns).map(move |column| row * self.columns + column));
        cells.all(|cell| self.cells[cell].iter().all(|other| apart(*other, place) >= share * self.spacing))
    }

    /// The cell of a place; none outside the rectangle.
    fn cell(&self, [x, y]: [f64; 2]) -> Option<usize> {
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        let (column, row) = ((x / self.spacing) as usize, (y / self.spacing) as usize);
        (column < self.columns).then_some(row * self.columns + column).filter(|cell| *cell < self.cells.len())
    }
}

fn ahead(place: [f64; 2], direction: [f64; 2], length: f64) -> [f64; 2] {
    [place[0] + direction[0] * length, place[1] + direction[1] * length]
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(field: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Vec<LinePoint>> {
        let sample = |place: [f64; 2]| {
            let [x, y] = field(place);
            let length = x.hypot(y);
            (length > 0.0).then(|| Sample { direction: [x / length, y / length], opacity: 1.0 })
        };
        evenly_spaced(sample, [200.0, 120.0], 10.0)
    }

    /// Parallel lines fill the rectangle at the spacing.
    #[test]
    fn lines_of_a_constant_field_are_parallel_and_evenly_spaced() {
        for angle in [0.0f64, 0.4, 1.2] {
            let (sin, cos) = angle.sin_cos();
            // The sign jumps from place to place and has no effect.
            let sign = |[x, y]: [f64; 2]| if (x / 7.0 + y / 3.0).sin() < 0.0 { -1.0 } else { 1.0 };
            let found = lines(|place| [cos * sign(place), sin * sign(place)]);
            let offset = |point: &LinePoint| point.place[1] * cos - point.place[0] * sin;
            let mut offsets: Vec<f64> = found.iter().map(|line| offset(&line[0])).collect();
            for (line, first) in found.iter().zip(&offsets) {
                assert!(line.iter().all(|point| (offset(point) - first).abs() < 1e-9), "{angle}");
            }
            offsets.sort_by(f64::total_cmp);
            let gaps: Vec<f64> = offsets.windows(2).map(|pair| pair[1] - pair[0]).collect();
            assert!(gaps.iter().all(|gap| (gap - 10.0).abs() < 1e-6), "{angle}: {gaps:?}");
            let width = 200.0 * sin + 120.0 * cos;
            assert!(found.len() as f64 > 0.8 * width / 10.0, "{angle}: {} lines", found.len());
        }
    }

    /// Circles: each line stays on its circle, ends when it meets itself, and keeps its distance
    /// from the others.
    #[test]
    fn lines_of_circles_keep_their_distance_and_meet_once() {
        let center = [100.0, 60.0];
        let found = lines(|[x, y]| [-(y - center[1]), x - center[0]]);
        assert!(found.len() > 5, "{}", found.len());
        for (n, line) in found.iter().enumerate() {
            let radius = apart(line[0].place, center);
            assert!(line.iter().all(|point| (apart(point.place, center) - radius).abs() < 0.5), "{radius}");
            let length = line.len() as f64 * STEP * 10.0;
            assert!(length < 1.01 * std::f64::consts::TAU * radius, "{length} around {radius}");
            for other in found[..n].iter().flatten() {
                assert!(line.iter().all(|point| apart(point.place, other.place) > 4.9), "line {n}");
            }
        }
    }

    #[test]
    fn a_line_is_not_drawn_where_it_cannot_be_seen() {
        let field = |[x, _]: [f64; 2]| {
            let opacity = if x < 100.0 { 0.5 } else { LEAST_OPACITY / 2.0 };
            (x < 150.0).then_some(Sample { direction: [1.0, 0.0], opacity })
        };
        let found = evenly_spaced(field, [200.0, 120.0], 10.0);
        assert!(found.len() > 8);
        assert!(found.iter().flatten().all(|point| point.place[0] < 100.0 && point.opacity == 0.5));
        let nothing = evenly_spaced(|_| None, [200.0, 120.0], 10.0);
        assert!(nothing.is_empty());
    }
}
