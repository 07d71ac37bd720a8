//! Tools shared by the studies: tables and charts, the pages of `docs/results`, provenance, checks
//! with controls, and programs that run in the checkout.

mod checkout;
mod checks;
mod page;
mod program;
mod provenance;
mod table;
mod worst;

pub use checkout::{cargo, command, execute, results, root, scene, target_dir};
pub use checks::Checks;
pub use page::Page;
pub use program::{Program, number_at};
pub use provenance::{Provenance, commit, load};
pub use table::{Row, Table, number, optional, percent};
pub use worst::larger;

/// An error that ends a study.
pub type Failure = anyhow::Error;

/// Writes `value` as JSON, indented, with a line break at the end.
///
/// # Errors
/// The file cannot be written.
pub fn write_json(path: &std::path::Path, value: &impl serde::Serialize) -> Result<(), Failure> {
    use anyhow::Context as _;
    let text = serde_json::to_string_pretty(value)?;
    std::fs::write(path, text + "\n").with_context(|| format!("cannot write {}", path.display()))
}
