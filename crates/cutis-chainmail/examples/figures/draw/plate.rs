//! Panels next to each other at one scale, with a legend below.

use super::look::{Line, Look};
use super::specimen::Specimen;
use super::svg::{Point, Svg};

const WIDTH: f64 = 840.0;
/// White space around the plate and between panels.
const MARGIN: f64 = 24.0;
/// Height of a panel's title, and of the line below it.
const LINE: f64 = 20.0;

/// A state of a specimen with a title above and a line of text below.
pub struct Panel {
    pub title: String,
    pub specimen: Specimen,
    pub below: String,
    /// True if the length of each link is written next to it.
    pub lengths: bool,
    /// The look of each element, if it differs from the specimen's own.
    pub look: Option<Vec<(u32, Look)>>,
}

/// An entry of the legend.
#[derive(Clone, Copy)]
pub enum Sample {
    Element(Look, &'static str),
    Link(Line, &'static str),
    /// The colors of distances from 0 to this number of steps.
    Distances(f64),
}

/// Entries for a drag, which most legends begin with.
pub const DRAG: [Sample; 4] = [
    Sample::Element(Look::Grabbed, "grabbed"),
    Sample::Link(Line::Path, "its way"),
    Sample::Element(Look::Soft, "moved"),
    Sample::Element(Look::Unmoved, "where it was"),
];

impl Panel {
    pub fn new(title: impl Into<String>, specimen: Specimen) -> Self {
        Self { title: title.into(), specimen, below: String::new(), lengths: false, look: None }
    }
}

/// Draws panels in `columns` columns, with at most `most` pixels per step.
pub fn plate(columns: usize, most: f64, panels: &[Panel], legend: &[Sample]) -> String {
    let [low, high] = span(panels);
    let width = (WIDTH - MARGIN * (columns + 1) as f64) / columns as f64;
    let radius = |scale: f64| (0.17 * scale).clamp(2.4, 6.0);
    // Lengths stand above links, and elements are larger than points.
    let scale = most.min((width - 20.0) / (high[0] - low[0]));
    let over = if panels.iter().any(|panel| panel.lengths) { 28.0 } else { 10.0 };
    let drawing = scale * (high[1] - low[1]) + over + 16.0;
    let below = if panels.iter().any(|panel| !panel.below.is_empty()) { LINE } else { 0.0 };
    let height = LINE + drawing + below;
    let rows = panels.len().div_ceil(columns) as f64;
    let legend_top = MARGIN + rows * (height + MARGIN);
    let mut svg = Svg::new([WIDTH, legend_top + LINE + 8.0]);
    for (number, panel) in panels.iter().enumerate() {
        let (column, row) = ((number % columns) as f64, (number / columns) as f64);
        let [left, top] = [MARGIN + column * (width + MARGIN), MARGIN - 8.0 + row * (height + MARGIN)];
        svg.text([left, top + 12.0], "font-weight=\"bold\"", &panel.title);
        let origin = [
            left + (width - scale * (high[0] - low[0])) / 2.0 - scale * low[0],
            top + LINE + over + scale * high[1],
        ];
        let place = |[x, y, _]: [f64; 3]| [origin[0] + scale * x, origin[1] - scale * y];
        draw(&mut svg, panel, radius(scale), place);
        svg.text([left, top + LINE + drawing + 12.0], "font-size=\"12.5\" fill=\"#333\"", &panel.below);
    }
    draw_legend(&mut svg, legend_top, legend);
    svg.finish()
}

/// The smallest and the largest x and y of all elements in steps, including former positions of
/// grabbed elements.
fn span(panels: &[Panel]) -> [[f64; 2]; 2] {
    let mut span = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for specimen in panels.iter().map(|panel| &panel.specimen) {
        let elements = specimen.elements().map(|(element, _)| specimen.chain.position(element));
        for at in elements.chain(specimen.grabbed.map(|(_, from)| from)) {
            for axis in 0..2 {
                span[0][axis] = span[0][axis].min(at[axis]);
                span[1][axis] = span[1][axis].max(at[axis]);
            }
        }
    }
    span
}

fn draw(svg: &mut Svg, panel: &Panel, radius: f64, place: impl Fn([f64; 3]) -> Point) {
    let specimen = &panel.specimen;
    let at = |element: u32| place(specimen.chain.position(element));
    for style in [Line::Within, Line::AtLimit, Line::Beyond] {
        let links = specimen.links().filter(|&(_, line)| line == style);
        let lines: Vec<[Point; 2]> = links.map(|(ends, _)| ends.map(at)).collect();
        svg.lines(&lines, style.style());
    }
    if panel.lengths {
        for ([a, b], _) in specimen.links() {
            let ([x0, y], [x1, _]) = (at(a), at(b));
            let length = specimen.chain.position(b)[0] - specimen.chain.position(a)[0];
            svg.text(
                [(x0 + x1) / 2.0, y - 12.0],
                "text-anchor=\"middle\" font-size=\"11\" fill=\"#333\"",
                &format!("{length}"),
            );
        }
    }
    let own: Vec<(u32, Look)> = specimen.elements().collect();
    let looks = panel.look.as_ref().unwrap_or(&own);
    for &(element, look) in looks.iter().filter(|(_, look)| *look != Look::Grabbed) {
        look.draw(svg, at(element), radius);
    }
    if let Some((element, from)) = specimen.grabbed {
        // In a row the path would cover the links.
        let aside = if panel.lengths { 13.0 } else { 0.0 };
        let way = [place(from), at(element)].map(|[x, y]| [x, y + aside]);
        svg.lines(&[way], Line::Path.style());
        Look::Grabbed.draw(svg, at(element), radius);
    }
}

fn draw_legend(svg: &mut Svg, top: f64, legend: &[Sample]) {
    let mut x = MARGIN;
    let middle = top + 4.0;
    for sample in legend {
        let (sample_width, text) = match sample {
            Sample::Element(look, text) => {
                look.draw(svg, [x + 7.0, middle], 4.5);
                (14.0, (*text).to_owned())
            }
            Sample::Link(line, text) => {
                svg.lines(&[[[x, middle], [x + 24.0, middle]]], line.style());
                (24.0, (*text).to_owned())
            }
            Sample::Distances(most) => {
                for step in 0..5 {
                    Look::Displaced(f64::from(step) / 4.0).draw(
                        svg,
                        [x + 6.0 + 12.0 * f64::from(step), middle],
                        4.5,
                    );
                }
                (60.0, format!("moved by 0 to {most:.1} steps"))
            }
        };
        svg.text([x + sample_width + 6.0, middle + 4.5], "font-size=\"12\"", &text);
        x += sample_width + 6.0 + text_width(&text) + 16.0;
    }
}

/// An upper bound of the width of a legend text in common fonts.
fn text_width(text: &str) -> f64 {
    let width = |character| match character {
        'f' | 'i' | 'j' | 'l' | 'r' | 't' | ' ' | '.' | ',' | '(' | ')' => 4.6,
        'm' | 'w' => 10.6,
        _ => 7.2,
    };
    text.chars().map(width).sum()
}
