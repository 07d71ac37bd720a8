//! What classic ChainMail was not made for, beside what the wave makes of it.

use cutis_chainmail::{Blade, ChainError, Material};

use super::body::{Body, FIRM, IS_RIGID, IS_SOFT};
use super::look::{Line, Look};
use super::plate::{Panel, Sample, plate};

/// Between soft and firm.
const HALF_FIRM: Material = Material::isotropic(0.6, 1.6, 0.2, 0.0);

/// A rigid block in a soft sheet.
pub fn several_materials() -> Result<String, ChainError> {
    let block = |i: usize, j: usize| (6..10).contains(&i) && (3..7).contains(&j);
    let sheet = Body::new([16, 10], HALF_FIRM, |i, j| if block(i, j) { IS_RIGID } else { IS_SOFT })?;
    both(sheet, [12, 8], [2.0, 4.0], &[Sample::Element(Look::Rigid, "rigid")])
}

/// A sheet with slits from both sides.
pub fn cut() -> Result<String, ChainError> {
    let mut sheet = Body::new([16, 10], FIRM, |_, _| IS_SOFT)?;
    for (x, y) in [(3.5, -0.5), (7.5, 2.5), (11.5, -0.5)] {
        let blade = Blade { from: [x, y, -1.0], to: [x, y, 1.0], along: [0.0, 7.0, 0.0] };
        sheet.chain.cut_with(&blade);
    }
    both(sheet, [0, 5], [-4.0, -2.0], &[])
}

/// Classic and wave: the same body, the same drag.
fn both(body: Body, place: [usize; 2], by: [f64; 2], also: &[Sample]) -> Result<String, ChainError> {
    let (mut classic, mut wave) = (body.clone(), body);
    classic.pull_classic(place, by)?;
    wave.pull(place, by)?;
    let panels = [("Classic", classic), ("Wave", wave)].map(|(title, body)| {
        let below = beyond(&body);
        Panel { below, ..Panel::new(title, body) }
    });
    let mut legend = vec![
        Sample::Element(Look::Grabbed, "grabbed"),
        Sample::Link(Line::Pull, "its way"),
        Sample::Element(Look::Soft, "moved"),
        Sample::Element(Look::Still, "where it was"),
    ];
    legend.extend_from_slice(also);
    legend.extend([
        Sample::Link(Line::Beyond, "link beyond its limits"),
        Sample::Link(Line::AtLimit, "at a limit"),
        Sample::Link(Line::Within, "within"),
    ]);
    Ok(plate(2, 40.0, &panels, &legend))
}

/// How many links are beyond their limits, and how far.
fn beyond(body: &Body) -> String {
    let (found, all) = (body.chain.violations(), body.links().count());
    match found.worst {
        Some(worst) => {
            format!(
                "{} of {all} links beyond their limits, the worst by {:.2} steps",
                found.links, worst.excess
            )
        }
        None => format!("None of {all} links beyond its limits"),
    }
}
