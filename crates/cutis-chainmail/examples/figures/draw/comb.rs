//! A comb shows how far a drag reaches in a body whose parts are connected at one side only.

use cutis_chainmail::{ChainError, NO_MATERIAL};

use super::look::{Line, Look};
use super::plate::{Panel, Sample, plate};
use super::specimen::{FIRM, IS_SOFT, Specimen};

pub fn figure() -> Result<String, ChainError> {
    let comb = Specimen::new([18, 10], FIRM, |i, j| if i % 4 < 2 || j < 2 { IS_SOFT } else { NO_MATERIAL })?;
    let mut dragged = comb.clone();
    dragged.drag([0, 9], [-5.0, 1.0])?;
    let most = dragged.elements().map(|(element, _)| dragged.distance(element)).fold(0.0, f64::max);
    let panels = [("At rest", comb.with_grabbed([0, 9])), ("The tip of the first tooth dragged", dragged)]
        .map(|(title, specimen)| {
            let went = |(element, _)| (element, Look::Displaced(specimen.distance(element) / most));
            let look = Some(specimen.elements().map(went).collect());
            Panel { look, ..Panel::new(title, specimen) }
        });
    let legend = [
        Sample::Element(Look::Grabbed, "grabbed"),
        Sample::Link(Line::Path, "its way"),
        Sample::Distances(most),
        Sample::Link(Line::AtLimit, "link at a limit"),
        Sample::Link(Line::Within, "within"),
    ];
    Ok(plate(2, 40.0, &panels, &legend))
}
