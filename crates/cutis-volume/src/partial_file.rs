//! A file that appears under its name only when it is complete.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::VolumeError;

static NUMBER: AtomicU32 = AtomicU32::new(0);

/// Written beside its target under a hidden name, and renamed by [`PartialFile::commit`].
/// Dropped before that, it is removed and the target is as it was.
#[derive(Debug)]
pub struct PartialFile {
    file: Option<File>,
    beside: PathBuf,
    target: PathBuf,
}

impl PartialFile {
    /// Opens a new file in the folder of `target`.
    ///
    /// # Errors
    /// [`VolumeError::Io`] with the target's path if the folder is missing or read-only.
    pub fn create(target: impl AsRef<Path>) -> Result<Self, VolumeError> {
        let target = target.as_ref().to_path_buf();
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let beside = target.with_file_name(format!(".cutis-{}-{number}.part", std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&beside) {
                Ok(file) => return Ok(Self { file: Some(file), beside, target }),
                // Left by a process of the same number that was killed.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(source) => return Err(VolumeError::Io { path: target, action: "create", source }),
            }
        }
    }

    /// The name the file will have.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Flushes to the disk and renames to the target, replacing what was there.
    ///
    /// # Errors
    /// [`VolumeError::Io`] if the disk is full or the target cannot be replaced; the partial file is removed.
    pub fn commit(mut self) -> Result<(), VolumeError> {
        let done = match self.file.take() {
            Some(file) => file.sync_all().and_then(|()| {
                drop(file);
                fs::rename(&self.beside, &self.target)
            }),
            None => Ok(()),
        };
        done.map_err(|source| {
            // The rename did not happen: what is left is ours to remove, and the first error is the one to report.
            let _ = fs::remove_file(&self.beside);
            VolumeError::Io { path: self.target.clone(), action: "write", source }
        })
    }
}

impl Write for PartialFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.file {
            Some(file) => file.write(bytes),
            None => Err(io::ErrorKind::NotConnected.into()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        if self.file.take().is_some() {
            // Nobody is left to tell.
            let _ = fs::remove_file(&self.beside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn target_appears_at_commit_and_nothing_else_remains() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        let mut file = PartialFile::create(&target).unwrap();
        file.write_all(b"whole").unwrap();
        assert!(!target.exists());
        file.commit().unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"whole");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn dropped_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        fs::write(&target, b"old").unwrap();
        PartialFile::create(&target).unwrap().write_all(b"half").unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_target_that_cannot_be_replaced_is_an_error_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("folder");
        fs::create_dir(&target).unwrap();
        let error = PartialFile::create(&target).unwrap().commit().unwrap_err();
        assert!(error.to_string().contains("folder"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(PartialFile::create(folder.path().join("missing/a.txt")).is_err());
    }
}
