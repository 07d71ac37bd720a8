//! A temporary folder for outputs that are only timed.

use std::fs;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::Error;
use crate::run::files::RunFolder;

/// Numbers the folders of one process.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// A temporary folder. Dropping it removes the folder and its contents.
pub(super) struct Scratch(pub(super) RunFolder);

impl Scratch {
    /// Creates a new folder in `parent`. It never reuses an existing one.
    ///
    /// # Errors
    /// [`Error::File`] if the folder cannot be created.
    pub(super) fn new(parent: &Path) -> Result<Self, Error> {
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let folder = parent.join(format!("cutis-tune-{}-{number}", std::process::id()));
            match fs::create_dir(&folder) {
                Ok(()) => return Ok(Self(RunFolder(folder))),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => {
                    let (action, why) = ("create the folder", error.to_string());
                    return Err(Error::File { path: folder, action, why });
                }
            }
        }
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // If removal fails, the folder stays among the system's temporary files.
        let _ = fs::remove_dir_all(&self.0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_existing_folder_is_neither_used_nor_removed() {
        let parent = tempfile::tempdir().unwrap();
        let next = NUMBER.load(Ordering::Relaxed);
        let taken = |n: u32| parent.path().join(format!("cutis-tune-{}-{n}", std::process::id()));
        for n in next..next + 3 {
            fs::create_dir(taken(n)).unwrap();
            fs::write(taken(n).join("mine"), "").unwrap();
        }
        let scratch = Scratch::new(parent.path()).unwrap();
        let own = scratch.0.0.clone();
        assert!(own.is_dir() && fs::read_dir(&own).unwrap().next().is_none());
        fs::write(own.join("output"), "").unwrap();
        drop(scratch);
        assert!(!own.exists() && (next..next + 3).all(|n| taken(n).join("mine").exists()));

        let error = Scratch::new(&parent.path().join("nowhere")).map(drop).unwrap_err();
        assert!(error.to_string().contains("nowhere"), "{error}");
    }
}
