//! Line and point charts as self-contained SVG.

mod span;

use std::fmt::Write;

use span::Span;

/// Scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Linear scale.
    Linear,
    /// Logarithmic scale. Values that are not above zero are omitted.
    Log,
}

/// One axis of a chart.
#[derive(Clone, Copy, Debug)]
pub struct Axis<'a> {
    /// Quantity and unit, as in `"gape / mm"`.
    pub label: &'a str,
    /// Linear or logarithmic scale.
    pub scale: Scale,
}

/// A series of points.
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Points `[x, y]`. The line is interrupted at values that are not finite.
    pub points: &'a [[f64; 2]],
    /// Style of the points.
    pub mark: Mark,
}

/// Style of the points of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line through them.
    Line,
    /// A thin line with a dot at each point.
    Dots,
    /// A small ring at each point, without a line.
    Rings,
    /// A wide pale band behind all other series with a ring around each point. It emphasizes some
    /// points, such as a Pareto front.
    Band,
}

/// Largest number of series with a legend inside the plot.
pub const INSIDE: usize = 5;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 440.0;
/// Plot area: left, top, right, bottom.
const AREA: [f64; 4] = [76.0, 44.0, 700.0, 384.0];
/// Colors that are distinguishable without full color vision (Okabe and Ito, 2008).
const COLORS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// Draws a chart as an SVG document with title, axes, ticks and legend. The legend is in the
/// emptiest corner of the plot, or next to the plot if there are more than [`INSIDE`] series. The
/// attributes `data-area` and `data-x` of the document place values on a linear x axis.
///
/// ```
/// use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};
/// let axis = |label| Axis { label, scale: Scale::Linear };
/// let gape = Series { name: "with tension", points: &[[0.0, 4.0], [1.0, 9.5]], mark: Mark::Line };
/// let svg = line_chart("Wound", axis("time / s"), axis("gape / mm"), &[gape]);
/// assert!(svg.starts_with("<svg") && svg.contains("gape / mm"));
/// ```
pub fn line_chart(title: &str, x: Axis<'_>, y: Axis<'_>, series: &[Series<'_>]) -> String {
    let [left, top, right, bottom] = AREA;
    let across = Span::new(x.scale, series.iter().flat_map(|s| s.points).map(|p| p[0]), [left, right]);
    let upward = Span::new(y.scale, series.iter().flat_map(|s| s.points).map(|p| p[1]), [bottom, top]);
    let outside = series.len() > INSIDE;
    let [legend_width, legend_height] = legend_size(series);
    let [width, height] =
        if outside { [WIDTH + legend_width, HEIGHT.max(top + legend_height)] } else { [WIDTH, HEIGHT] };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"13\"{}>\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        place_of_values(&across)
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
    let (middle, center) = ((left + right) / 2.0, (top + bottom) / 2.0);
    let text = |x: f64, y: f64, rest: &str, label: &str| {
        format!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\"{rest}>{}</text>\n", escape(label))
    };
    add(format_args!("{}", text(middle, 26.0, " font-size=\"16\" font-weight=\"bold\"", title)));
    add(format_args!("{}", text(middle, HEIGHT - 12.0, "", x.label)));
    add(format_args!("{}", text(20.0, center, &format!(" transform=\"rotate(-90 20 {center})\""), y.label)));
    let legend = if outside { [right, top] } else { legend_corner(series, &across, &upward) };
    let bands_first = (0..series.len()).filter(|&n| series[n].mark == Mark::Band);
    let then_the_others = (0..series.len()).filter(|&n| series[n].mark != Mark::Band);
    for number in bands_first.chain(then_the_others) {
        let line = &series[number];
        let style = style(line.mark, number);
        add(format_args!("<path d=\"{}\" fill=\"none\" {style}/>\n", path(line, &across, &upward)));
        let row = legend[1] + 18.0 + 18.0 * number as f64;
        let [sample, name] = [legend[0] + 12.0, legend[0] + 40.0];
        add(format_args!("<path d=\"M{sample} {}h22\" fill=\"none\" {style}/>\n", row - 4.5));
        add(format_args!("<text x=\"{name}\" y=\"{row}\">{}</text>\n", escape(line.name)));
        let dot = dot(line.mark, number);
        if !dot.is_empty() {
            let places = line.points.iter().filter_map(|&[x, y]| Some([across.place(x)?, upward.place(y)?]));
            for [x, y] in places.chain([[sample + 11.0, row - 4.5]]) {
                add(format_args!("<circle cx=\"{x:.2}\" cy=\"{y:.2}\" {dot}/>\n"));
            }
        }
    }
    svg.push_str("</svg>\n");
    svg
}

/// SVG attributes that say where a value on the x axis is, for programs that mark one: the left,
/// top, right and bottom of the plot area, and the values at its left and right. None for a
/// logarithmic axis.
fn place_of_values(across: &Span) -> String {
    let [left, top, right, bottom] = AREA;
    across.linear_ends().map_or_else(String::new, |[low, high]| {
        format!(" data-area=\"{left} {top} {right} {bottom}\" data-x=\"{low} {high}\"")
    })
}

/// SVG attributes of the line of a series.
fn style(mark: Mark, number: usize) -> String {
    let color = COLORS[number % COLORS.len()];
    // The eighth and later lines are dashed, so that no two lines look alike.
    let dash = match number / COLORS.len() {
        0 => String::new(),
        round => format!(" stroke-dasharray=\"{0} {0}\"", 2 * round + 1),
    };
    match mark {
        Mark::Line => format!("stroke=\"{color}\" stroke-width=\"2\"{dash}"),
        Mark::Rings => "stroke=\"none\"".to_owned(),
        Mark::Dots => format!("stroke=\"{color}\" stroke-width=\"1.2\"{dash}"),
        Mark::Band => {
            "stroke=\"#bbb\" stroke-width=\"9\" stroke-linejoin=\"round\" opacity=\"0.6\"".to_owned()
        }
    }
}

/// SVG attributes of the mark at each point; empty if there is none.
fn dot(mark: Mark, number: usize) -> String {
    match mark {
        Mark::Line => String::new(),
        Mark::Rings => {
            let color = COLORS[number % COLORS.len()];
            format!("r=\"3.5\" fill=\"white\" stroke=\"{color}\" stroke-width=\"1.3\"")
        }
        Mark::Dots => format!("r=\"3\" fill=\"{}\"", COLORS[number % COLORS.len()]),
        Mark::Band => "r=\"6.5\" fill=\"none\" stroke=\"#777\" stroke-width=\"1.5\"".to_owned(),
    }
}

/// Width and height of the legend.
fn legend_size(series: &[Series<'_>]) -> [f64; 2] {
    let longest = series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
    [52.0 + 8.0 * longest as f64, 12.0 + 18.0 * series.len() as f64]
}

/// Left and top of the legend: the corner of the plot area in which the fewest points lie.
fn legend_corner(series: &[Series<'_>], across: &Span, upward: &Span) -> [f64; 2] {
    let [left, top, right, bottom] = AREA;
    let [width, height] = legend_size(series);
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
            let svg =
                line_chart("", axis("x"), axis("y"), &[Series { name: "name", points, mark: Mark::Line }]);
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

    #[test]
    fn the_document_says_where_values_are() {
        let chart = |scale| {
            let axis = |label| Axis { label, scale };
            let points = [[0.0, 1.0], [2.0, 3.0]];
            line_chart(
                "",
                axis("x"),
                axis("y"),
                &[Series { name: "name", points: &points, mark: Mark::Line }],
            )
        };
        let svg = chart(Scale::Linear);
        let attribute = |name: &str| -> Vec<f64> {
            let text = svg.split(&format!(" {name}=\"")).nth(1).and_then(|s| s.split('"').next());
            text.unwrap_or_default().split(' ').filter_map(|number| number.parse().ok()).collect()
        };
        let (area, ends) = (attribute("data-area"), attribute("data-x"));
        let place = |x: f64| area[0] + (x - ends[0]) / (ends[1] - ends[0]) * (area[2] - area[0]);
        let path = svg.split("<path d=\"M").find(|tag| tag.contains('L')).unwrap_or_default();
        let xs: Vec<f64> = path
            .split('"')
            .next()
            .unwrap_or_default()
            .split('L')
            .filter_map(|point| point.split(' ').next()?.parse().ok())
            .collect();
        assert!((xs[0] - place(0.0)).abs() < 0.01 && (xs[1] - place(2.0)).abs() < 0.01, "{xs:?}");
        assert!(!chart(Scale::Log).contains("data-x"));
    }

    #[test]
    fn dots_and_rings_are_drawn_where_there_is_a_value() {
        let axis = |label| Axis { label, scale: Scale::Log };
        let points = [[1.0, 1.0], [10.0, f64::NAN], [100.0, 0.0], [1000.0, 0.1]];
        let chart =
            |mark| line_chart("", axis("x"), axis("y"), &[Series { name: "name", points: &points, mark }]);
        let dots = |mark| chart(mark).matches("<circle").count();
        assert_eq!(
            [dots(Mark::Line), dots(Mark::Dots), dots(Mark::Rings), dots(Mark::Band)],
            [0, 3, 3, 3],
            "two and one in the legend"
        );
    }

    #[test]
    fn a_long_legend_is_next_to_the_plot() {
        let axis = |label| Axis { label, scale: Scale::Linear };
        let one = Series { name: "name", points: &[[0.0, 1.0]], mark: Mark::Dots };
        let size = |what: &str, count| {
            let svg = line_chart("", axis("x"), axis("y"), &vec![one; count]);
            svg.split(&format!(" {what}=\"")).nth(1).and_then(|s| s.split('"').next()?.parse::<f64>().ok())
        };
        assert_eq!(size("width", INSIDE), Some(WIDTH));
        assert!(size("width", INSIDE + 1) > Some(WIDTH));
        assert_eq!(size("height", INSIDE + 1), Some(HEIGHT));
        assert!(size("height", 40) > Some(18.0 * 40.0), "every name has its row");
    }
}
