//! Several pictures in one, with captions.

use crate::annotate::text_scale;
use crate::draw::text_width;
use crate::{Image, RenderError, Rgb, font};

const PAPER: Rgb = [245, 245, 245];
const INK: Rgb = [255, 255, 255];
/// Ground of captions and legends.
pub(crate) const BAND: Rgb = [40, 44, 52];

/// Combines pictures from left to right, aligned at the top, each below its caption.
///
/// # Errors
/// [`RenderError::ImageSize`] if there is no picture, or if the result is too large.
pub fn side_by_side(pictures: &[(&Image, &str)]) -> Result<Image, RenderError> {
    let scale = pictures.iter().map(|(image, _)| text_scale(image)).max().unwrap_or(1);
    let (gap, band) = (4 * scale, (font::HEIGHT + 6) * scale);
    let limit = Image::MAX_PIXELS;
    let width = pictures
        .iter()
        .try_fold(gap * pictures.len().saturating_sub(1), |sum, (image, _)| sum.checked_add(image.width));
    let height = pictures.iter().map(|(image, _)| image.height).max().unwrap_or(0).checked_add(band);
    let (Some(width), Some(height)) = (width, height) else {
        return Err(RenderError::ImageSize { width: usize::MAX, height: usize::MAX, limit });
    };
    let mut whole = Image::new(width, height, PAPER)?;
    let mut left = 0;
    for (image, caption) in pictures {
        whole.fill(left..left + image.width, 0..band, BAND, 1.0);
        let start = left + (image.width / 2).saturating_sub(text_width(caption, scale) / 2);
        whole.text(start, 3 * scale, caption, scale, INK);
        let length = 3 * image.width;
        let rows = whole.rgb.chunks_exact_mut(3 * width).skip(band).take(image.height);
        for (y, to) in rows.enumerate() {
            to[3 * left..][..length].copy_from_slice(&image.rgb[y * length..][..length]);
        }
        left += image.width + gap;
    }
    Ok(whole)
}
