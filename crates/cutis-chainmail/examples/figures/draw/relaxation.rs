//! What relaxation leaves of a drag, by k.

use cutis_chainmail::{ChainError, Material};

use super::body::{Body, IS_SOFT, SOFT};
use super::look::{Line, Look};
use super::plate::{Panel, Sample, plate};

/// Enough for every k to settle.
const SWEEPS: u32 = 100_000;

pub fn figure() -> Result<String, ChainError> {
    let dragged = |k: f64| {
        let mut sheet = Body::new([16, 8], Material { k, ..SOFT }, |_, _| IS_SOFT)?;
        let lowest: Vec<u32> = (0..16).map(|i| sheet.chain.element([i, 0, 0])).collect();
        sheet.chain.fix(&lowest)?;
        sheet.pull([10, 7], [1.5, 4.0])?;
        Ok::<_, ChainError>(sheet)
    };
    let wave: Body = dragged(0.0)?;
    let energy = format!("Energy {:.2} mm²", wave.chain.energy_mm2());
    let mut panels = vec![Panel { below: energy, ..Panel::new("The wave alone", wave) }];
    for k in [0.2, 0.05, 0.0] {
        let mut sheet = dragged(k)?;
        let held: Vec<u32> = sheet.pulled.iter().map(|&(element, _)| element).collect();
        let done = sheet.chain.relax(SWEEPS, &held);
        let energy =
            format!("Energy {:.2} mm², settled after {} sweeps", sheet.chain.energy_mm2(), done.sweeps);
        panels.push(Panel { below: energy, ..Panel::new(format!("Relaxed, k = {k}"), sheet) });
    }
    let legend = [
        Sample::Element(Look::Grabbed, "grabbed"),
        Sample::Link(Line::Pull, "its way"),
        Sample::Element(Look::Soft, "moved"),
        Sample::Element(Look::Still, "where it was"),
        Sample::Element(Look::Fixed, "fixed"),
        Sample::Link(Line::AtLimit, "link at a limit"),
        Sample::Link(Line::Within, "within"),
    ];
    Ok(plate(2, 40.0, &panels, &legend))
}
