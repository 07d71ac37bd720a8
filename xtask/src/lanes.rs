//! Checks that the loops with SIMD lanes were inlined.
//!
//! The instructions of AVX2 and AVX-512 are functions of the standard library. They are inlined
//! only where everything between them and the function for the processor is inlined. A closure that
//! is called makes a loop several times slower and changes no result, so no other test sees it.

use anyhow::{Context, Result, bail, ensure};

use crate::workspace::Workspace;

/// The function in which the loops for AVX2 are compiled.
const LOOP: &str = "with_avx2";

/// Reads the names of all functions of the program `cutis`.
///
/// # Errors
/// The program or `nm` is missing, or an instruction is called as a function.
pub fn run(workspace: &Workspace) -> Result<()> {
    if !cfg!(target_arch = "x86_64") {
        println!("no lanes to check: this processor has no AVX");
        return Ok(());
    }
    let program = workspace.program()?;
    let output = workspace.command("nm").arg(&program).output().context("cannot start `nm` of binutils")?;
    ensure!(output.status.success(), "`nm {}` ended with {}", program.display(), output.status);
    let names = String::from_utf8_lossy(&output.stdout);
    ensure!(names.contains(LOOP), "{} has no function `{LOOP}`", program.display());
    let calls = instructions(&names);
    if !calls.is_empty() {
        bail!(
            "{} instructions are called as functions in {}:\n{}\nA closure or a function without \
             `#[inline(always)]` is between them and `{LOOP}`. Find it with `objdump -d -C` and \
             `addr2line -i`",
            calls.len(),
            program.display(),
            calls.join("\n")
        );
    }
    println!("{}: every instruction for 8 and 16 lanes is inlined", program.display());
    Ok(())
}

/// The lines of `nm` that name a function for one instruction on 8 or 16 lanes.
fn instructions(names: &str) -> Vec<&str> {
    let is_instruction =
        |line: &&str| line.contains("core_arch") && (line.contains("_mm256_") || line.contains("_mm512_"));
    names.lines().filter(is_instruction).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_for_wide_instructions_are_found() {
        let names = "\
            0000 t _ZN17cutis_constraints5lanes5level9with_avx217h00E\n\
            0010 t _ZN4core9core_arch3x863avx13_mm256_mul_ps17h00E\n\
            0020 t _ZN4core9core_arch3x867avx512f13_mm512_mul_ps17h00E\n\
            0030 t _ZN4core9core_arch3x865xsave7_xgetbv17h00E\n\
            0040 t _ZN4core9core_arch3x865ssse316_mm_shuffle_epi817h00E\n";
        let found = instructions(names);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].contains("_mm256_mul_ps") && found[1].contains("_mm512_mul_ps"));
    }
}
