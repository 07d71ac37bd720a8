//! Line charts as self-contained SVG.

use std::fmt::Write;

/// How values lie along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their decimal logarithm; values that are not above zero are left out.
    Log,
}

/// One axis of a chart.
#[derive(Clone, Copy, Debug)]
pub struct Axis<'a> {
    /// Quantity and unit, as in `"gape / mm"`.
    pub label: &'a str,
    /// Linear or logarithmic.
    pub scale: Scale,
}

/// One line of a chart.
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Points `[x, y]`; the line breaks where one is not finite.
    pub points: &'a [[f64; 2]],
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 440.0;
/// Plot area: left, top, right, bottom.
const AREA: [f64; 4] = [76.0, 44.0, 700.0, 384.0];
/// Colours that can be told apart without full colour vision (Okabe and Ito, 2008).
const COLORS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// An SVG document of several lines with title, axes, ticks and legend.
///
/// ```
/// use cutis_render::plot::{Axis, Scale, Series, line_chart};
/// let axis = |label| Axis { label, scale: Scale::Linear };
/// let gape = Series { name: "with tension", points: &[[0.0, 4.0], [1.0, 9.5]] };
/// let svg = line_chart("Wound", axis("time / s"), axis("gape / mm"), &[gape]);
/// assert!(svg.starts_with("<svg") && svg.contains("gape / mm"));
/// ```
pub fn line_chart(title: &str, x: Axis<'_>, y: Axis<'_>, series: &[Series<'_>]) -> String {
    let [left, top, right, bottom] = AREA;
    let across = Span::new(x.scale, series.iter().flat_map(|s| s.points).map(|p| p[0]), [left, right]);
    let upward = Span::new(y.scale, series.iter().flat_map(|s| s.points).map(|p| p[1]), [bottom, top]);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let mut add = |text: std::fmt::Arguments<'_>| {
        // Writing to a String cannot fail.
        let _ = svg.write_fmt(text);
    };
    for (value, at) in across.ticks() {
        add(format_args!("<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#ddd\"/>\n"));
        add(format_args!(
            "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{value}</text>\n",
            bottom + 18.0
        ));
    }
    for (value, at) in upward.ticks() {
        add(format_args!("<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ddd\"/>\n"));
        add(format_args!(
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{value}</text>\n",
            left - 6.0,
            at + 4.5
        ));
    }
    add(format_args!("<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"black\"/>\n"));
    let (middle, centre) = ((left + right) / 2.0, (top + bottom) / 2.0);
    let text = |x: f64, y: f64, rest: &str, label: &str| {
        format!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\"{rest}>{}</text>\n", escape(label))
    };
    add(format_args!("{}", text(middle, 26.0, " font-size=\"16\" font-weight=\"bold\"", title)));
    add(format_args!("{}", text(middle, HEIGHT - 12.0, "", x.label)));
    add(format_args!("{}", text(20.0, centre, &format!(" transform=\"rotate(-90 20 {centre})\""), y.label)));
    let legend = legend_corner(series, &across, &upward);
    for (number, line) in series.iter().enumerate() {
        let color = COLORS[number % COLORS.len()];
        // Lines past the seventh are dashed, so that no two look alike.
        let dash = if number < COLORS.len() {
            String::new()
        } else {
            format!(" stroke-dasharray=\"{0} {0}\"", 2 * (number / COLORS.len()) + 1)
        };
        add(format_args!(
            "<path d=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"{dash}/>\n",
            path(line, &across, &upward)
        ));
        let row = legend[1] + 18.0 + 18.0 * number as f64;
        add(format_args!(
            "<path d=\"M{} {}h22\" stroke=\"{color}\" stroke-width=\"3\"{dash}/>\n",
            legend[0] + 12.0,
            row - 4.5
        ));
        add(format_args!("<text x=\"{}\" y=\"{row}\">{}</text>\n", legend[0] + 40.0, escape(line.name)));
    }
    svg.push_str("</svg>\n");
    svg
}

/// Left and top of the legend: the corner of the plot area in which the fewest points lie.
fn legend_corner(series: &[Series<'_>], across: &Span, upward: &Span) -> [f64; 2] {
    let [left, top, right, bottom] = AREA;
    let longest = series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
    let (width, height) = (52.0 + 8.0 * longest as f64, 12.0 + 18.0 * series.len() as f64);
    let covered = |corner: &[f64; 2]| {
        let inside = |&&[x, y]: &&[f64; 2]| {
            let within = |place: Option<f64>, from: f64, length| {
                place.is_some_and(|p| (0.0..=length).contains(&(p - from)))
            };
            within(across.place(x), corner[0], width) && within(upward.place(y), corner[1], height)
        };
        series.iter().flat_map(|s| s.points).filter(inside).count()
    };
    let (far, low) = ((right - width).max(left), (bottom - height).max(top));
    let corners = [[left, top], [far, top], [left, low], [far, low]];
    corners.into_iter().min_by_key(covered).unwrap_or([left, top])
}

fn path(line: &Series<'_>, across: &Span, upward: &Span) -> String {
    let mut path = String::new();
    let mut pen = 'M';
    for &[x, y] in line.points {
        match (across.place(x), upward.place(y)) {
            (Some(x), Some(y)) => {
                let _ = write!(path, "{pen}{x:.2} {y:.2}");
                pen = 'L';
            }
            _ => pen = 'M',
        }
    }
    path
}

/// A range of values laid along a range of pixels.
struct Span {
    scale: Scale,
    /// Values, or their logarithms.
    low: f64,
    high: f64,
    pixels: [f64; 2],
}

impl Span {
    fn new(scale: Scale, values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let shown = values.filter_map(|value| inner(scale, value));
        let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        let margin = if high > low { 0.04 * (high - low) } else { 0.5 * low.abs().max(f64::MIN_POSITIVE) };
        // A quantity that is never negative starts at zero if it comes near it.
        let from_zero = scale == Scale::Linear && low >= 0.0 && low <= 0.5 * high;
        let low = if from_zero { 0.0 } else { low - margin };
        let high = high + margin;
        let (low, high) = if high > low && (high - low).is_finite() { (low, high) } else { (0.0, 1.0) };
        Self { scale, low, high, pixels }
    }

    fn place(&self, value: f64) -> Option<f64> {
        let part = (inner(self.scale, value)? - self.low) / (self.high - self.low);
        Some(self.pixels[0] + part * (self.pixels[1] - self.pixels[0]))
    }

    /// Labels and their places: about six round numbers, or the decades.
    fn ticks(&self) -> Vec<(String, f64)> {
        let rough = (self.high - self.low) / 6.0;
        let decade = 10.0_f64.powf(rough.log10().floor());
        let round = [1.0, 2.0, 5.0, 10.0].map(|part| part * decade).into_iter().find(|step| *step >= rough);
        let mut step = round.unwrap_or(rough);
        if self.scale == Scale::Log {
            step = step.ceil();
        }
        let first = (self.low / step).ceil();
        let count = ((self.high / step).floor() - first).clamp(-1.0, 20.0) as i32;
        (0..=count)
            .map(|n| {
                let at = (first + f64::from(n)) * step;
                let place = self.pixels[0]
                    + (at - self.low) / (self.high - self.low) * (self.pixels[1] - self.pixels[0]);
                let label =
                    if self.scale == Scale::Log { number(10.0_f64.powf(at), 1) } else { linear(at, step) };
                (label, place)
            })
            .collect()
    }
}

/// A tick of a linear axis, with the decimals that its step needs.
fn linear(at: f64, step: f64) -> String {
    if !(1e-4..1e6).contains(&step) {
        return number(if at.abs() < step / 2.0 { 0.0 } else { at }, 3);
    }
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let text = format!("{at:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

fn number(value: f64, digits: usize) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        format!("{}", (value * 1e9).round() / 1e9)
    } else {
        format!("{value:.0$e}", digits - 1)
    }
}

fn inner(scale: Scale, value: f64) -> Option<f64> {
    let mapped = match scale {
        Scale::Linear => value,
        Scale::Log if value > 0.0 => value.log10(),
        Scale::Log => return None,
    };
    mapped.is_finite().then_some(mapped)
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_legend_keeps_away_from_the_points() {
        let axis = |label| Axis { label, scale: Scale::Linear };
        let legend = |points: &[[f64; 2]]| {
            let svg = line_chart("", axis("x"), axis("y"), &[Series { name: "name", points }]);
            let at = svg.find("h22").unwrap_or(0);
            svg[..at]
                .rsplit("M")
                .next()
                .unwrap_or_default()
                .split(' ')
                .next()
                .unwrap_or_default()
                .parse::<f64>()
                .unwrap_or(0.0)
        };
        let rising: Vec<[f64; 2]> = (0..50).map(|n| [f64::from(n), f64::from(n)]).collect();
        assert!(legend(&rising) < 120.0, "top left is free under a rising line");
        let left: Vec<[f64; 2]> = [[0.0, 0.0], [0.0, 1.0], [0.001, 1.0], [0.001, 0.0], [9.0, 0.5]].into();
        assert!(legend(&left) > 400.0, "both left corners are taken");
    }
}
