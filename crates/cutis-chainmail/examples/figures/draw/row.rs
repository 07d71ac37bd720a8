//! One dimension: a row is pushed on one side and drawn along on the other.

use cutis_chainmail::ChainError;

use super::body::{Body, IS_SOFT, SOFT};
use super::look::{Line, Look};
use super::plate::{Panel, Sample, plate};

pub fn figure() -> Result<String, ChainError> {
    let row = Body::new([10, 1], SOFT, |_, _| IS_SOFT)?;
    let mut panels = vec![Panel::new("At rest", row.about_to_pull([4, 0]))];
    for (by, title) in
        [(2.5, "The fifth element dragged by 2.5 steps"), (5.0, "By 5 steps: all had to follow")]
    {
        let mut dragged = row.clone();
        dragged.pull([4, 0], [by, 0.0])?;
        panels.push(Panel::new(title, dragged));
    }
    panels.iter_mut().for_each(|panel| panel.lengths = true);
    let legend = [
        Sample::Element(Look::Grabbed, "grabbed"),
        Sample::Link(Line::Pull, "its way"),
        Sample::Element(Look::Soft, "moved"),
        Sample::Element(Look::Still, "where it was"),
        Sample::Link(Line::AtLimit, "link at its shortest (0.5) or longest (2)"),
        Sample::Link(Line::Within, "within"),
    ];
    Ok(plate(1, 62.0, &panels, &legend))
}
