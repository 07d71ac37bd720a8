//! Relaxation after a drag, for several values of k.

use cutis_chainmail::{ChainError, Material};

use super::look::{Line, Look};
use super::plate::{DRAG, Panel, Sample, plate};
use super::specimen::{IS_SOFT, SOFT, Specimen};

/// Enough sweeps for every k to settle.
const SWEEPS: u32 = 100_000;

pub fn figure() -> Result<String, ChainError> {
    let dragged = |k: f64| {
        let mut sheet = Specimen::new([16, 8], Material { k, ..SOFT }, |_, _| IS_SOFT)?;
        let lowest: Vec<u32> = (0..16).map(|i| sheet.chain.element([i, 0, 0])).collect();
        sheet.chain.fix(&lowest)?;
        sheet.drag([10, 7], [1.5, 4.0])?;
        Ok::<_, ChainError>(sheet)
    };
    let wave: Specimen = dragged(0.0)?;
    let energy = format!("Energy {:.2} mm²", wave.chain.energy_mm2());
    let mut panels = vec![Panel { below: energy, ..Panel::new("The wave alone", wave) }];
    for k in [0.2, 0.05, 0.0] {
        let mut sheet = dragged(k)?;
        let held: Vec<u32> = sheet.grabbed.iter().map(|&(element, _)| element).collect();
        let done = sheet.chain.relax(SWEEPS, &held);
        let energy =
            format!("Energy {:.2} mm², settled after {} sweeps", sheet.chain.energy_mm2(), done.sweeps);
        panels.push(Panel { below: energy, ..Panel::new(format!("Relaxed, k = {k}"), sheet) });
    }
    let legend = [
        &DRAG[..],
        &[
            Sample::Element(Look::Fixed, "fixed"),
            Sample::Link(Line::AtLimit, "link at a limit"),
            Sample::Link(Line::Within, "within"),
        ],
    ]
    .concat();
    Ok(plate(2, 40.0, &panels, &legend))
}
