//! Panels side by side, all at the same scale, and a legend below.

use super::body::Body;
use super::look::{Line, Look};
use super::svg::{Point, Svg};

const WIDTH: f64 = 840.0;
/// White around everything, and between panels.
const MARGIN: f64 = 24.0;
/// For the title of a panel, and for the line below it.
const LINE: f64 = 20.0;

/// A state of a body with a title above and a line of text below.
pub struct Panel {
    pub title: String,
    pub body: Body,
    pub below: String,
    /// Whether the length of each link is written beside it.
    pub lengths: bool,
    /// How each element is drawn if not as the body has it.
    pub look: Option<Vec<(u32, Look)>>,
}

/// What the legend explains.
#[derive(Clone, Copy)]
pub enum Sample {
    Element(Look, &'static str),
    Link(Line, &'static str),
    /// Colors of distances up to so many steps.
    Distances(f64),
}

impl Panel {
    pub fn new(title: impl Into<String>, body: Body) -> Self {
        Self { title: title.into(), body, below: String::new(), lengths: false, look: None }
    }
}

/// The figure: panels in so many columns, none larger than `most` pixels a step.
pub fn plate(columns: usize, most: f64, panels: &[Panel], legend: &[Sample]) -> String {
    let [low, high] = span(panels);
    let width = (WIDTH - MARGIN * (columns + 1) as f64) / columns as f64;
    let radius = |scale: f64| (0.17 * scale).clamp(2.4, 6.0);
    // Lengths stand above links, and elements reach beyond their places.
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

/// What holds all elements of all panels, and where the grabbed ones were: least and greatest x and y, in steps.
fn span(panels: &[Panel]) -> [[f64; 2]; 2] {
    let mut span = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for body in panels.iter().map(|panel| &panel.body) {
        let elements = body.elements().map(|(element, _)| body.chain.position(element));
        for at in elements.chain(body.pulled.map(|(_, from)| from)) {
            for axis in 0..2 {
                span[0][axis] = span[0][axis].min(at[axis]);
                span[1][axis] = span[1][axis].max(at[axis]);
            }
        }
    }
    span
}

fn draw(svg: &mut Svg, panel: &Panel, radius: f64, place: impl Fn([f64; 3]) -> Point) {
    let body = &panel.body;
    let at = |element: u32| place(body.chain.position(element));
    for kind in [Line::Within, Line::AtLimit, Line::Beyond] {
        let links = body.links().filter(|&(_, line)| line == kind);
        let lines: Vec<[Point; 2]> = links.map(|(ends, _)| ends.map(at)).collect();
        svg.lines(&lines, kind.style());
    }
    if panel.lengths {
        for ([a, b], _) in body.links() {
            let ([x0, y], [x1, _]) = (at(a), at(b));
            let length = body.chain.position(b)[0] - body.chain.position(a)[0];
            svg.text(
                [(x0 + x1) / 2.0, y - 12.0],
                "text-anchor=\"middle\" font-size=\"11\" fill=\"#333\"",
                &format!("{length}"),
            );
        }
    }
    let own: Vec<(u32, Look)> = body.elements().collect();
    let looks = panel.look.as_ref().unwrap_or(&own);
    for &(element, look) in looks.iter().filter(|(_, look)| *look != Look::Grabbed) {
        look.draw(svg, at(element), radius);
    }
    if let Some((element, from)) = body.pulled {
        // In a row the way would lie upon the links.
        let aside = if panel.lengths { 13.0 } else { 0.0 };
        let way = [place(from), at(element)].map(|[x, y]| [x, y + aside]);
        svg.lines(&[way], Line::Pull.style());
        Look::Grabbed.draw(svg, at(element), radius);
    }
}

fn draw_legend(svg: &mut Svg, top: f64, legend: &[Sample]) {
    let mut x = MARGIN;
    let middle = top + 4.0;
    for sample in legend {
        let (wide, text) = match sample {
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
                    Look::Went(f64::from(step) / 4.0).draw(
                        svg,
                        [x + 6.0 + 12.0 * f64::from(step), middle],
                        4.5,
                    );
                }
                (60.0, format!("moved by 0 to {most:.1} steps"))
            }
        };
        svg.text([x + wide + 6.0, middle + 4.5], "font-size=\"12\"", &text);
        x += wide + 6.0 + text_width(&text) + 16.0;
    }
}

/// Width of a text of the legend, at the most that common fonts need.
fn text_width(text: &str) -> f64 {
    let width = |character| match character {
        'f' | 'i' | 'j' | 'l' | 'r' | 't' | ' ' | '.' | ',' | '(' | ')' => 4.6,
        'm' | 'w' => 10.6,
        _ => 7.2,
    };
    text.chars().map(width).sum()
}
