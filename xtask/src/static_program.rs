//! `cargo xtask static`: a program for Linux that needs no file of the system, tried in an empty
//! root folder.
//!
//! It has no feature `gpu`: a GPU needs Vulkan, whose driver is a shared library, and a static
//! program cannot load one.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::workspace::{Workspace, execute};

/// All features of the program that need no shared library.
const FEATURES: &str = "dicom,dicom-jpeg2000";
/// The type of the program header that names a dynamic loader.
const PT_INTERP: u32 = 3;

/// Builds the program, checks that it is static, and runs the demo in an empty root folder.
///
/// # Errors
/// The standard library for musl or the linker is missing, the program needs a loader, or the demo
/// fails.
pub fn run(workspace: &Workspace) -> Result<()> {
    if !cfg!(target_os = "linux") {
        bail!("`cargo xtask static` makes a program for Linux, and runs only there");
    }
    let target = target();
    require(workspace, &target)?;
    let folder = workspace.target_dir()?;
    let mut command = workspace.cargo("build");
    command.args(["--release", "--package", "cutis-cli", "--no-default-features", "--features", FEATURES]);
    execute(command.args(["--target", &target]))?;
    let built = folder.join(&target).join("release/cutis");
    let program = folder.join("static/cutis");
    fs::create_dir_all(folder.join("static")).context("static")?;
    // The tables for debuggers are five times as long as the program.
    execute(workspace.command("strip").args(["--strip-debug", "-o"]).arg(&program).arg(&built))?;
    let bytes = fs::read(&program).with_context(|| program.display().to_string())?;
    if needs_loader(&bytes)? {
        bail!("{} is not static: it names a dynamic loader", program.display());
    }
    try_in_empty_root(workspace, &program, &folder.join("empty-root"))?;
    println!("{} is static, {} bytes", program.display(), bytes.len());
    Ok(())
}

/// The target of this machine with musl as C library.
fn target() -> String {
    format!("{}-unknown-linux-musl", std::env::consts::ARCH)
}

/// Checks for the standard library of the target and for the linker.
fn require(workspace: &Workspace, target: &str) -> Result<()> {
    let output = workspace.command("rustc").args(["--print", "sysroot"]).output();
    let output = output.context("cannot start rustc")?;
    let sysroot = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    if !sysroot.join("lib/rustlib").join(target).join("lib").is_dir() {
        bail!("the standard library for {target} is missing; install it with `rustup target add {target}`");
    }
    require_program(workspace, "cc", "apt-get install -y gcc libc6-dev")?;
    require_program(workspace, "strip", "apt-get install -y binutils")?;
    require_program(workspace, "unshare", "apt-get install -y util-linux")
}

fn require_program(workspace: &Workspace, name: &str, install: &str) -> Result<()> {
    let found = workspace.command(name).arg("--version").output();
    if found.is_ok_and(|output| output.status.success()) {
        return Ok(());
    }
    bail!("`{name}` is missing; on Debian, `{install}`")
}

/// Whether an ELF program names a dynamic loader. The kernel starts a program without one directly.
fn needs_loader(elf: &[u8]) -> Result<bool> {
    let number = |at: usize, size: usize| -> Result<u64> {
        let bytes = elf.get(at..at + size).context("the program ends within its headers")?;
        Ok(bytes.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte)))
    };
    if elf.get(..6) != Some(b"\x7fELF\x02\x01") {
        bail!("the program is not a little-endian ELF file of 64 bits");
    }
    let (start, size, count) = (number(32, 8)? as usize, number(54, 2)? as usize, number(56, 2)? as usize);
    for header in 0..count {
        if number(start + header * size, 4)? == u64::from(PT_INTERP) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Runs the demo in a root folder with nothing but the program, and reads its report.
fn try_in_empty_root(workspace: &Workspace, program: &Path, root: &Path) -> Result<()> {
    if root.exists() {
        fs::remove_dir_all(root).with_context(|| root.display().to_string())?;
    }
    fs::create_dir_all(root).with_context(|| root.display().to_string())?;
    fs::copy(program, root.join("cutis")).context("cannot copy the program")?;
    let mut command = workspace.command("unshare");
    command.arg("--map-root-user").arg(format!("--root={}", root.display()));
    execute(command.args(["/cutis", "demo", "--out", "/demo"])).context(
        "the program did not run in an empty root folder; if the message is of `unshare`, this system \
         does not let its users have a root folder: run the command as root",
    )?;
    let report = fs::read(root.join("demo/report.html")).context("the demo wrote no report")?;
    println!("in an empty root folder the demo wrote a report of {} bytes", report.len());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ELF file with two program headers of these types.
    fn elf(types: [u32; 2]) -> Vec<u8> {
        let mut bytes = vec![0; 64];
        bytes[..6].copy_from_slice(b"\x7fELF\x02\x01");
        bytes[32] = 64;
        bytes[54] = 56;
        bytes[56] = 2;
        for kind in types {
            bytes.extend(kind.to_le_bytes());
            bytes.extend([0; 52]);
        }
        bytes
    }

    #[test]
    fn a_program_with_a_loader_is_not_static() {
        assert!(!needs_loader(&elf([1, 2])).unwrap());
        assert!(needs_loader(&elf([1, PT_INTERP])).unwrap());
        assert!(needs_loader(&elf([1, 2])[..100]).is_err());
        assert!(needs_loader(b"#!/bin/sh").is_err());
    }

    #[test]
    fn the_program_of_a_usual_build_has_a_loader() {
        let this = std::env::current_exe().unwrap();
        if cfg!(all(target_os = "linux", target_env = "gnu")) {
            assert!(needs_loader(&fs::read(this).unwrap()).unwrap());
        }
    }

    #[test]
    fn a_missing_target_is_an_error_with_the_command_that_installs_it() {
        let workspace = Workspace { root: ".".into(), ci: false };
        let error = require(&workspace, "no-such-target").unwrap_err().to_string();
        assert!(error.contains("rustup target add no-such-target"), "{error}");
        let error = require_program(&workspace, "no-such-linker", "apt-get install x").unwrap_err();
        assert!(error.to_string().contains("`no-such-linker` is missing; on Debian, `apt-get install x`"));
    }
}
