//! Two dimensions: a sheet is pushed, drawn along and sheared.

use cutis_chainmail::ChainError;

use super::body::{Body, IS_SOFT, SOFT};
use super::look::{Line, Look};
use super::plate::{Panel, Sample, plate};

pub fn figure() -> Result<String, ChainError> {
    let sheet = Body::new([16, 10], SOFT, |_, _| IS_SOFT)?;
    let mut dragged = sheet.clone();
    dragged.pull([9, 6], [3.0, 2.5])?;
    let panels =
        [Panel::new("At rest", sheet.about_to_pull([9, 6])), Panel::new("One element dragged", dragged)];
    let legend = [
        Sample::Element(Look::Grabbed, "grabbed"),
        Sample::Link(Line::Pull, "its way"),
        Sample::Element(Look::Soft, "moved"),
        Sample::Element(Look::Still, "where it was"),
        Sample::Link(Line::AtLimit, "link at a limit"),
        Sample::Link(Line::Within, "within"),
    ];
    Ok(plate(2, 40.0, &panels, &legend))
}
