//! An RGB picture and its PNG file.

use std::io::Write;
use std::path::Path;

use cutis_volume::PartialFile;

use crate::RenderError;

/// Level of compression, from 0 to 9. Pictures of skin and slices are 8 to 10 % larger than with
/// level 6, and take half the time.
const DEFLATE_LEVEL: u8 = 5;

/// The nearest byte to a value. `f32::round` would be a call on processors without SSE4.1.
#[inline]
pub fn to_byte(value: f32) -> u8 {
    (value + 0.5) as u8
}

/// A color: red, green, blue.
pub type Rgb = [u8; 3];

/// An RGB picture, 8 bits per channel, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// The channels of all pixels, `3 · width · height` bytes.
    pub rgb: Vec<u8>,
}

impl Image {
    /// Largest number of pixels: 2²⁷. A picture has three bytes per pixel.
    pub const MAX_PIXELS: usize = 1 << 27;

    /// Creates a picture of one color.
    ///
    /// # Errors
    /// [`RenderError::ImageSize`] if there are no pixels or more than [`Image::MAX_PIXELS`]; then
    /// nothing is allocated.
    pub fn new(width: usize, height: usize, color: Rgb) -> Result<Self, RenderError> {
        let limit = Self::MAX_PIXELS;
        match width.checked_mul(height) {
            Some(pixels) if (1..=limit).contains(&pixels) => {
                Ok(Self { width, height, rgb: color.repeat(pixels) })
            }
            _ => Err(RenderError::ImageSize { width, height, limit }),
        }
    }

    /// Color of a pixel in column `x` of row `y`. `None` outside the picture.
    pub fn pixel(&self, x: usize, y: usize) -> Option<Rgb> {
        let at = self.offset(x, y)?;
        Some([self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]])
    }

    /// Mixes a color into a pixel: opacity 0 keeps the pixel, 1 replaces it. Has no effect outside
    /// the picture.
    pub fn blend(&mut self, x: usize, y: usize, color: Rgb, opacity: f32) {
        if let Some(at) = self.offset(x, y) {
            for (channel, new) in self.rgb[at..at + 3].iter_mut().zip(color) {
                let old = f32::from(*channel);
                *channel = to_byte(old + (f32::from(new) - old) * opacity.clamp(0.0, 1.0));
            }
        }
    }

    fn offset(&self, x: usize, y: usize) -> Option<usize> {
        (x < self.width && y < self.height).then(|| 3 * (y * self.width + x))
    }

    /// Writes an 8-bit RGB PNG file. It is written to a temporary file next to the target and then
    /// renamed, so that the target is always complete.
    ///
    /// # Errors
    /// [`RenderError::Write`] or [`RenderError::Volume`] with the path.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<(), RenderError> {
        let path = path.as_ref();
        let mut file = PartialFile::create(path)?;
        let written = self.encode().and_then(|bytes| file.write_all(&bytes));
        written.map_err(|source| RenderError::Write { path: path.to_path_buf(), source })?;
        Ok(file.commit()?)
    }

    /// Encodes the picture as the PNG file that [`Image::write_png`] writes.
    ///
    /// # Errors
    /// [`RenderError::ImageSize`] if the public fields do not fit together.
    pub fn to_png(&self) -> Result<Vec<u8>, RenderError> {
        let (width, height) = (self.width, self.height);
        self.encode().map_err(|_| RenderError::ImageSize { width, height, limit: Self::MAX_PIXELS })
    }

    fn encode(&self) -> std::io::Result<Vec<u8>> {
        let side = |length: usize| u32::try_from(length).map_err(std::io::Error::other);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, side(self.width)?, side(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_deflate_compression(png::DeflateCompression::Level(DEFLATE_LEVEL));
        encoder.set_filter(png::Filter::Adaptive);
        encoder.write_header()?.write_image_data(&self.rgb)?;
        Ok(bytes)
    }
}
