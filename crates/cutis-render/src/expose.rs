//! Sampling of a picture: one ray for each pixel, and more at edges.

use rayon::prelude::*;

use crate::shade::{Light, encode};
use crate::{Image, RenderError};

/// Number of positions in a batch.
pub const BATCH: usize = 1 << 16;
/// Difference between neighboring pixels that makes an edge.
const EDGE: u8 = 12;

/// Fills a picture by calling `light_at` with batches of at most [`BATCH`] positions in pixels from
/// the top left corner. A pixel at an edge gets the mean of `samples × samples` positions.
///
/// # Errors
/// The errors of `light_at`, which must return one light per position.
pub fn expose(
    image: &mut Image,
    samples: usize,
    mut light_at: impl FnMut(&[[f64; 2]]) -> Result<Vec<Light>, RenderError>,
) -> Result<(), RenderError> {
    let width = image.width;
    for (batch, pixels) in image.rgb.chunks_mut(3 * BATCH).enumerate() {
        let place = |pixel: usize| [(pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5];
        let first = batch * BATCH;
        let places: Vec<_> = (first..first + pixels.len() / 3).map(place).collect();
        for (pixel, light) in pixels.chunks_exact_mut(3).zip(light_at(&places)?) {
            pixel.copy_from_slice(&encode(light));
        }
    }
    if samples == 1 {
        return Ok(());
    }
    // More rays at edges only: elsewhere they would find the same light.
    let edges: Vec<usize> =
        (0..image.rgb.len() / 3).into_par_iter().filter(|&pixel| on_edge(image, pixel)).collect();
    let count = samples * samples;
    for pixels in edges.chunks(BATCH / count) {
        let part = |sample: usize| (sample as f64 + 0.5) / samples as f64;
        let places_of = |&pixel: &usize| {
            let (x, y) = ((pixel % width) as f64, (pixel / width) as f64);
            (0..count).map(move |sample| [x + part(sample % samples), y + part(sample / samples)])
        };
        let places: Vec<_> = pixels.iter().flat_map(places_of).collect();
        for (pixel, lights) in pixels.iter().zip(light_at(&places)?.chunks_exact(count)) {
            let mean = lights.iter().sum::<Light>() / count as f32;
            image.rgb[3 * pixel..][..3].copy_from_slice(&encode(mean));
        }
    }
    Ok(())
}

/// True if a neighbor's color differs by more than [`EDGE`] in a channel.
fn on_edge(image: &Image, pixel: usize) -> bool {
    let (width, x, y) = (image.width, pixel % image.width, pixel / image.width);
    let color = |pixel: usize| &image.rgb[3 * pixel..][..3];
    let differs = |other: usize| color(pixel).iter().zip(color(other)).any(|(a, b)| a.abs_diff(*b) > EDGE);
    (x > 0 && differs(pixel - 1))
        || (x + 1 < width && differs(pixel + 1))
        || (y > 0 && differs(pixel - width))
        || (y + 1 < image.height && differs(pixel + width))
}
