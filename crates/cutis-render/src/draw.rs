//! Text, boxes and lines on an [`Image`].

use crate::font;
use crate::image::{Image, Rgb};

/// Width of a text in pixels.
pub fn text_width(text: &str, scale: usize) -> usize {
    (text.chars().count() * font::ADVANCE).saturating_sub(1) * scale
}

impl Image {
    /// Draws a text with a dark rim. Its top left corner is at `(x, y)`, and a font pixel has
    /// `scale` picture pixels.
    pub(crate) fn text(&mut self, x: usize, y: usize, text: &str, scale: usize, color: Rgb) {
        let rim = scale.div_ceil(2);
        for (grow, color, opacity) in [(rim, [0, 0, 0], 0.6), (0, color, 1.0)] {
            for (number, character) in text.chars().enumerate() {
                let glyph = font::glyph(character);
                let left = x + number * font::ADVANCE * scale;
                for (row, bits) in glyph.iter().enumerate() {
                    for column in
                        (0..font::WIDTH).filter(|column| bits >> (font::WIDTH - 1 - column) & 1 == 1)
                    {
                        let (dot_x, dot_y) = (left + column * scale, y + row * scale);
                        let (from_x, from_y) = (dot_x.saturating_sub(grow), dot_y.saturating_sub(grow));
                        let (to_x, to_y) = (dot_x + scale + grow, dot_y + scale + grow);
                        self.fill(from_x..to_x, from_y..to_y, color, opacity);
                    }
                }
            }
        }
    }

    /// Blends a color into a rectangle of pixels.
    pub(crate) fn fill(
        &mut self,
        columns: std::ops::Range<usize>,
        rows: std::ops::Range<usize>,
        color: Rgb,
        opacity: f32,
    ) {
        for y in rows.start..rows.end.min(self.height) {
            for x in columns.start..columns.end.min(self.width) {
                self.blend(x, y, color, opacity);
            }
        }
    }

    /// Draws a smooth line between two points in pixels. The center of the first pixel is at (0,
    /// 0).
    pub(crate) fn line(&mut self, from: [f64; 2], to: [f64; 2], thickness: f64, color: Rgb) {
        for_cover([self.width, self.height], from, to, thickness, |x, y, cover| {
            self.blend(x, y, color, cover)
        });
    }
}

/// A line of many segments. Where segments meet, the line is not darker.
pub(crate) struct Stroke {
    size: [usize; 2],
    thickness: f64,
    /// Opacity of each pixel.
    opacity: Vec<f32>,
}

impl Stroke {
    /// An empty line for pictures of the size of `image`.
    pub fn new(image: &Image, thickness: f64) -> Self {
        let size = [image.width, image.height];
        Self { size, thickness, opacity: vec![0.0; image.width * image.height] }
    }

    /// Adds a segment between two points in pixels. The center of the first pixel is at (0, 0).
    pub fn segment(&mut self, from: [f64; 2], to: [f64; 2], opacity: f32) {
        let Self { size, thickness, opacity: pixels } = self;
        for_cover(*size, from, to, *thickness, |x, y, cover| {
            let pixel = &mut pixels[y * size[0] + x];
            *pixel = pixel.max(opacity * cover);
        });
    }

    /// Draws the line.
    pub fn draw(&self, image: &mut Image, color: Rgb) {
        for (pixel, &opacity) in self.opacity.iter().enumerate().filter(|(_, opacity)| **opacity > 0.0) {
            image.blend(pixel % self.size[0], pixel / self.size[0], color, opacity);
        }
    }
}

/// Calls `visit` for each pixel near a segment with the share of the pixel that the segment covers.
fn for_cover(
    size: [usize; 2],
    from: [f64; 2],
    to: [f64; 2],
    thickness: f64,
    mut visit: impl FnMut(usize, usize, f32),
) {
    let along = [to[0] - from[0], to[1] - from[1]];
    let squared = along[0] * along[0] + along[1] * along[1];
    if !squared.is_finite() {
        return;
    }
    let reach = thickness / 2.0 + 1.0;
    let span = |axis: usize| {
        let length = size[axis] as f64;
        let low = (from[axis].min(to[axis]) - reach).ceil().clamp(0.0, length);
        let high = (from[axis].max(to[axis]) + reach).floor().clamp(-1.0, length - 1.0);
        low as usize..(high + 1.0) as usize
    };
    for y in span(1) {
        for x in span(0) {
            let to_point = [x as f64 - from[0], y as f64 - from[1]];
            let part = if squared > 0.0 {
                ((to_point[0] * along[0] + to_point[1] * along[1]) / squared).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let distance = (to_point[0] - part * along[0]).hypot(to_point[1] - part * along[1]);
            visit(x, y, (thickness / 2.0 + 0.5 - distance).clamp(0.0, 1.0) as f32);
        }
    }
}
