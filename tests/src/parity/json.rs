//! The result as JSON: every row, and what it was found with.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::process::Command;

use cutis::report::Machine;
use cutis_gpu::Adapter;
use serde::Serialize;

use super::difference::Policy;
use super::options::Options;
use super::outcome::Row;

/// Version of the layout.
const SCHEMA: &str = "cutis-parity/1";

/// Variables that change how a software driver works.
const VARIABLES: [&str; 3] = ["LP_NUM_THREADS", "VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

/// The whole result.
#[derive(Serialize)]
pub struct Document<'a> {
    schema: &'static str,
    cutis_version: &'static str,
    /// Of the source, if it is known.
    commit: Option<String>,
    machine: Machine,
    settings: &'a Options,
    environment: BTreeMap<&'static str, String>,
    adapters: Vec<AdapterEntry>,
    /// Whether every row is what it had to be.
    pub passed: bool,
    /// All rows.
    pub rows: &'a [Row],
}

/// An adapter that was compared.
#[derive(Serialize)]
struct AdapterEntry {
    index: usize,
    name: String,
    kind: String,
    api: &'static str,
    driver: String,
    /// What it is held to.
    policy: String,
}

impl<'a> Document<'a> {
    /// The result of `rows` on `adapters`.
    pub fn new(settings: &'a Options, adapters: &[Adapter], rows: &'a [Row], passed: bool) -> Self {
        let entry = |adapter: &Adapter| AdapterEntry {
            index: adapter.index,
            name: adapter.name.clone(),
            kind: adapter.kind.to_string(),
            api: adapter.api,
            driver: adapter.driver.clone(),
            policy: Policy::of(adapter).describe(),
        };
        let variable = |name| Some((name, std::env::var(name).ok()?));
        Self {
            schema: SCHEMA,
            cutis_version: env!("CARGO_PKG_VERSION"),
            commit: commit(),
            machine: Machine::here(),
            settings,
            environment: VARIABLES.into_iter().filter_map(variable).collect(),
            adapters: adapters.iter().map(entry).collect(),
            passed,
            rows,
        }
    }

    /// Writes the file.
    ///
    /// # Errors
    /// Of the file.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let text = serde_json::to_string_pretty(self)?;
        std::fs::write(path, text + "\n").map_err(|error| {
            io::Error::new(error.kind(), format!("cannot write {}: {error}", path.display()))
        })
    }
}

/// The commit of the checkout, marked if there are changes since.
fn commit() -> Option<String> {
    let words = ["describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"];
    let output = Command::new("git").current_dir(env!("CARGO_MANIFEST_DIR")).args(words).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::outcome::{Measured, Ring, Subject};
    use cutis_gpu::{AdapterKind, Limits};

    #[test]
    fn the_keys_that_others_rely_on_are_there() {
        let limits = Limits {
            max_buffer_bytes: 1,
            max_binding_bytes: 1,
            max_workgroups: 1,
            max_texture_3d: 1,
            storage_buffers_per_stage: 8,
        };
        let adapter = Adapter {
            index: 0,
            name: "card".into(),
            kind: AdapterKind::Software,
            api: "vulkan",
            driver: "driver 1.0".into(),
            limits,
            timestamps: false,
            lacking: None,
        };
        let subject = Subject { ring: Ring::Scene, name: "demo", adapter: "card", control: None };
        let rows = [Row::judge(&subject, Ok(Measured::at_most(1, 0.0, 0.0, "extent")), &[])];
        let options = Options { chunk_cap: Some(7), ..Options::default() };
        let json = serde_json::to_value(Document::new(&options, &[adapter], &rows, true)).unwrap();
        assert_eq!(json["rows"][0]["ring"], "scene");
        assert_eq!(json["rows"][0]["outcome"], "exact");
        assert_eq!(json["adapters"][0]["driver"], "driver 1.0");
        assert_eq!(json["adapters"][0]["policy"], "every number equal");
        assert_eq!(json["settings"]["chunk_cap"], 7);
        assert_eq!(json["passed"], true);
        assert!(json["cutis_version"].is_string() && json["machine"]["cores"].is_u64());
    }
}
