//! The figures, each as the crate has it now. Coordinates and energies are exact, and numbers are written with fixed decimals, so that
//! the same crate makes the same bytes.

mod body;
mod comb;
mod failures;
mod look;
mod plate;
mod relaxation;
mod row;
mod sheet;
mod svg;

use cutis_chainmail::ChainError;

/// Names of files and what is in them.
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
