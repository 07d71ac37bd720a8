//! Only one crate names wgpu. All other crates use a GPU through it.

use super::Finding;
use super::rules::words;
use super::source::Source;

/// The folder of the crate that may name wgpu.
const ONLY: &str = "crates/cutis-gpu/";

/// The manifest that states versions for all members.
const VERSIONS: &str = "Cargo.toml";

/// The start of the names of wgpu and of its parts.
const NAME: &str = "wgpu";

const MESSAGE: &str = "names wgpu, which only cutis-gpu may do: use that crate, or extend it";

/// Finds lines of code outside the crate that name wgpu.
pub fn in_source(source: &Source) -> Vec<Finding> {
    let lines = source.lines.iter().map(|line| line.code.as_str());
    named(&source.path, lines)
}

/// Finds lines of a manifest outside the crate that name wgpu: as a dependency, also under another
/// name, or as a feature of one. Comments and descriptions may name it.
pub fn in_manifest(path: &str, text: &str) -> Vec<Finding> {
    if path == VERSIONS {
        return Vec::new();
    }
    let lines = text.lines().map(|line| match line.split('#').next().unwrap_or_default() {
        words if words.trim_start().starts_with("description") => "",
        code => code,
    });
    named(path, lines)
}

fn named<'a>(path: &str, lines: impl Iterator<Item = &'a str>) -> Vec<Finding> {
    if path.starts_with(ONLY) {
        return Vec::new();
    }
    lines
        .enumerate()
        .filter(|(_, line)| words(line).any(|word| word.starts_with(NAME)))
        .map(|(index, _)| Finding::failure(path, index + 1, MESSAGE))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: [usize; 0] = [];

    fn in_rust(path: &str, text: &str) -> Vec<usize> {
        in_source(&Source::parse(path, text)).iter().map(|finding| finding.line).collect()
    }

    fn in_toml(path: &str, text: &str) -> Vec<usize> {
        in_manifest(path, text).iter().map(|finding| finding.line).collect()
    }

    #[test]
    fn code_outside_the_crate_that_names_it_is_caught() {
        let path = "crates/cutis-render/src/lib.rs";
        assert_eq!(
            in_rust(path, "//! Title.\nuse wgpu::Device;\nfn f(limits: wgpu_types::Limits) {}\n"),
            [2, 3]
        );
        assert_eq!(in_rust(path, "//! On top of wgpu.\nlet a = \"wgpu\"; let my_wgpu = a;\n"), NONE);
        assert_eq!(in_rust("crates/cutis-gpu/src/lib.rs", "use wgpu::Device;\n"), NONE);
    }

    #[test]
    fn manifests_outside_the_crate_that_name_it_are_caught() {
        let path = "crates/cutis-render/Cargo.toml";
        for line in [
            "wgpu.workspace = true",
            "wgpu-core = \"30\"",
            "gpu = { package = \"wgpu\", version = \"30\" }",
            "metal = [\"wgpu/metal\"]",
            "[dev-dependencies.wgpu]",
        ] {
            assert_eq!(in_toml(path, &format!("[dependencies]\n{line}\n")), [2], "{line}");
            assert_eq!(in_toml("crates/cutis-gpu/Cargo.toml", line), NONE);
        }
        let text =
            "[package]\ndescription = \"On wgpu\"\n[dependencies] # not wgpu\ncutis-gpu.workspace = true\n";
        assert_eq!(in_toml(path, text), NONE);
    }

    #[test]
    fn the_version_stands_in_the_manifest_of_the_workspace() {
        assert_eq!(in_toml("Cargo.toml", "wgpu = \"30\"\n"), NONE);
        assert_eq!(in_toml("tests/third-party/Cargo.toml", "wgpu = \"30\"\n"), [1]);
    }
}
