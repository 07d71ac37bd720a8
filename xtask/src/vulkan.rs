//! The Vulkan device that GPU tests need: finds one, or says what to install, and sets the
//! variables of the tests.

use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::python::PYTHON;
use crate::workspace::Workspace;

/// Lists the devices of the Vulkan loader. It is a file of its own because `.ci/run` runs it too.
const LIST_DEVICES: &str = "xtask/vulkan.py";

/// Variables by which a user names the drivers that the loader may use.
const DRIVERS_NAMED_BY: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

/// Variables of GPU tests, unless the user has set them.
const DEFAULTS: [(&str, &str); 2] = [
    // lavapipe then works on the calling thread: a dispatch costs 1 µs instead of 35 µs, and tests
    // make many small ones.
    ("LP_NUM_THREADS", "0"),
    // Switches off Mesa's layer that selects a device. Without a display it prints a message for
    // each instance.
    ("NODEVICE_SELECT", "1"),
];

/// Makes GPU tests fail instead of being skipped where they find no adapter. `CI` has the same
/// effect.
const REQUIRE_GPU: &str = "CUTIS_REQUIRE_GPU";

/// Sets the variables of GPU tests, which then may not be skipped.
pub fn for_gpu_tests(command: &mut Command) -> &mut Command {
    for (name, value) in DEFAULTS {
        if std::env::var_os(name).is_none() {
            command.env(name, value);
        }
    }
    command.env(REQUIRE_GPU, "1")
}

/// The names of the adapters for GPU tests.
///
/// # Errors
/// Vulkan has no device. The error says what to install.
pub fn require(workspace: &Workspace) -> Result<String> {
    if cfg!(any(target_os = "macos", target_os = "windows")) {
        return Ok("the system's own GPU interface".to_owned());
    }
    let output = for_gpu_tests(workspace.command(PYTHON).arg(LIST_DEVICES))
        .output()
        .with_context(|| format!("cannot start {PYTHON}"))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).trim().replace('\n', ", "));
    }
    // The last line is the program's own message; drivers and the loader may have printed others.
    let messages = String::from_utf8_lossy(&output.stderr);
    let reason = messages.trim().lines().next_back().unwrap_or("the devices cannot be listed");
    let named_by = DRIVERS_NAMED_BY.into_iter().find(|name| std::env::var_os(name).is_some());
    bail!(remedy(reason, named_by))
}

/// Advice for a machine without an adapter. `named_by` is the variable that names the drivers.
fn remedy(reason: &str, named_by: Option<&str>) -> String {
    match named_by {
        Some(variable) => format!(
            "GPU tests need an adapter: {reason}. The loader only uses the drivers that {variable} names; \
             correct or unset it"
        ),
        None => format!(
            "GPU tests need an adapter: {reason}. A software driver is sufficient; install Mesa's. On Debian: \
             apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers; on Fedora: dnf install \
             vulkan-loader mesa-vulkan-drivers; on Arch: pacman -S vulkan-icd-loader vulkan-swrast"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_says_what_to_install() {
        let message = remedy("no loader", None);
        for text in ["no loader", "libvulkan1", "mesa-vulkan-drivers"] {
            assert!(message.contains(text), "{message}");
        }
    }

    #[test]
    fn a_variable_that_names_the_drivers_is_reported() {
        assert!(remedy("no driver", Some("VK_DRIVER_FILES")).contains("VK_DRIVER_FILES"));
    }

    #[test]
    fn drivers_that_do_not_exist_give_no_device() {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
        let output = Command::new(PYTHON)
            .current_dir(root)
            .arg(LIST_DEVICES)
            .env("VK_DRIVER_FILES", "/nowhere.json")
            .env("VK_ICD_FILENAMES", "/nowhere.json")
            .output()
            .unwrap();
        let reason = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{reason}");
        assert!(reason.contains("Vulkan loader"), "{reason}");
    }

    #[test]
    fn gpu_tests_may_not_be_skipped() {
        let mut command = Command::new("true");
        let set: Vec<_> = for_gpu_tests(&mut command).get_envs().collect();
        assert!(set.contains(&(REQUIRE_GPU.as_ref(), Some("1".as_ref()))), "{set:?}");
    }
}
