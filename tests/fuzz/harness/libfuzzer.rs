//! What the targets of cargo-fuzz call: one input for one reader.

use std::cell::RefCell;
use std::path::Path;

use anyhow::{Context, Result};

use crate::campaign::Desk;
use crate::targets::{TARGETS, Target, find};

thread_local! {
    /// The folder of the inputs. It stays, because making one for each input takes longer than most
    /// readers.
    static DESK: RefCell<Option<(&'static Target, Desk)>> = const { RefCell::new(None) };
}

/// Tries one input with the reader of this name.
///
/// # Panics
/// The reader panics, takes more time or memory than allowed, or accepts what it must not. The text
/// says what happened. There is no such reader, or the folder of the inputs cannot be written.
pub fn require_no_fault(name: &str, input: &[u8]) {
    let tried = DESK.with_borrow_mut(|kept| {
        if kept.is_none() {
            let target = find(name).unwrap_or_else(|| panic!("there is no reader {name}"));
            *kept = Some((target, Desk::new(target).expect("a temporary folder can be written")));
        }
        let (target, desk) = kept.as_ref().expect("it was just made");
        desk.try_input(target, input).expect("a temporary folder can be written")
    });
    if let Err(fault) = tried.outcome {
        panic!("{fault}");
    }
}

/// Writes the valid inputs of every reader into a folder for each, as the corpora of cargo-fuzz.
///
/// # Errors
/// A folder cannot be written.
pub fn write_corpus(folder: &Path) -> Result<()> {
    for target in TARGETS {
        let folder = folder.join(target.name);
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        for (number, seed) in (target.seeds)().into_iter().enumerate() {
            let path = folder.join(format!("seed-{number}"));
            std::fs::write(&path, seed).with_context(|| path.display().to_string())?;
        }
    }
    Ok(())
}
