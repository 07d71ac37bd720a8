//! The journal of a case: one line for each time that it ran. Lines are only added, so that a
//! killed program leaves all earlier ones, and at most one that is not complete.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::Error;

/// Bytes at the end of a journal that are read. A line has a few hundred.
const MAX_READ: u64 = 1 << 20;
/// Longest message that a line keeps, letters.
const MAX_MESSAGE: usize = 4000;

/// One line: how a case ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Name of the case.
    pub case: String,
    /// Version of the program.
    pub cutis_version: String,
    /// [`Case::settings_sha256`](super::Case::settings_sha256) of what ran.
    pub settings_sha256: String,
    /// SHA-256 of each file in [`Case::reads`](super::Case::reads). Empty if the case failed.
    pub inputs_sha256: Vec<String>,
    /// SHA-256 of `report.json`. None if the case failed.
    pub report_sha256: Option<String>,
    /// The message of a case that failed.
    pub error: Option<String>,
    /// Exit code: 0, 1 or 2 as for `cutis run`. None if a signal ended the program.
    pub exit: Option<i32>,
    /// Wall time, s.
    pub seconds: f64,
}

/// The journal of a case, open and locked for this process.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Opens the journal. Waits while another process runs the case.
    pub(super) fn open(path: &Path, wait: impl FnOnce()) -> Result<Self, Error> {
        let failed = |e: std::io::Error| failure(path, "write", &e);
        let options = OpenOptions::new().create(true).read(true).append(true).open(path);
        let file = options.map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => {
                wait();
                file.lock().map_err(failed)?;
            }
            // A file system without locks: two processes must not run one case.
            Err(std::fs::TryLockError::Error(_)) => {}
        }
        Ok(Self { path: path.into(), file })
    }

    /// The last complete line, and the number of complete lines among those that were read.
    pub(super) fn last(&mut self) -> Result<(Option<Entry>, usize), Error> {
        last_of(&mut self.file).map_err(|e| failure(&self.path, "read", &e))
    }

    /// Adds a line.
    pub(super) fn append(&mut self, entry: &Entry) -> Result<(), Error> {
        let failed = |e: std::io::Error| failure(&self.path, "write", &e);
        let error = entry.error.as_ref().map(|text| text.chars().take(MAX_MESSAGE).collect());
        let line = serde_json::to_string(&Entry { error, ..entry.clone() });
        let line = line.map_err(|e| failed(e.into()))?;
        // A killed program may have left half a line.
        let mut end = [b'\n'];
        if self.file.seek(SeekFrom::End(0)).map_err(failed)? > 0 {
            self.file.seek(SeekFrom::End(-1)).map_err(failed)?;
            self.file.read_exact(&mut end).map_err(failed)?;
        }
        let start = if end == *b"\n" { "" } else { "\n" };
        self.file.write_all(format!("{start}{line}\n").as_bytes()).map_err(failed)?;
        self.file.sync_data().map_err(failed)
    }
}

/// The last complete line of a journal, and the number of complete lines among those that were
/// read. None if there is no journal.
pub(super) fn last(path: &Path) -> Result<(Option<Entry>, usize), Error> {
    match File::open(path) {
        Ok(mut file) => last_of(&mut file).map_err(|e| failure(path, "read", &e)),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok((None, 0)),
        Err(e) => Err(failure(path, "read", &e)),
    }
}

fn last_of(file: &mut File) -> std::io::Result<(Option<Entry>, usize)> {
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(length.saturating_sub(MAX_READ)))?;
    let mut bytes = Vec::new();
    file.take(MAX_READ).read_to_end(&mut bytes)?;
    let lines = bytes.split_inclusive(|&byte| byte == b'\n').filter(|line| line.ends_with(b"\n"));
    let entries = lines.filter_map(|line| serde_json::from_slice(line).ok());
    Ok(entries.fold((None, 0), |(_, count), entry| (Some(entry), count + 1)))
}

fn failure(path: &Path, action: &'static str, error: &std::io::Error) -> Error {
    Error::File { path: path.into(), action, why: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(case: &str) -> Entry {
        Entry {
            case: case.into(),
            cutis_version: "0".into(),
            settings_sha256: "a".into(),
            inputs_sha256: vec!["b".into()],
            report_sha256: None,
            error: Some("line\nbreak".into()),
            exit: Some(1),
            seconds: 0.5,
        }
    }

    #[test]
    fn half_a_line_is_ignored_and_stays_apart_from_the_next_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jsonl");
        assert_eq!(last(&path).unwrap(), (None, 0));
        let append = |name: &str| Journal::open(&path, || {}).unwrap().append(&entry(name)).unwrap();
        append("one");
        append("two");
        let whole = std::fs::read(&path).unwrap();
        assert_eq!(last(&path).unwrap(), (Some(entry("two")), 2));
        // Every place at which a program may be killed.
        for end in 0..whole.len() {
            std::fs::write(&path, &whole[..end]).unwrap();
            let lines = whole[..end].iter().filter(|&&byte| byte == b'\n').count();
            assert_eq!(last(&path).unwrap().1, lines, "{end} bytes");
            append("three");
            assert_eq!(
                last(&path).unwrap(),
                (Some(entry("three")), lines + 1 + usize::from(is_whole(&whole[..end])))
            );
        }
    }

    /// Whether only the end of the last line is missing. The next line then completes it.
    fn is_whole(bytes: &[u8]) -> bool {
        let last = bytes.rsplit(|&byte| byte == b'\n').next().unwrap_or_default();
        serde_json::from_slice::<Entry>(last).is_ok()
    }

    #[test]
    fn a_second_process_waits() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jsonl");
        let mut first = Journal::open(&path, || panic!("nobody else runs it")).unwrap();
        let (waits, waited) = std::sync::mpsc::channel();
        std::thread::scope(|scope| {
            let second = scope.spawn(|| {
                let mut second = Journal::open(&path, move || waits.send(()).unwrap()).unwrap();
                second.last().unwrap()
            });
            waited.recv().unwrap();
            first.append(&entry("first")).unwrap();
            drop(first);
            assert_eq!(second.join().unwrap(), (Some(entry("first")), 1));
        });
    }
}
