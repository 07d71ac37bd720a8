//! The files of the checkout, by their path from its root.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// All files except those of build and version-control folders. Paths use `/`.
pub struct Files {
    root: PathBuf,
    files: BTreeSet<String>,
    folders: BTreeSet<String>,
}

impl Files {
    /// Lists the checkout. Symbolic links count as files and are not followed.
    pub fn list(root: &Path) -> Result<Self> {
        let mut found = Self { root: root.to_path_buf(), files: BTreeSet::new(), folders: BTreeSet::new() };
        found.walk("")?;
        Ok(found)
    }

    fn walk(&mut self, folder: &str) -> Result<()> {
        let absolute = self.root.join(folder);
        for entry in std::fs::read_dir(&absolute).with_context(|| absolute.display().to_string())? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = if folder.is_empty() { name.clone() } else { format!("{folder}/{name}") };
            if !entry.file_type()?.is_dir() {
                self.files.insert(path);
            } else if name != "target" && name != ".git" {
                self.walk(&path)?;
                self.folders.insert(path);
            }
        }
        Ok(())
    }

    /// Whether the path is a file or a folder. With a `/` at its end it must be a folder.
    pub fn exists(&self, path: &str) -> bool {
        match path.strip_suffix('/') {
            Some(folder) => self.folders.contains(folder),
            None => path.is_empty() || self.files.contains(path) || self.folders.contains(path),
        }
    }

    /// Whether any folder has a file of this name.
    pub fn has_name(&self, name: &str) -> bool {
        self.files.iter().any(|path| path.rsplit('/').next() == Some(name))
    }

    /// Paths that end with `.extension`, sorted.
    pub fn with_extension(&self, extension: &str) -> impl Iterator<Item = &str> {
        let suffix = format!(".{extension}");
        self.files.iter().map(String::as_str).filter(move |path| path.ends_with(&suffix))
    }

    /// The text of a file.
    pub fn read(&self, path: &str) -> Result<String> {
        std::fs::read_to_string(self.root.join(path)).with_context(|| path.to_owned())
    }

    #[cfg(test)]
    pub fn of(files: &[&str]) -> Self {
        let files: BTreeSet<String> = files.iter().map(|&path| path.to_owned()).collect();
        let mut folders = BTreeSet::new();
        for path in &files {
            folders.extend(path.match_indices('/').map(|(end, _)| path[..end].to_owned()));
        }
        Self { root: PathBuf::new(), files, folders }
    }
}
