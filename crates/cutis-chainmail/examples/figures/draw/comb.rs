//! How far a drag is felt in a body that hangs together only at one side.

use cutis_chainmail::{ChainError, NO_MATERIAL};

use super::body::{Body, FIRM, IS_SOFT};
use super::look::{Line, Look};
use super::plate::{Panel, Sample, plate};

pub fn figure() -> Result<String, ChainError> {
    let comb = Body::new([18, 10], FIRM, |i, j| if i % 4 < 2 || j < 2 { IS_SOFT } else { NO_MATERIAL })?;
    let mut dragged = comb.clone();
    dragged.pull([0, 9], [-5.0, 1.0])?;
    let most = dragged.elements().map(|(element, _)| dragged.distance(element)).fold(0.0, f64::max);
    let panels = [("At rest", comb.about_to_pull([0, 9])), ("The tip of the first tooth dragged", dragged)]
        .map(|(title, body)| {
            let went = |(element, _)| (element, Look::Went(body.distance(element) / most));
            let look = Some(body.elements().map(went).collect());
            Panel { look, ..Panel::new(title, body) }
        });
    let legend = [
        Sample::Element(Look::Grabbed, "grabbed"),
        Sample::Link(Line::Pull, "its way"),
        Sample::Distances(most),
        Sample::Link(Line::AtLimit, "link at a limit"),
        Sample::Link(Line::Within, "within"),
    ];
    Ok(plate(2, 40.0, &panels, &legend))
}
