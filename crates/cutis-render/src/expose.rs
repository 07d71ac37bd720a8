//! Sampling of a picture: few rays where it is smooth, and more at edges.

use rayon::prelude::*;

use crate::shade::{Light, encode};
use crate::{Image, RenderError, Rgb};

/// Number of positions in a batch.
pub const BATCH: usize = 1 << 16;
/// Difference between neighboring pixels that makes an edge.
const EDGE: u8 = 12;
/// Largest difference between the pixels around a smooth part of the picture, times their distance.
/// The pixels between them take their mean.
const SMOOTH: usize = 4;

/// Distance in pixels between the first rays of a picture: 4 where that is at most a voxel, else 2.
/// A surface from interpolated voxels has no detail that is much finer than a voxel.
///
/// Few colors differ from those with a ray for each pixel. With a distance of 4, in close-ups of
/// the phantom and of its wound, 0.01 % of the pixels or less by more than 4, and none by more than
/// 13. With 2, in a picture of the whole, 0.07 % by more than 4, and none by more than 9.
pub fn first_spacing(pixel_mm: f64, voxel_mm: f64) -> usize {
    if 4.0 * pixel_mm <= voxel_mm { 4 } else { 2 }
}

/// Fills a picture by calling `light_at` with batches of at most [`BATCH`] positions in pixels from
/// the top left corner. Rays begin `spacing` pixels apart along each axis; it is a power of two.
/// Then the spacing is halved until each pixel has a color. A new pixel gets a ray, unless the ones
/// around it are nearly equal. A pixel at an edge gets the mean of `samples × samples` positions.
///
/// # Errors
/// The errors of `light_at`, which must return one light per position.
pub fn expose(
    image: &mut Image,
    samples: usize,
    spacing: usize,
    mut light_at: impl FnMut(&[[f64; 2]]) -> Result<Vec<Light>, RenderError>,
) -> Result<(), RenderError> {
    let (width, height) = (image.width, image.height);
    let mut one_ray_each = |image: &mut Image, pixels: &[[usize; 2]]| {
        for pixels in pixels.chunks(BATCH) {
            let places: Vec<_> = pixels.iter().map(|pixel| pixel.map(|at| at as f64 + 0.5)).collect();
            for (pixel, light) in pixels.iter().zip(light_at(&places)?) {
                set(image, *pixel, encode(light));
            }
        }
        Ok::<(), RenderError>(())
    };
    let first = (0..height).step_by(spacing).flat_map(|y| (0..width).step_by(spacing).map(move |x| [x, y]));
    one_ray_each(image, &first.collect::<Vec<_>>())?;
    let mut known = spacing;
    while known > 1 {
        let rough = fill_smooth_parts(image, known);
        one_ray_each(image, &rough)?;
        known /= 2;
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

fn set(image: &mut Image, [x, y]: [usize; 2], color: Rgb) {
    let first = 3 * (x + y * image.width);
    image.rgb[first..][..3].copy_from_slice(&color);
}

/// Halves the distance `known` between the pixels with a color, where the picture is smooth.
/// Returns the pixels that are still without one.
fn fill_smooth_parts(image: &mut Image, known: usize) -> Vec<[usize; 2]> {
    let (step, width, before) = (known / 2, image.width, image.clone());
    let fill_row = |(n, rows): (usize, &mut [u8])| {
        let (y, mut rough) = (n * step, Vec::new());
        let is_new = |x: &usize| (x | y) & (known - 1) != 0;
        for x in (0..width).step_by(step).filter(is_new) {
            match smooth(&before, [x, y], known) {
                Some(color) => rows[3 * x..][..3].copy_from_slice(&color),
                None => rough.push([x, y]),
            }
        }
        rough
    };
    image.rgb.par_chunks_mut(3 * width * step).enumerate().flat_map_iter(fill_row).collect()
}

/// The mean of the pixels around a pixel whose column and row are multiples of `spacing`. `None` if
/// they are not nearly equal, or if one is outside the picture.
fn smooth(image: &Image, [x, y]: [usize; 2], spacing: usize) -> Option<Rgb> {
    let ends = |at: usize| [at & !(spacing - 1), (at + spacing - 1) & !(spacing - 1)];
    let mut around = [[0; 3]; 4];
    for (n, color) in around.iter_mut().enumerate() {
        *color = image.pixel(ends(x)[n % 2], ends(y)[n / 2])?;
    }
    let mut mean = [0; 3];
    for (channel, mean) in mean.iter_mut().enumerate() {
        let values = around.map(|color| color[channel]);
        let (low, high) = values.iter().fold((u8::MAX, 0), |(low, high), &v| (low.min(v), high.max(v)));
        if usize::from(high - low) * spacing > SMOOTH {
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

    fn picture(width: usize, height: usize, spacing: usize) -> (Image, usize) {
        let (mut image, mut rays) = (Image::new(width, height, [0; 3]).unwrap(), 0);
        expose(&mut image, 1, spacing, |places| {
            rays += places.len();
            Ok(places.iter().map(|&place| disk(place)).collect())
        })
        .unwrap();
        (image, rays)
    }

    #[test]
    fn smooth_parts_take_few_rays_and_edges_one_per_pixel() {
        for (spacing, most_rays) in [(1, 181 * 180), (2, 181 * 180 * 2 / 5), (4, 181 * 180 / 4)] {
            let (image, rays) = picture(181, 180, spacing);
            assert!(rays <= most_rays, "{rays} rays");
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
            let control = (different > 0) == (spacing > 1) && flat < 181 * 180 / 10;
            assert!(control, "the control: some pixels are means, and not all are equal");
        }
    }

    #[test]
    fn the_first_rays_are_at_most_a_voxel_apart_or_two_pixels() {
        for (pixel_mm, spacing) in [(0.01, 4), (0.1875, 4), (0.19, 2), (3.0, 2)] {
            assert_eq!(first_spacing(pixel_mm, 0.75), spacing, "{pixel_mm} mm");
        }
    }

    #[test]
    fn a_picture_of_one_pixel_gets_its_ray() {
        for spacing in [1, 2, 4] {
            assert_eq!(picture(1, 1, spacing).1, 1);
            assert_eq!(picture(2, 1, spacing).1, 2);
        }
    }
}
