//! Real CT volumes. They are not part of the repository: see CONTRIBUTING.md.

use std::path::PathBuf;

/// Folder of the test data: `CUTIS_TEST_DATA`, else `shared/data` next to the checkout.
#[must_use]
pub fn folder() -> PathBuf {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    PathBuf::from(std::env::var_os("CUTIS_TEST_DATA").unwrap_or_else(|| default.into()))
}

/// Path of a file or folder of the test data, such as `ct/head.nii.gz`. `None` if it is missing;
/// the reason is printed.
///
/// # Panics
/// If it is missing and `CI` is set.
#[must_use]
pub fn find(name: &str) -> Option<PathBuf> {
    let path = folder().join(name);
    if path.exists() {
        return Some(path);
    }
    assert!(std::env::var_os("CI").is_none(), "test data are missing: {}", path.display());
    eprintln!("skipped: {} is missing (set CUTIS_TEST_DATA)", path.display());
    None
}
