//! The Vulkan device that GPU tests need: finds one, installs Mesa's software driver where none is and that is possible,
//! and sets what the tests are told about it.

use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::python::PYTHON;
use crate::workspace::{Workspace, execute};

/// Asks the Vulkan loader for its devices. A file, since `.ci/run` asks the same.
const LIST_DEVICES: &str = "xtask/vulkan.py";

/// Debian's names of the loader and of Mesa's drivers, the software driver lavapipe among them.
const PACKAGES: [&str; 2] = ["libvulkan1", "mesa-vulkan-drivers"];

/// Variables by which a user names the drivers that the loader may use.
const DRIVERS_NAMED_BY: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

/// What the variables of a test say, unless the user has set them.
const DEFAULTS: [(&str, &str); 2] = [
    // lavapipe then works on the calling thread: a dispatch costs 1 µs instead of 35 µs, and tests make many small ones.
    ("LP_NUM_THREADS", "0"),
    // Mesa's layer that selects a device stays out; without a display it prints a message for each instance.
    ("NODEVICE_SELECT", "1"),
];

/// Set, it makes GPU tests fail where they find no adapter; otherwise they would be skipped. `CI` does the same.
const REQUIRE_GPU: &str = "CUTIS_REQUIRE_GPU";

/// Tells a command that it runs GPU tests and that they may not be skipped.
pub fn for_gpu_tests(command: &mut Command) -> &mut Command {
    for (name, value) in DEFAULTS {
        if std::env::var_os(name).is_none() {
            command.env(name, value);
        }
    }
    command.env(REQUIRE_GPU, "1")
}

/// The adapters for GPU tests, in words. Where Vulkan is what they use and it has no device, Mesa's software driver is
/// installed, or an error says what to install.
pub fn require(workspace: &Workspace) -> Result<String> {
    if cfg!(any(target_os = "macos", target_os = "windows")) {
        return Ok("the system's own GPU interface".to_owned());
    }
    let reason = match devices(workspace)? {
        Ok(names) => return Ok(names),
        Err(reason) => reason,
    };
    let named_by = DRIVERS_NAMED_BY.into_iter().find(|name| std::env::var_os(name).is_some());
    match remedy(&reason, named_by, apt_get(workspace)) {
        Remedy::Install(prefix) => {
            println!("no adapter for GPU tests: {reason}; installing {}", PACKAGES.join(" "));
            install(workspace, prefix)?;
        }
        Remedy::Tell(message) => bail!(message),
    }
    match devices(workspace)? {
        Ok(names) => Ok(names),
        Err(reason) => {
            bail!("GPU tests need an adapter. {} are installed, but {reason}", PACKAGES.join(" and "))
        }
    }
}

/// What to do about a machine without an adapter.
#[derive(Debug, PartialEq)]
enum Remedy {
    /// Run `apt-get`, with these words before it.
    Install(&'static [&'static str]),
    /// Nothing but telling the user.
    Tell(String),
}

/// The remedy, given why there is no adapter, which variable keeps the loader from looking for drivers itself, and the
/// words that run `apt-get` as root.
fn remedy(reason: &str, named_by: Option<&str>, apt_get: Option<&'static [&'static str]>) -> Remedy {
    match (named_by, apt_get) {
        (Some(variable), _) => Remedy::Tell(format!(
            "GPU tests need an adapter: {reason}. The drivers are those that {variable} names; correct or unset it"
        )),
        (None, Some(prefix)) => Remedy::Install(prefix),
        (None, None) => Remedy::Tell(format!(
            "GPU tests need an adapter, and {reason}. A software driver will do: install Mesa's; on Debian: \
             apt-get install -y --no-install-recommends {}; on Fedora: dnf install vulkan-loader mesa-vulkan-drivers; \
             on Arch: pacman -S vulkan-icd-loader vulkan-swrast",
            PACKAGES.join(" ")
        )),
    }
}

/// Names of the Vulkan devices, or why there is none.
fn devices(workspace: &Workspace) -> Result<Result<String, String>> {
    let output = for_gpu_tests(workspace.command(PYTHON).arg(LIST_DEVICES))
        .output()
        .with_context(|| format!("cannot start {PYTHON}"))?;
    if output.status.success() {
        let names = String::from_utf8_lossy(&output.stdout);
        return Ok(Ok(names.trim().replace('\n', ", ")));
    }
    // The program's own message is the last line; drivers and the loader may have printed others before.
    let messages = String::from_utf8_lossy(&output.stderr);
    let reason = messages.trim().lines().next_back().map(str::to_owned);
    Ok(Err(reason.unwrap_or_else(|| format!("listing the Vulkan devices ended with {}", output.status))))
}

/// The words before `apt-get` by which it runs as root without asking; none where there is no `apt-get` or no such way.
fn apt_get(workspace: &Workspace) -> Option<&'static [&'static str]> {
    let output = |words: &[&str]| {
        let output = workspace.command(words[0]).args(&words[1..]).output().ok()?;
        output.status.success().then_some(output.stdout)
    };
    output(&["apt-get", "--version"])?;
    if output(&["id", "-u"])?.trim_ascii() == b"0" {
        return Some(&[]);
    }
    output(&["sudo", "-n", "true"]).map(|_| ["sudo", "-n"].as_slice())
}

fn install(workspace: &Workspace, prefix: &[&str]) -> Result<()> {
    let as_root = |arguments: &[&str]| {
        let words = [prefix, &["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"], arguments].concat();
        execute(workspace.command(words[0]).args(&words[1..]))
    };
    // Lists that cannot be renewed, of one source of several perhaps, may still do: the installation decides.
    if let Err(error) = as_root(&["update", "-qq"]) {
        eprintln!("{error}");
    }
    as_root(&[["install", "-y", "-qq", "--no-install-recommends"].as_slice(), &PACKAGES].concat())
        .context("cannot install the software driver that GPU tests need")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_package_manager_the_message_says_what_to_install() {
        let Remedy::Tell(message) = remedy("no loader", None, None) else {
            panic!("nothing can be installed")
        };
        assert!(PACKAGES.iter().all(|package| message.contains(package)), "{message}");
        assert!(message.contains("no loader"), "{message}");
    }

    #[test]
    fn as_root_the_driver_is_installed() {
        assert_eq!(remedy("no loader", None, Some(&["sudo", "-n"])), Remedy::Install(&["sudo", "-n"]));
    }

    #[test]
    fn nothing_is_installed_when_a_variable_names_the_drivers() {
        let Remedy::Tell(message) = remedy("no driver", Some("VK_DRIVER_FILES"), Some(&[])) else {
            panic!("another driver would not be used")
        };
        assert!(message.contains("VK_DRIVER_FILES"), "{message}");
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
    fn gpu_tests_are_told_that_they_may_not_be_skipped() {
        let mut command = Command::new("true");
        let set: Vec<_> = for_gpu_tests(&mut command).get_envs().collect();
        assert!(set.contains(&(REQUIRE_GPU.as_ref(), Some("1".as_ref()))), "{set:?}");
    }
}
