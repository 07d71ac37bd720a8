//! Settings of a surface picture.

use cutis_volume::Volume;

use crate::{Image, RenderError, Side};

/// A part of the world to show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    /// Center of the picture, world mm.
    pub center_mm: [f64; 3],
    /// Length shown along the shorter side of the picture, mm.
    pub size_mm: f64,
}

/// An orthographic picture of the iso-surface of a volume.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Position of the viewer.
    pub side: Side,
    /// Pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// HU of the surface. The default −300 is about half-way between air and skin, and above the
    /// noise of air and foam.
    pub threshold_hu: f32,
    /// The part to show; with `None` the whole volume.
    pub focus: Option<Focus>,
    /// Depth below the skin at rest in mm: the volume of [`skin_depth`](crate::skin_depth),
    /// resampled together with the body. Surfaces that were deep get the color of their tissue.
    /// With `None` all surfaces get the color of skin.
    pub depth: Option<&'a Volume>,
    /// Thickness of the skin in mm, used with `depth`. Default 2. The finest spacing of `depth`
    /// counts if it is larger.
    pub skin_mm: f64,
    /// Reach in mm of the ambient occlusion that darkens clefts. Default 12; 0 switches it off.
    pub occlusion_mm: f64,
    /// Rays per pixel along each axis at edges, 1 to 4. Default 2.
    pub samples: usize,
    /// True to draw orientation letters and a scale bar.
    pub annotate: bool,
}

impl View<'_> {
    /// Default settings: the whole volume from one side with 800 × 800 pixels.
    pub fn new(side: Side) -> Self {
        Self {
            side,
            width: 800,
            height: 800,
            threshold_hu: -300.0,
            focus: None,
            depth: None,
            skin_mm: 2.0,
            occlusion_mm: 12.0,
            samples: 2,
            annotate: true,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), RenderError> {
        let check = |good: bool, key, value, expected| {
            if good { Ok(()) } else { Err(RenderError::Setting { key, value, expected }) }
        };
        let threshold = f64::from(self.threshold_hu);
        check(threshold.is_finite(), "threshold_hu", threshold, "a finite number")?;
        check(
            self.skin_mm.is_finite() && self.skin_mm > 0.0,
            "skin_mm",
            self.skin_mm,
            "a length above zero",
        )?;
        let reach = self.occlusion_mm;
        check(reach.is_finite() && reach >= 0.0, "occlusion_mm", reach, "a length, or zero for none")?;
        check((1..=4).contains(&self.samples), "samples", self.samples as f64, "1 to 4")?;
        if let Some(focus) = &self.focus {
            focus.validate()?;
        }
        Ok(())
    }

    /// Returns an error if a picture does not have the size of the view.
    pub(crate) fn fits(&self, image: &Image) -> Result<(), RenderError> {
        for (key, of_view, of_image) in
            [("view.width", self.width, image.width), ("view.height", self.height, image.height)]
        {
            if of_view != of_image {
                let (value, expected) = (of_view as f64, "that of the picture");
                return Err(RenderError::Setting { key, value, expected });
            }
        }
        Ok(())
    }
}

impl Focus {
    pub(crate) fn validate(&self) -> Result<(), RenderError> {
        let bad = |key, value, expected| Err(RenderError::Setting { key, value, expected });
        if let Some(&value) = self.center_mm.iter().find(|c| !c.is_finite()) {
            return bad("focus.center_mm", value, "finite");
        }
        if !(self.size_mm.is_finite() && self.size_mm > 0.0) {
            return bad("focus.size_mm", self.size_mm, "a length above zero");
        }
        Ok(())
    }
}
