//! Pictures for the report in a bounded number of bytes.

use cutis_render::{Image, RenderError};

/// Bytes of a picture of the report, before base64. The files of the run folder have no limit: a
/// noisy CT makes pictures of some megabytes.
const MOST_BYTES: usize = 500_000;

/// A smaller picture as a PNG file with at most [`MOST_BYTES`]. None if `png`, the picture itself,
/// is not larger.
///
/// # Errors
/// The errors of the encoder.
pub(super) fn smaller(image: &Image, png: &[u8]) -> Result<Option<Vec<u8>>, RenderError> {
    let mut small = None;
    let mut bytes = png.len();
    let mut image = image.clone();
    while bytes > MOST_BYTES && image.width > 1 && image.height > 1 {
        image = halved(&image)?;
        let png = image.to_png()?;
        bytes = png.len();
        small = Some(png);
    }
    Ok(small)
}

/// Half as many columns and rows. Each pixel is the mean of four.
fn halved(image: &Image) -> Result<Image, RenderError> {
    let mut half = Image::new(image.width / 2, image.height / 2, [0; 3])?;
    for (n, value) in half.rgb.iter_mut().enumerate() {
        let (pixel, channel) = (n / 3, n % 3);
        let (column, row) = (pixel % half.width, pixel / half.width);
        let of = |dx, dy| {
            let at = (2 * row + dy) * image.width + 2 * column + dx;
            u16::from(image.rgb[3 * at + channel])
        };
        *value = ((of(0, 0) + of(1, 0) + of(0, 1) + of(1, 1) + 2) / 4) as u8;
    }
    Ok(half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noisy_pictures_become_smaller_and_plain_ones_stay() {
        let mut noisy = Image::new(901, 900, [9; 3]).unwrap();
        assert_eq!(smaller(&noisy, &noisy.to_png().unwrap()).unwrap(), None);
        let mut state = 1_u32;
        for value in &mut noisy.rgb {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *value = (state >> 24) as u8;
        }
        let png = noisy.to_png().unwrap();
        assert!(png.len() > 4 * MOST_BYTES, "{} bytes", png.len());
        let small = smaller(&noisy, &png).unwrap().unwrap();
        assert!(small.len() <= MOST_BYTES && small.len() > MOST_BYTES / 8, "{} bytes", small.len());
    }

    #[test]
    fn a_pixel_is_the_mean_of_four() {
        let mut image = Image::new(5, 2, [0; 3]).unwrap();
        image.rgb[..6].copy_from_slice(&[10, 20, 30, 20, 40, 60]);
        image.rgb[15..21].copy_from_slice(&[30, 60, 90, 40, 80, 121]);
        let half = halved(&image).unwrap();
        assert_eq!((half.width, half.height, &half.rgb[..3]), (2, 1, &[25, 50, 75][..]));
    }
}
