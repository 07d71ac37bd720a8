//! One dimension: a drag shortens a row on one side and stretches it on the other.

use cutis_chainmail::ChainError;

use super::look::Line;
use super::plate::{DRAG, Panel, Sample, plate};
use super::specimen::{IS_SOFT, SOFT, Specimen};

pub fn figure() -> Result<String, ChainError> {
    let row = Specimen::new([10, 1], SOFT, |_, _| IS_SOFT)?;
    let mut panels = vec![Panel::new("At rest", row.with_grabbed([4, 0]))];
    for (by, title) in
        [(2.5, "The fifth element dragged by 2.5 steps"), (5.0, "By 5 steps: all had to follow")]
    {
        let mut dragged = row.clone();
        dragged.drag([4, 0], [by, 0.0])?;
        panels.push(Panel::new(title, dragged));
    }
    panels.iter_mut().for_each(|panel| panel.lengths = true);
    let legend = [
        &DRAG[..],
        &[
            Sample::Link(Line::AtLimit, "link at its shortest (0.5) or longest (2)"),
            Sample::Link(Line::Within, "within"),
        ],
    ]
    .concat();
    Ok(plate(1, 62.0, &panels, &legend))
}
