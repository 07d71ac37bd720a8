//! Text, boxes and lines on an [`Image`].

use std::collections::BTreeMap;

use crate::font::Line;
use crate::image::{Image, Rgb};

/// Opacity of the dark rim around letters.
const RIM: f32 = 0.6;

/// Width of a text in pixels.
pub fn text_width(text: &str, scale: usize) -> usize {
    Line::new(text, scale).width
}

impl Image {
    /// Draws a text with a dark rim, so that it can be read on any background. Its top left corner
    /// is at `(x, y)`, and capital letters are `font::HEIGHT · scale` pixels high.
    pub(crate) fn text(&mut self, x: usize, y: usize, text: &str, scale: usize, color: Rgb) {
        let line = Line::new(text, scale);
        let place = |at: [i64; 2]| [at[0] + x as i64, at[1] + y as i64];
        let mut rim = Rim::new(scale as f64 / 2.0 + 0.5);
        line.draw(|at, cover| rim.add(place(at), cover));
        for (&[x, y], &cover) in &rim.cover {
            self.blend_at([x, y], [0; 3], RIM * cover);
        }
        line.draw(|at, cover| self.blend_at(place(at), color, cover));
    }

    /// Does what [`Image::blend`] does, and has no effect left of the picture or above it.
    fn blend_at(&mut self, [x, y]: [i64; 2], color: Rgb, opacity: f32) {
        if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) {
            self.blend(x, y, color, opacity);
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

/// The pixels around letters, each with the share that a round brush covers.
struct Rim {
    /// Places from a pixel of a letter, and how much the brush covers there.
    brush: Vec<([i64; 2], f32)>,
    /// Ordered, so that the result does not depend on hashes.
    cover: BTreeMap<[i64; 2], f32>,
}

impl Rim {
    /// A rim of a thickness in pixels.
    fn new(thickness: f64) -> Self {
        let reach = thickness.ceil() as i64;
        let all = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y]));
        let weight = |[x, y]: [i64; 2]| (thickness + 0.5 - (x as f64).hypot(y as f64)).clamp(0.0, 1.0) as f32;
        let brush = all.map(|at| (at, weight(at))).filter(|(_, weight)| *weight > 0.0).collect();
        Self { brush, cover: BTreeMap::new() }
    }

    /// Adds a pixel of a letter.
    fn add(&mut self, [x, y]: [i64; 2], cover: f32) {
        if cover > 0.0 {
            for ([dx, dy], weight) in &self.brush {
                let pixel = self.cover.entry([x + dx, y + dy]).or_default();
                *pixel = pixel.max(cover * weight);
            }
        }
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
