//! What a surface picture shows, and from where.

use cutis_volume::Volume;

use crate::{RenderError, Side};

/// A part of the world to look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focus {
    /// Center of the picture, world mm.
    pub center_mm: [f64; 3],
    /// Length shown along the shorter side of the picture, mm.
    pub size_mm: f64,
}

/// A plane that hides what lies on one side of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlane {
    /// A point of the plane, world mm.
    pub point_mm: [f64; 3],
    /// Direction to the side that is kept.
    pub keep: [f64; 3],
}

/// An orthographic picture of the iso-surface of a volume.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Where the viewer stands.
    pub side: Side,
    /// Pixels along a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The surface is where HU rises through this value. Default −300: about half-way between air and skin, and above the
    /// noise of air and of foam.
    pub threshold_hu: f32,
    /// Part to look at; the whole volume if `None`.
    pub focus: Option<Focus>,
    /// Planes to cut away what hides the view. The cut face shows HU as gray, window 400, level 40.
    pub clip: &'a [ClipPlane],
    /// Depth below the skin that the tissue had at rest, in mm, as [`skin_depth`](crate::skin_depth) gives it and as it was
    /// resampled with the body. Surface that was deep is colored as tissue of a wound. Without it all surface is skin.
    pub depth: Option<&'a Volume>,
    /// Thickness of what counts as skin where `depth` is given, mm. Default 2.
    pub skin_mm: f64,
    /// Reach of the ambient occlusion that darkens clefts, mm. Default 12; 0 switches it off.
    pub occlusion_mm: f64,
    /// Rays per pixel along each axis where the picture has an edge, 1 to 4. Default 2.
    pub samples: usize,
    /// Orientation letters and a scale bar.
    pub annotate: bool,
}

impl View<'_> {
    /// The whole volume from one side, 800 × 800.
    pub fn new(side: Side) -> Self {
        Self {
            side,
            width: 800,
            height: 800,
            threshold_hu: -300.0,
            focus: None,
            clip: &[],
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
        for plane in self.clip {
            let numbers = plane.point_mm.iter().chain(&plane.keep);
            let sum: f64 = numbers.map(|c| c.abs()).sum();
            let good = sum.is_finite() && plane.keep != [0.0; 3];
            check(good, "clip", sum, "finite, with a direction other than zero")?;
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
