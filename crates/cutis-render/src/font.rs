//! Text as the share of each pixel that it covers: the letters of `font/Roboto-Medium.ttf`.
//!
//! `font/README.md` says where the font is from, and its license.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, Glyph, OutlinedGlyph, PxScale, ScaleFont, point};

/// Height of a capital letter in units of the size of a text.
pub const HEIGHT: usize = 7;

/// The font, and the height of its capital letters over the size by which letters are scaled.
static FONT: LazyLock<Option<(FontRef<'static>, f32)>> = LazyLock::new(|| {
    let font = FontRef::try_from_slice(include_bytes!("../font/Roboto-Medium.ttf")).ok()?;
    let capital = font.outline(font.glyph_id('H'))?.bounds;
    let share = (capital.max.y - capital.min.y).abs() / font.height_unscaled();
    Some((font, share))
});

/// A line of text in pixels. Its origin is at the left end of the first letter, at the height of
/// the top of a capital letter.
pub struct Line {
    /// Distance from the origin to the end of the last letter.
    pub width: usize,
    letters: Vec<OutlinedGlyph>,
}

impl Line {
    /// A line in which a capital letter is `HEIGHT · scale` pixels high. A question mark stands for
    /// a character that the font lacks.
    pub fn new(text: &str, scale: usize) -> Self {
        let mut line = Self { width: 0, letters: Vec::new() };
        let Some((font, share)) = FONT.as_ref() else { return line };
        let height = (HEIGHT * scale) as f32;
        let size = PxScale::from(height / share);
        let scaled = font.as_scaled(size);
        let mut at = 0.0;
        for character in text.chars() {
            let known = match font.glyph_id(character) {
                id if id.0 == 0 => font.glyph_id('?'),
                id => id,
            };
            let glyph: Glyph = known.with_scale_and_position(size, point(at, height));
            line.letters.extend(font.outline_glyph(glyph));
            at += scaled.h_advance(known);
        }
        line.width = at.ceil() as usize;
        line
    }

    /// Calls `visit` with the place of each pixel that the line may cover, from its origin, and
    /// with the share of the pixel that it covers. Letters do not overlap.
    pub fn draw(&self, mut visit: impl FnMut([i64; 2], f32)) {
        for letter in &self.letters {
            let [left, top] = [letter.px_bounds().min.x, letter.px_bounds().min.y].map(|c| c as i64);
            letter
                .draw(|x, y, cover| visit([left + i64::from(x), top + i64::from(y)], cover.clamp(0.0, 1.0)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covers(text: &str, scale: usize) -> Vec<([i64; 2], f32)> {
        let mut all = Vec::new();
        Line::new(text, scale).draw(|at, cover| all.push((at, cover)));
        all.retain(|(_, cover)| *cover > 0.0);
        all
    }

    #[test]
    fn a_capital_letter_has_the_height_of_its_size() {
        for scale in 1..9 {
            let rows: Vec<i64> = covers("H", scale).iter().map(|([_, y], _)| *y).collect();
            let (low, high) = (rows.iter().min().copied(), rows.iter().max().copied());
            assert_eq!((low, high), (Some(0), Some((HEIGHT * scale) as i64 - 1)), "{scale}");
        }
    }

    #[test]
    fn every_printable_character_has_a_shape_of_its_own() {
        let shapes: Vec<_> =
            (33..127_u8).chain(161..=172).map(|code| covers(&char::from(code).to_string(), 4)).collect();
        for (n, shape) in shapes.iter().enumerate() {
            assert!(!shape.is_empty(), "{n}");
            assert!(shapes[..n].iter().all(|other| other != shape), "{n}");
        }
        assert_eq!(covers("\u{4e2d}", 4), covers("?", 4));
        assert!(covers(" ", 4).is_empty() && Line::new(" ", 4).width > 2);
    }

    /// Most pixels of a letter are covered as a whole, and its edges are not stairs.
    #[test]
    fn edges_are_smooth() {
        let all = covers("S", 4);
        let partly = all.iter().filter(|(_, cover)| (0.05..0.95).contains(cover)).count();
        assert!(partly * 5 > all.len() && partly * 5 < 4 * all.len(), "{partly} of {}", all.len());
    }
}
