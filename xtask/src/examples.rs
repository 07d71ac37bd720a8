//! Builds and runs every example of the workspace, found by cargo, so that new examples run without
//! further edits.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::vulkan;
use crate::workspace::{Workspace, execute};

/// Runs each example without arguments. `cargo build --workspace` reuses what the step `tests`
/// built; `cargo run --package` would build the dependencies again with other features.
pub fn run(workspace: &Workspace) -> Result<()> {
    let mut command = workspace.cargo("build");
    command.args(["--workspace", "--examples", "--message-format", "json-render-diagnostics"]);
    let output = command.stderr(std::process::Stdio::inherit()).output().context("cannot start cargo")?;
    if !output.status.success() {
        bail!("the examples do not compile");
    }
    let programs = programs(&String::from_utf8_lossy(&output.stdout))?;
    // Examples may write files to the current folder, which must not be the checkout.
    let folder = workspace.target_dir()?.join("examples-output");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    for (name, program) in &programs {
        let start = Instant::now();
        execute(vulkan::for_gpu_tests(Command::new(program).current_dir(&folder)))?;
        println!("example {name} took {:.1} s", start.elapsed().as_secs_f64());
    }
    println!("{} examples ran", programs.len());
    Ok(())
}

/// Name and program of every example among the messages of `cargo build`.
///
/// # Errors
/// Two examples have the same name: cargo writes both to the same file.
fn programs(messages: &str) -> Result<BTreeMap<String, PathBuf>> {
    let mut programs = BTreeMap::new();
    for line in messages.lines() {
        let message: Value = serde_json::from_str(line).context("cargo printed a line that is not JSON")?;
        let is_example =
            message["target"]["kind"].as_array().is_some_and(|kinds| kinds.contains(&"example".into()));
        if let Some(program) = message["executable"].as_str().filter(|_| is_example) {
            let name = message["target"]["name"].as_str().context("an example without a name")?;
            if programs.insert(name.to_owned(), PathBuf::from(program)).is_some() {
                bail!("two examples have the name `{name}`: rename one");
            }
        }
    }
    Ok(programs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn artifact(kind: &str, name: &str) -> String {
        format!(
            r#"{{"reason":"compiler-artifact","target":{{"kind":["{kind}"],"name":"{name}"}},"executable":"/t/{name}"}}"#
        )
    }

    #[test]
    fn only_examples_are_found() {
        let library =
            r#"{"reason":"compiler-artifact","target":{"kind":["lib"],"name":"a"},"executable":null}"#;
        let messages = [artifact("example", "cut"), artifact("bin", "cutis"), library.to_owned()].join("\n");
        let found = programs(&messages).unwrap();
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [("cut".to_owned(), PathBuf::from("/t/cut"))]);
    }

    #[test]
    fn two_examples_of_one_name_are_an_error() {
        let twice = [artifact("example", "cut"), artifact("example", "cut")].join("\n");
        assert!(programs(&twice).unwrap_err().to_string().contains("`cut`"));
        assert!(programs("not JSON").is_err());
    }
}
