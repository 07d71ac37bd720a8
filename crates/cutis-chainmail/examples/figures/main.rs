//! Writes the figures of the book's page about ChainMail into `docs/book/figures`.
#![forbid(unsafe_code)]

mod made;

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/figures");
    std::fs::create_dir_all(&folder)?;
    for (name, svg) in made::all()? {
        std::fs::write(folder.join(name), svg)?;
    }
    Ok(())
}
