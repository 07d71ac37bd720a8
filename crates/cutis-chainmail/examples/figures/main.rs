//! Writes the figures of the book's ChainMail page into `docs/book/figures`.
#![forbid(unsafe_code)]

mod draw;

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/figures");
    std::fs::create_dir_all(&folder)?;
    for (name, svg) in draw::all()? {
        std::fs::write(folder.join(name), svg)?;
    }
    Ok(())
}
