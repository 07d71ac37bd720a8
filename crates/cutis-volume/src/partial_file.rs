//! Files that appear under their name only when they are complete.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::VolumeError;

static NUMBER: AtomicU32 = AtomicU32::new(0);

/// A file that appears under its name only when it is complete.
///
/// The bytes go to a hidden file in the same folder, which [`PartialFile::commit`] renames to the
/// target. If the `PartialFile` is dropped before that, the hidden file is removed and the target
/// does not change. A killed process leaves its hidden files, which
/// [`PartialFile::remove_abandoned`] removes. A process locks its hidden files, so that others can
/// tell them from abandoned ones.
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
                Ok(file) if is_held(&file, &hidden) => {
                    return Ok(Self { file: Some(file), hidden, target });
                }
                // Another process has just taken it for an abandoned file.
                Ok(_) => {}
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
            // The lock ends after the file has its name.
            Some(file) => file.sync_all().and_then(|()| fs::rename(&self.hidden, &self.target)),
            None => Ok(()),
        };
        done.map_err(|source| {
            // The first error is the one to report, so an error of this removal is ignored.
            let _ = fs::remove_file(&self.hidden);
            VolumeError::Io { path: self.target.clone(), action: "write", source }
        })
    }
}

impl PartialFile {
    /// Removes the hidden files that killed processes left in a folder, and returns their number.
    /// Those of running processes stay. So do all on a file system without locks, and those that
    /// cannot be removed.
    pub fn remove_abandoned(folder: impl AsRef<Path>) -> usize {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let hidden = entries.filter(|entry| {
            entry.file_type().is_ok_and(|kind| kind.is_file())
                && entry.file_name().to_str().is_some_and(is_hidden_name)
        });
        let abandoned = |path: &PathBuf| {
            let file = OpenOptions::new().write(true).open(path);
            file.is_ok_and(|file| file.try_lock().is_ok() && fs::remove_file(path).is_ok())
        };
        hidden.map(|entry| entry.path()).filter(abandoned).count()
    }
}

/// Locks a hidden file. Returns false if another process holds or has removed it. Without locks in
/// the file system nobody removes it.
fn is_held(file: &File, hidden: &Path) -> bool {
    !matches!(file.try_lock(), Err(TryLockError::WouldBlock)) && hidden.exists()
}

/// Whether a name is `.cutis-PROCESS-NUMBER.part`.
fn is_hidden_name(name: &str) -> bool {
    let numbers = name.strip_prefix(".cutis-").and_then(|rest| rest.strip_suffix(".part")?.split_once('-'));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    numbers.is_some_and(|(process, number)| is_number(process) && is_number(number))
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
    fn only_abandoned_files_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let names =
            [".cutis-7-0.part", ".cutis-7-.part", ".cutis-7-0.part2", "cutis-7-0.part", ".cutis-x-0.part"];
        for name in names {
            fs::write(folder.path().join(name), b"half").unwrap();
        }
        let target = folder.path().join("a.txt");
        let mut held = PartialFile::create(&target).unwrap();
        assert_eq!(PartialFile::remove_abandoned(folder.path()), 1);
        assert!(!folder.path().join(names[0]).exists());
        assert!(names[1..].iter().all(|name| folder.path().join(name).exists()));
        held.write_all(b"whole").unwrap();
        held.commit().unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"whole");
        assert_eq!(PartialFile::remove_abandoned(folder.path().join("missing")), 0);
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
