//! What elements and links look like. Colors can be told apart without full color vision (Okabe and Ito, 2008), and shapes, sizes
//! and widths say the same.

use super::svg::{Point, Svg};

/// What an element looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    /// It has moved.
    Soft,
    /// It is where it was.
    Still,
    Rigid,
    Fixed,
    Grabbed,
    /// Darker the farther it went: a share of the way from pale to dark.
    Went(f64),
}

/// What a link looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    Within,
    /// At one of its limits, or more of them.
    AtLimit,
    Beyond,
    /// No link: from where the grabbed element was to where it is.
    Pull,
}

impl Look {
    /// Draws an element; `size` is the radius of most.
    pub fn draw(self, svg: &mut Svg, at: Point, size: f64) {
        match self {
            Self::Soft => svg.disc(at, size, "fill=\"#0072b2\""),
            Self::Still => svg.disc(at, size, "fill=\"#a3cbe3\""),
            Self::Rigid => svg.square(at, size, "fill=\"#e69f00\" stroke=\"#7a5400\" stroke-width=\"0.8\""),
            Self::Fixed => svg.disc(at, size, "fill=\"white\" stroke=\"#222\" stroke-width=\"1.3\""),
            Self::Grabbed => {
                svg.disc(at, 1.3 * size + 0.8, "fill=\"#d00000\" stroke=\"white\" stroke-width=\"1.2\"");
            }
            Self::Went(share) => svg.disc(at, size, &format!("fill=\"{}\"", shade(share))),
        }
    }
}

impl Line {
    pub fn style(self) -> &'static str {
        match self {
            Self::Within => "stroke=\"#aaa\" stroke-width=\"1\"",
            Self::AtLimit => "stroke=\"#444\" stroke-width=\"1.4\"",
            Self::Beyond => "stroke=\"#d00000\" stroke-width=\"3\"",
            Self::Pull => "stroke=\"#d00000\" stroke-width=\"1.3\" stroke-dasharray=\"4 3\"",
        }
    }
}

/// From pale blue over a middle one to a dark one.
fn shade(share: f64) -> String {
    const STOPS: [[f64; 3]; 3] = [[190.0, 216.0, 236.0], [66.0, 146.0, 198.0], [8.0, 36.0, 86.0]];
    let along = 2.0 * share.clamp(0.0, 1.0);
    let (from, part) = if along < 1.0 { (0, along) } else { (1, along - 1.0) };
    let [red, green, blue] =
        [0, 1, 2].map(|c| (STOPS[from][c] + part * (STOPS[from + 1][c] - STOPS[from][c])).round() as u8);
    format!("#{red:02x}{green:02x}{blue:02x}")
}
