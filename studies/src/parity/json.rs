//! The result as JSON: every comparison and its provenance.

use std::collections::BTreeMap;

use cutis::report::Machine;
use cutis_gpu::Adapter;
use serde::Serialize;

use super::comparison::Comparison;
use super::difference::Policy;
use super::options::Options;
use crate::kit::{commit, load};

/// Version of the layout.
const SCHEMA: &str = "cutis-parity/1";

/// Environment variables that change how a software driver works.
const VARIABLES: [&str; 3] = ["LP_NUM_THREADS", "VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

/// The whole result.
#[derive(Serialize)]
pub struct Document<'a> {
    schema: &'static str,
    cutis_version: &'static str,
    commit: Option<String>,
    /// Load of the machine at the end.
    load: Option<String>,
    machine: Machine,
    settings: &'a Options,
    environment: BTreeMap<&'static str, String>,
    adapters: Vec<AdapterEntry>,
    /// True if every comparison has the required verdict.
    pub passed: bool,
    /// All comparisons.
    pub rows: &'a [Comparison],
}

/// An adapter that was compared with the CPU.
#[derive(Serialize)]
struct AdapterEntry {
    index: usize,
    name: String,
    kind: String,
    api: &'static str,
    driver: String,
    /// Largest allowed difference.
    policy: String,
}

impl<'a> Document<'a> {
    /// The result of `rows` on `adapters`.
    pub fn new(settings: &'a Options, adapters: &[Adapter], rows: &'a [Comparison], passed: bool) -> Self {
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
            load: load(),
            machine: Machine::here(),
            settings,
            environment: VARIABLES.into_iter().filter_map(variable).collect(),
            adapters: adapters.iter().map(entry).collect(),
            passed,
            rows,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::comparison::{Measured, Ring, Subject};
    use cutis_gpu::{AdapterKind, Limits};

    #[test]
    fn the_document_has_the_documented_keys() {
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
        let rows = [Comparison::judge(&subject, Ok(Measured::at_most(1, 0.0, 0.0, "extent")), &[])];
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
