//! Sampling of a picture: few rays where it is smooth, and more at edges.

use rayon::prelude::*;

use crate::shade::{Light, encode};
use crate::{Image, RenderError, Rgb};

/// Number of positions in a batch.
pub const BATCH: usize = 1 << 16;
/// Difference between neighboring pixels that makes an edge.
const EDGE: u8 = 12;
/// Largest difference between every second pixel of a smooth part of the picture. The pixels
/// between take their mean. In the phantom's close-up it differs by at most 1 from a ray of their
/// own, and in the picture of the whole by at most 9, in 0.07 % of the pixels by more than 4.
const SMOOTH: u8 = 2;

/// Fills a picture by calling `light_at` with batches of at most [`BATCH`] positions in pixels from
/// the top left corner. Every second pixel along each axis gets a ray. The others get one unless
/// the ones around them are nearly equal. A pixel at an edge gets the mean of `samples × samples`
/// positions.
///
/// # Errors
/// The errors of `light_at`, which must return one light per position.
pub fn expose(
    image: &mut Image,
    samples: usize,
    mut light_at: impl FnMut(&[[f64; 2]]) -> Result<Vec<Light>, RenderError>,
) -> Result<(), RenderError> {
    let (width, pixels) = (image.width, image.rgb.len() / 3);
    let mut one_ray_each = |image: &mut Image, pixels: Vec<usize>| {
        for pixels in pixels.chunks(BATCH) {
            let place = |&pixel: &usize| [(pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5];
            let places: Vec<_> = pixels.iter().map(place).collect();
            for (pixel, light) in pixels.iter().zip(light_at(&places)?) {
                image.rgb[3 * pixel..][..3].copy_from_slice(&encode(light));
            }
        }
        Ok::<(), RenderError>(())
    };
    let is_between = |&pixel: &usize| pixel % width % 2 == 1 || pixel / width % 2 == 1;
    one_ray_each(image, (0..pixels).filter(|pixel| !is_between(pixel)).collect())?;
    let mut rough = Vec::new();
    for pixel in (0..pixels).filter(is_between) {
        match smooth(image, pixel) {
            Some(color) => image.rgb[3 * pixel..][..3].copy_from_slice(&color),
            None => rough.push(pixel),
        }
    }
    one_ray_each(image, rough)?;
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

/// The mean of the pixels around a pixel with an odd column or row that have even ones. `None` if
/// they are not nearly equal, or if one is outside the picture.
fn smooth(image: &Image, pixel: usize) -> Option<Rgb> {
    let (x, y) = (pixel % image.width, pixel / image.width);
    let ends = |at: usize| if at % 2 == 1 { [at - 1, at + 1] } else { [at; 2] };
    let mut around = [[0; 3]; 4];
    for (n, color) in around.iter_mut().enumerate() {
        *color = image.pixel(ends(x)[n % 2], ends(y)[n / 2])?;
    }
    let mut mean = [0; 3];
    for (channel, mean) in mean.iter_mut().enumerate() {
        let values = around.map(|color| color[channel]);
        let (low, high) = values.iter().fold((u8::MAX, 0), |(low, high), &v| (low.min(v), high.max(v)));
        if high - low > SMOOTH {
            return None;
        }
        *mean = ((values.iter().map(|&value| u16::from(value)).sum::<u16>() + 2) / 4) as u8;
    }
    Some(mean)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk with smooth shading, on a dark ground.
    fn disk([x, y]: [f64; 2]) -> Light {
        let (x, y) = (x / 90.0 - 1.0, y / 90.0 - 1.0);
        let inside = x * x + y * y < 0.7;
        Light::repeat(if inside { (0.9 - 0.4 * (x * x + y * y)) as f32 } else { 0.02 })
    }

    fn picture(width: usize, height: usize) -> (Image, usize) {
        let (mut image, mut rays) = (Image::new(width, height, [0; 3]).unwrap(), 0);
        expose(&mut image, 1, |places| {
            rays += places.len();
            Ok(places.iter().map(|&place| disk(place)).collect())
        })
        .unwrap();
        (image, rays)
    }

    #[test]
    fn smooth_parts_take_few_rays_and_edges_one_per_pixel() {
        let (image, rays) = picture(181, 180);
        let (mut different, mut flat) = (0, 0);
        for pixel in 0..181 * 180 {
            let place = [(pixel % 181) as f64 + 0.5, (pixel / 181) as f64 + 0.5];
            let exact = encode(disk(place));
            let found = &image.rgb[3 * pixel..][..3];
            let error = exact.iter().zip(found).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
            assert!(error <= 1, "{found:?} for {exact:?} at {place:?}");
            different += usize::from(error == 1);
            flat += usize::from(found == [encode(Light::repeat(0.9))[0]; 3]);
        }
        assert!(rays < 181 * 180 * 2 / 5, "{rays} rays");
        assert!(
            different > 0 && flat < 181 * 180 / 10,
            "the control: some pixels are means, and not all are equal"
        );
    }

    #[test]
    fn a_picture_of_one_pixel_gets_its_ray() {
        assert_eq!(picture(1, 1).1, 1);
        assert_eq!(picture(2, 1).1, 2);
    }
}
