//! Looks of elements and links. The colors differ without full color vision too (Okabe and Ito,
//! 2008), and shapes, sizes and widths carry the same information.

use super::svg::{Point, Svg};

/// The look of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    /// The element has moved.
    Soft,
    /// The element has not moved.
    Unmoved,
    Rigid,
    Fixed,
    Grabbed,
    /// A shade of blue for a share (0 to 1) of the largest displacement; darker is farther.
    Displaced(f64),
}

/// The look of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    Within,
    /// A link with at least one coordinate at its limit.
    AtLimit,
    Beyond,
    /// Not a link: the path of the grabbed element.
    Path,
}

impl Look {
    /// Draws an element. Most elements have the radius `size`.
    pub fn draw(self, svg: &mut Svg, at: Point, size: f64) {
        match self {
            Self::Soft => svg.disc(at, size, "fill=\"#0072b2\""),
            Self::Unmoved => svg.disc(at, size, "fill=\"#a3cbe3\""),
            Self::Rigid => svg.square(at, size, "fill=\"#e69f00\" stroke=\"#7a5400\" stroke-width=\"0.8\""),
            Self::Fixed => svg.disc(at, size, "fill=\"white\" stroke=\"#222\" stroke-width=\"1.3\""),
            Self::Grabbed => {
                svg.disc(at, 1.3 * size + 0.8, "fill=\"#d00000\" stroke=\"white\" stroke-width=\"1.2\"");
            }
            Self::Displaced(share) => svg.disc(at, size, &format!("fill=\"{}\"", shade(share))),
        }
    }
}

impl Line {
    pub fn style(self) -> &'static str {
        match self {
            Self::Within => "stroke=\"#aaa\" stroke-width=\"1\"",
            Self::AtLimit => "stroke=\"#444\" stroke-width=\"1.4\"",
            Self::Beyond => "stroke=\"#d00000\" stroke-width=\"3\"",
            Self::Path => "stroke=\"#d00000\" stroke-width=\"1.3\" stroke-dasharray=\"4 3\"",
        }
    }
}

/// A color between pale and dark blue.
fn shade(share: f64) -> String {
    const STOPS: [[f64; 3]; 3] = [[190.0, 216.0, 236.0], [66.0, 146.0, 198.0], [8.0, 36.0, 86.0]];
    let along = 2.0 * share.clamp(0.0, 1.0);
    let (from, part) = if along < 1.0 { (0, along) } else { (1, along - 1.0) };
    let [red, green, blue] =
        [0, 1, 2].map(|c| (STOPS[from][c] + part * (STOPS[from + 1][c] - STOPS[from][c])).round() as u8);
    format!("#{red:02x}{green:02x}{blue:02x}")
}
