//! Two bodies that classic ChainMail cannot handle, next to the result of the wave.

use cutis_chainmail::{ChainError, Material};

use super::look::{Line, Look};
use super::plate::{DRAG, Panel, Sample, plate};
use super::specimen::{FIRM, IS_RIGID, IS_SOFT, Specimen};

/// A material between soft and firm.
const HALF_FIRM: Material = Material::isotropic(0.6, 1.6, 0.2, 0.0);

/// Draws a rigid block in a soft sheet.
pub fn several_materials() -> Result<String, ChainError> {
    let block = |i: usize, j: usize| (6..10).contains(&i) && (3..7).contains(&j);
    let sheet = Specimen::new([16, 10], HALF_FIRM, |i, j| if block(i, j) { IS_RIGID } else { IS_SOFT })?;
    both(sheet, [12, 8], [2.0, 4.0], &[Sample::Element(Look::Rigid, "rigid")])
}

/// Draws a sheet with slits from both sides.
pub fn cut() -> Result<String, ChainError> {
    let mut sheet = Specimen::new([16, 10], FIRM, |_, _| IS_SOFT)?;
    // Each slit is behind a column and seven rows long.
    let slits = [(3.0, 0.0), (7.0, 3.0), (11.0, 0.0)];
    sheet.chain.cut(|chain, a, b| {
        let [[i, j, _], [next, ..]] = [a, b].map(|element| chain.position(element));
        let crosses = |&(column, row)| i == column && next > i && (row..row + 7.0).contains(&j);
        slits.iter().any(crosses)
    });
    both(sheet, [0, 5], [-4.0, -2.0], &[])
}

/// Draws the result of the same drag by the classic algorithm and by the wave.
fn both(specimen: Specimen, place: [usize; 2], by: [f64; 2], also: &[Sample]) -> Result<String, ChainError> {
    let (mut classic, mut wave) = (specimen.clone(), specimen);
    classic.drag_classic(place, by)?;
    wave.drag(place, by)?;
    let panels = [("Classic", classic), ("Wave", wave)].map(|(title, specimen)| {
        let below = beyond(&specimen);
        Panel { below, ..Panel::new(title, specimen) }
    });
    let links = [
        Sample::Link(Line::Beyond, "link beyond its limits"),
        Sample::Link(Line::AtLimit, "at a limit"),
        Sample::Link(Line::Within, "within"),
    ];
    let legend = [&DRAG[..], also, &links].concat();
    Ok(plate(2, 40.0, &panels, &legend))
}

/// A caption with the number of links beyond their limits, and the largest violation.
fn beyond(specimen: &Specimen) -> String {
    let (found, all) = (specimen.chain.violations(), specimen.links().count());
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
