//! Where figures come from: commit, machine and its load, scans.

use std::path::PathBuf;
use std::process::Command;

/// Average number of processes at work in the last minute, where the system says so.
pub fn load() -> Option<String> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next().map(str::to_owned)
}

/// The commit of the checkout, marked if there are changes since.
pub fn commit() -> Option<String> {
    let words = ["describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"];
    let output = Command::new("git").current_dir(env!("CARGO_MANIFEST_DIR")).args(words).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

/// A real scan by its file name.
///
/// # Errors
/// That it is absent.
pub fn scan(name: &str) -> Result<PathBuf, String> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
    let data = PathBuf::from(std::env::var_os("CUTIS_TEST_DATA").unwrap_or_else(|| beside.into()));
    let path = data.join("ct").join(name);
    match path.is_file() {
        true => Ok(path),
        false => Err(format!("there is no {} (set CUTIS_TEST_DATA)", path.display())),
    }
}
