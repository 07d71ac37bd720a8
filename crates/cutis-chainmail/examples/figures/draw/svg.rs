//! An SVG picture on white, so that it is readable on a dark page too.

use std::fmt::Write;

/// A point of the picture, in pixels from its upper left corner.
pub type Point = [f64; 2];

/// A picture in progress. Later shapes cover earlier ones.
pub struct Svg {
    size: Point,
    body: String,
}

impl Svg {
    pub fn new(size: Point) -> Self {
        Self { size, body: String::new() }
    }

    /// Draws lines of one style.
    pub fn lines(&mut self, lines: &[[Point; 2]], style: &str) {
        if lines.is_empty() {
            return;
        }
        self.body.push_str("<path d=\"");
        for [[x0, y0], [x1, y1]] in lines {
            self.add(format_args!("M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}"));
        }
        self.add(format_args!("\" fill=\"none\" {style}/>\n"));
    }

    pub fn disc(&mut self, [x, y]: Point, radius: f64, style: &str) {
        self.add(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" {style}/>\n"));
    }

    /// Draws a square with a center and half a side length.
    pub fn square(&mut self, [x, y]: Point, half: f64, style: &str) {
        let (left, top, side) = (x - half, y - half, 2.0 * half);
        self.add(format_args!(
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{side:.1}\" height=\"{side:.1}\" {style}/>\n"
        ));
    }

    /// Writes text at a baseline. `style` may contain its anchor.
    pub fn text(&mut self, [x, y]: Point, style: &str, text: &str) {
        if text.is_empty() {
            return;
        }
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        self.add(format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" {style}>{text}</text>\n"));
    }

    /// The finished document.
    pub fn finish(self) -> String {
        let [width, height] = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
             height=\"{height:.0}\" font-family=\"sans-serif\" font-size=\"13\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{}</svg>\n",
            self.body
        )
    }

    fn add(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a String cannot fail.
        let _ = self.body.write_fmt(text);
    }
}
