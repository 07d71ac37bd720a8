//! Files that appear under their name only when they are complete.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::VolumeError;

static NUMBER: AtomicU32 = AtomicU32::new(0);

/// A file that appears under its name only when it is complete.
///
/// The bytes go to a hidden file in the same folder, which [`PartialFile::commit`] renames to the
/// target. If the `PartialFile` is dropped before that, the hidden file is removed and the target
/// does not change.
#[derive(Debug)]
pub struct PartialFile {
    file: Option<File>,
    hidden: PathBuf,
    target: PathBuf,
}

impl PartialFile {
    /// Creates the hidden file in the folder of `target`.
    ///
    /// # Errors
    /// [`VolumeError::Io`] with the path of the target if the folder is missing or read-only.
    pub fn create(target: impl AsRef<Path>) -> Result<Self, VolumeError> {
        let target = target.as_ref().to_path_buf();
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let hidden = target.with_file_name(format!(".cutis-{}-{number}.part", std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&hidden) {
                Ok(file) => return Ok(Self { file: Some(file), hidden, target }),
                // A killed process with the same id left this file.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(source) => return Err(VolumeError::Io { path: target, action: "create", source }),
            }
        }
    }

    /// Flushes the file to the disk and renames it to the target, replacing any old file.
    ///
    /// # Errors
    /// [`VolumeError::Io`] if the disk is full or the target cannot be replaced. The hidden file is
    /// then removed.
    pub fn commit(mut self) -> Result<(), VolumeError> {
        let done = match self.file.take() {
            Some(file) => file.sync_all().and_then(|()| {
                drop(file);
                fs::rename(&self.hidden, &self.target)
            }),
            None => Ok(()),
        };
        done.map_err(|source| {
            // The first error is the one to report, so an error of this removal is ignored.
            let _ = fs::remove_file(&self.hidden);
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
            // A destructor cannot report an error.
            let _ = fs::remove_file(&self.hidden);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commit_creates_the_target_and_leaves_no_other_file() {
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
    fn drop_keeps_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        fs::write(&target, b"old").unwrap();
        PartialFile::create(&target).unwrap().write_all(b"half").unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn failed_commit_is_an_error_and_leaves_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("folder");
        fs::create_dir(&target).unwrap();
        let error = PartialFile::create(&target).unwrap().commit().unwrap_err();
        assert!(error.to_string().contains("folder"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(PartialFile::create(folder.path().join("missing/a.txt")).is_err());
    }
}
