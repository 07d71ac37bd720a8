//! The legend of lines on a picture of the skin.

use crate::compose::BAND;
use crate::draw::{Stroke, text_width};
use crate::shade::SKIN;
use crate::{Image, Rgb, font};

/// Color of the text.
const INK: Rgb = [255, 255, 255];

/// How lines look, and their name.
pub struct Entry<'a> {
    pub color: Rgb,
    pub opacity: f32,
    /// Thickness in pixels.
    pub thickness: f64,
    pub label: &'a str,
}

/// Draws a piece of skin with a line, and the name of the lines, at the bottom right. The legend
/// has a ground of its own, so that no line of the picture runs through it. Draws nothing for an
/// empty name.
pub fn draw_legend(image: &mut Image, entry: &Entry<'_>, scale: usize) {
    if entry.label.is_empty() {
        return;
    }
    let (margin, height, patch) = (3 * scale, font::HEIGHT * scale, 12 * scale);
    let text = image.width.saturating_sub(margin + text_width(entry.label, scale));
    let (left, top) = (text.saturating_sub(patch + margin), image.height.saturating_sub(margin + height));
    image.fill(left.saturating_sub(margin)..image.width, top.saturating_sub(margin)..image.height, BAND, 1.0);
    image.fill(left..left + patch, top..top + height, SKIN, 1.0);
    let middle = top as f64 + height as f64 / 2.0 - 0.5;
    let mut stroke = Stroke::new(image, entry.thickness);
    stroke.segment([left as f64, middle], [(left + patch - 1) as f64, middle], entry.opacity);
    stroke.draw(image, entry.color);
    image.text(text, top, entry.label, scale, INK);
}
