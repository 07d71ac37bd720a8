//! Names the keys in which a scene differs from the one that wrote a checkpoint.

use std::collections::BTreeSet;

use serde_json::Value;

use super::checkpoint::OTHER_SCENE;
use super::files::RunFolder;
use crate::{Error, Scene};

/// Most keys that a message names.
const MOST_KEYS: usize = 5;
/// Keys that a resumed run may change.
const FREE: [&str; 6] =
    ["run", "output", "volume.path", "solver.backend", "solver.adapter", "solver.threads"];

/// Adds the differing keys to the error of a checkpoint that another scene wrote, if the run folder
/// has a report. Other errors stay.
pub(crate) fn explain(error: Error, folder: &RunFolder, scene: &Scene) -> Error {
    match error {
        Error::Checkpoint { path, why } if why == OTHER_SCENE => {
            let named = keys(folder, scene).filter(|keys| !keys.is_empty());
            let why = named.map_or(why, |keys| {
                let more = if keys.len() > MOST_KEYS { ", …" } else { "" };
                let keys: Vec<String> = keys.iter().take(MOST_KEYS).map(|key| format!("`{key}`")).collect();
                format!(
                    "the scene in the report of that run differs in {}{more}; give the same --set as for the run",
                    keys.join(", ")
                )
            });
            Error::Checkpoint { path, why }
        }
        other => other,
    }
}

/// The keys in which the scene differs from that of the report.
fn keys(folder: &RunFolder, scene: &Scene) -> Option<Vec<String>> {
    let report: Value = serde_json::from_slice(&std::fs::read(folder.report()).ok()?).ok()?;
    let mut found = BTreeSet::new();
    compare("", report.get("scene")?, &serde_json::to_value(scene).ok()?, &mut found);
    Some(found.into_iter().filter(|key| !is_free(key)).collect())
}

fn is_free(key: &str) -> bool {
    FREE.iter().any(|free| key == *free || key.strip_prefix(free).is_some_and(|rest| rest.starts_with('.')))
}

fn compare(key: &str, a: &Value, b: &Value, found: &mut BTreeSet<String>) {
    let (Value::Object(one), Value::Object(other)) = (a, b) else {
        if a != b {
            found.insert(key.to_owned());
        }
        return;
    };
    for name in one.keys().chain(other.keys()) {
        let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
        let of = |table: &serde_json::Map<String, Value>| table.get(name).cloned().unwrap_or_default();
        compare(&inner, &of(one), &of(other), found);
    }
}
