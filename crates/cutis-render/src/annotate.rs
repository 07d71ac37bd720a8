//! Framing of a picture, orientation letters and a scale bar.

use nalgebra::{Point3, Vector3};

use crate::draw::text_width;
use crate::font;
use crate::view::Focus;
use crate::{Axes, Image, Rgb};

const INK: Rgb = [255, 255, 255];

/// World position of the picture's center and size of a pixel in mm. The picture shows the focus,
/// or all `corners` without one.
pub fn frame(
    axes: &Axes,
    corners: &[Point3<f64>; 8],
    focus: Option<Focus>,
    size: [usize; 2],
) -> (Point3<f64>, f64) {
    let pixels = size.map(|length| length as f64);
    if let Some(Focus { center_mm, size_mm }) = focus {
        return (Point3::from(center_mm), size_mm / pixels[0].min(pixels[1]));
    }
    let middle = corners.iter().fold(Vector3::zeros(), |sum, corner| sum + corner.coords / 8.0);
    let [width, height] = [axes.right, axes.up].map(|axis| extent(corners, &axis));
    (Point3::from(middle), (width / pixels[0]).max(height / pixels[1]))
}

/// Length of the projection of the corners on a unit direction.
pub fn extent(corners: &[Point3<f64>; 8], direction: &Vector3<f64>) -> f64 {
    let along = corners.iter().map(|corner| corner.coords.dot(direction));
    let (low, high) =
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    high - low
}

/// Size of a font pixel in picture pixels, chosen by the size of the picture.
pub fn text_scale(image: &Image) -> usize {
    ((image.width + image.height) / 480).clamp(1, 8)
}

/// Orientation letters at the four edges, and a scale bar at the bottom left.
pub fn annotate(image: &mut Image, axes: &Axes, pixel_mm: f64) {
    let scale = text_scale(image);
    let margin = 3 * scale;
    let height = font::HEIGHT * scale;
    let (width, bottom) = (image.width, image.height.saturating_sub(margin + height));
    let middle = (image.height / 2).saturating_sub(height / 2);
    let centered = |text: &str| (width / 2).saturating_sub(text_width(text, scale) / 2);
    let [left, right, top, low] = axes.letters();
    image.text(margin, middle, &left, scale, INK);
    image.text(width.saturating_sub(margin + text_width(&right, scale)), middle, &right, scale, INK);
    image.text(centered(&top), margin, &top, scale, INK);
    image.text(centered(&low), bottom, &low, scale, INK);
    scale_bar(image, pixel_mm, scale, margin);
}

/// A bar of a round length, at most a quarter of the picture's width.
fn scale_bar(image: &mut Image, pixel_mm: f64, scale: usize, margin: usize) {
    let most_mm = image.width as f64 / 4.0 * pixel_mm;
    let decade = 10.0_f64.powf(most_mm.log10().floor());
    let Some(length_mm) = [5.0, 2.0, 1.0].map(|part| part * decade).into_iter().find(|mm| *mm <= most_mm)
    else {
        return;
    };
    let length = (length_mm / pixel_mm).round() as usize;
    let label = format!("{length_mm} mm");
    let bar_top = image.height.saturating_sub(margin + 2 * scale);
    let text_top = bar_top.saturating_sub((font::HEIGHT + 2) * scale);
    image.fill(
        margin.saturating_sub(1)..margin + length + 1,
        bar_top.saturating_sub(1)..bar_top + 2 * scale + 1,
        [0; 3],
        0.6,
    );
    image.fill(margin..margin + length, bar_top..bar_top + 2 * scale, INK, 1.0);
    image.text(margin, text_top, &label, scale, INK);
}
