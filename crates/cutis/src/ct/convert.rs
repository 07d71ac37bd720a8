//! `cutis convert`: reads a volume and writes it in another format.

use std::path::Path;

use cutis_volume::{Format, ReadOptions};

use crate::Error;

/// Reads a volume and writes it to a file, whose extension decides the format. Returns the notes of
/// the reader.
///
/// # Errors
/// [`Error::Volume`] if the volume cannot be read or written.
pub fn convert(path: &Path, options: &ReadOptions, out: &Path) -> Result<Vec<String>, Error> {
    // A wrong name is reported before the time for reading is spent.
    Format::of(out)?;
    let loaded = cutis_volume::read(path, options)?;
    cutis_volume::write(out, &loaded.volume)?;
    Ok(loaded.warnings)
}
