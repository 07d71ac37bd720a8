//! Draws the figures with the present code of the crate. Coordinates and energies are exact and
//! numbers have fixed decimals, so that the same code gives the same bytes.

mod comb;
mod failures;
mod look;
mod plate;
mod relaxation;
mod row;
mod sheet;
mod specimen;
mod svg;

use cutis_chainmail::ChainError;

/// File names and contents of all figures.
pub fn all() -> Result<Vec<(&'static str, String)>, ChainError> {
    Ok(vec![
        ("chainmail-1d.svg", row::figure()?),
        ("chainmail-2d.svg", sheet::figure()?),
        ("chainmail-materials.svg", failures::several_materials()?),
        ("chainmail-cut.svg", failures::cut()?),
        ("chainmail-comb.svg", comb::figure()?),
        ("chainmail-relaxation.svg", relaxation::figure()?),
    ])
}
