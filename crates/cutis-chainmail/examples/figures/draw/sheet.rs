//! Two dimensions: a drag shortens, stretches and shears a sheet.

use cutis_chainmail::ChainError;

use super::look::Line;
use super::plate::{DRAG, Panel, Sample, plate};
use super::specimen::{IS_SOFT, SOFT, Specimen};

pub fn figure() -> Result<String, ChainError> {
    let sheet = Specimen::new([16, 10], SOFT, |_, _| IS_SOFT)?;
    let mut dragged = sheet.clone();
    dragged.drag([9, 6], [3.0, 2.5])?;
    let panels =
        [Panel::new("At rest", sheet.with_grabbed([9, 6])), Panel::new("One element dragged", dragged)];
    let legend =
        [&DRAG[..], &[Sample::Link(Line::AtLimit, "link at a limit"), Sample::Link(Line::Within, "within")]]
            .concat();
    Ok(plate(2, 40.0, &panels, &legend))
}
