//! Rules about pages: required pages exist, links and named paths exist, the page of the
//! architecture names every crate, and no example is ignored.

use super::Finding;
use super::files::Files;
use super::rules::is_ignored_fence;

/// A word in backticks with one of these endings is a file of the repository.
const FILE_ENDINGS: [&str; 6] = [".rs", ".md", ".toml", ".py", ".wgsl", ".sh"];

/// The page that describes the workspace.
pub const ARCHITECTURE: &str = "docs/ARCHITECTURE.md";

/// Files that every checkout must have.
const REQUIRED: [&str; 6] =
    ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE-MIT", "LICENSE-APACHE", ARCHITECTURE];

/// Finds required files that are missing.
pub fn required(files: &Files) -> Vec<Finding> {
    REQUIRED
        .iter()
        .filter(|path| !files.exists(path))
        .map(|path| Finding::failure(path, 0, "is missing"))
        .collect()
}

/// Finds crates of the workspace that the page does not name.
pub fn crates_named<'a>(page: &str, text: &str, names: impl Iterator<Item = &'a str>) -> Vec<Finding> {
    let in_name = |character: char| character.is_ascii_alphanumeric() || "-_".contains(character);
    let words: std::collections::BTreeSet<&str> = text.split(|character| !in_name(character)).collect();
    names
        .filter(|name| !words.contains(name))
        .map(|name| Finding::failure(page, 0, format!("does not name the crate `{name}`")))
        .collect()
}

/// Finds relative links and pictures whose target does not exist.
pub fn links(page: &str, text: &str, files: &Files) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, line) in prose(text) {
        for target in link_targets(&without_code(line)) {
            let path = target.split('#').next().unwrap_or_default();
            if path.is_empty() || target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            match resolve(page, path) {
                Some(path) if files.exists(&path) => {}
                _ => findings.push(Finding::failure(
                    page,
                    number,
                    format!("the target of the link `{target}` does not exist"),
                )),
            }
        }
    }
    findings
}

/// Finds words in backticks that look like a path of the repository but do not exist.
pub fn named_paths(page: &str, text: &str, files: &Files) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (number, line) in prose(text) {
        for name in line.split('`').skip(1).step_by(2).filter(|name| looks_like_path(name, files)) {
            let found = if name.contains('/') { files.exists(name) } else { files.has_name(name) };
            if !found {
                findings.push(Finding::failure(page, number, format!("`{name}` does not exist")));
            }
        }
    }
    findings
}

/// Finds code blocks that doctests skip.
pub fn ignored_examples(page: &str, text: &str) -> Vec<Finding> {
    let ignored = text.lines().enumerate().filter(|(_, line)| is_ignored_fence(line.trim_start()));
    ignored
        .map(|(index, _)| Finding::failure(page, index + 1, "an example is ignored: make it compile"))
        .collect()
}

/// The page that lists the chapters of the book.
const SUMMARY: &str = "docs/SUMMARY.md";

/// Finds pages of `docs` that the list of chapters lacks.
pub fn in_summary(files: &Files, summary: &str) -> Vec<Finding> {
    let listed: Vec<String> =
        summary.lines().flat_map(link_targets).filter_map(|target| resolve(SUMMARY, &target)).collect();
    let pages = files.with_extension("md").filter(|path| path.starts_with("docs/") && *path != SUMMARY);
    let missing = pages.filter(|page| !listed.iter().any(|listed| listed == page));
    missing.map(|page| Finding::failure(page, 0, format!("is not in {SUMMARY}"))).collect()
}

/// Lines outside code blocks, numbered from 1.
fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut in_code = false;
    text.lines().enumerate().filter_map(move |(index, line)| {
        let fence = line.trim_start().starts_with("```");
        in_code ^= fence;
        (!in_code && !fence).then_some((index + 1, line))
    })
}

/// The line without the text in backticks.
fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect::<Vec<_>>().join("``")
}

/// Targets of `[text](target)`, `![alt](target)`, `[label]: target` and `src="target"`.
pub fn link_targets(line: &str) -> Vec<String> {
    let mut targets = Vec::new();
    for (open, close) in [("](", ')'), ("src=\"", '"'), ("href=\"", '"')] {
        for piece in line.split(open).skip(1) {
            let target = piece.split(close).next().unwrap_or_default();
            targets.extend(
                target.split_whitespace().next().map(|target| target.trim_matches(['<', '>']).to_owned()),
            );
        }
    }
    if let Some((label, target)) = line.split_once("]: ")
        && label.starts_with('[')
    {
        targets.extend(target.split_whitespace().next().map(str::to_owned));
    }
    targets
}

/// The path from the root of a link on `page`. `None` if it leaves the repository.
pub fn resolve(page: &str, link: &str) -> Option<String> {
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in link.trim_end_matches('/').split('/') {
        match part {
            "." | "" => {}
            ".." => {
                parts.pop()?;
            }
            name => parts.push(name),
        }
    }
    Some(parts.join("/"))
}

/// True for `crates/cutis/src/lib.rs`, `docs/book/` and `deny.toml`. False for `f32/f64`,
/// `cutis run SCENE` and `a::b`.
fn looks_like_path(name: &str, files: &Files) -> bool {
    let plain = |character: char| character.is_ascii_alphanumeric() || "._-/".contains(character);
    if name.is_empty() || !name.chars().all(plain) || name.starts_with('/') {
        return false;
    }
    let is_file = FILE_ENDINGS.iter().any(|ending| name.len() > ending.len() && name.ends_with(ending));
    let top = name.split('/').next().unwrap_or_default();
    is_file || (name.contains('/') && (name.ends_with('/') || files.exists(&format!("{top}/"))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files() -> Files {
        Files::of(&[
            "README.md",
            "docs/ARCHITECTURE.md",
            "docs/book/theory.md",
            "crates/cutis/src/lib.rs",
            "deny.toml",
        ])
    }

    #[test]
    fn missing_files_are_caught() {
        let missing: Vec<String> = required(&files()).into_iter().map(|finding| finding.place).collect();
        assert_eq!(missing, ["CHANGELOG.md", "CONTRIBUTING.md", "LICENSE-MIT", "LICENSE-APACHE"]);
    }

    #[test]
    fn crates_without_a_place_are_caught() {
        let findings = crates_named(
            "a.md",
            "`cutis-mesh` and cutis-solver-cpu.\n",
            ["cutis-mesh", "cutis-solver"].into_iter(),
        );
        assert_eq!(findings.len(), 1);
        assert!(findings[0].message.contains("`cutis-solver`"));
    }

    #[test]
    fn links_that_resolve_pass() {
        let page = "[a](../ARCHITECTURE.md#layers) [b](https://x.org/y) [c](#here) ![d](./theory.md \"title\")\n\
                    [root](../..)\n[label]: ../../README.md\n<img src=\"../../deny.toml\">\n";
        assert_eq!(links("docs/book/theory.md", page, &files()), []);
    }

    #[test]
    fn dead_links_are_caught() {
        let page = "[a](gone.md)\n![b](../gone.png)\n[c](../../../README.md)\n[label]: gone.md\n<img src=\"gone.png\">\n";
        assert_eq!(links("docs/book/theory.md", page, &files()).len(), 5);
    }

    #[test]
    fn links_in_code_are_no_links() {
        assert_eq!(links("README.md", "```\n[a](gone.md)\n```\n`x[0](gone)`\n", &files()), []);
    }

    #[test]
    fn named_paths_must_exist() {
        let check = |text: &str| named_paths("docs/ARCHITECTURE.md", text, &files()).len();
        assert_eq!(check("`crates/cutis/src/lib.rs` `docs/book/` `lib.rs` `deny.toml`\n"), 0);
        assert_eq!(check("`f32/f64` `N/m` `cutis run SCENE` `a::b` `report.json` `.rs`\n"), 0);
        assert_eq!(
            check(
                "`crates/cutis/src/gone.rs`\n`docs/gone/`\n`docs/gone`\n`gone.rs`\n`shaders/wgsl/x.wgsl`\n"
            ),
            5
        );
    }

    #[test]
    fn pages_outside_the_book_are_caught() {
        let found =
            |summary: &str| in_summary(&files(), summary).into_iter().map(|f| f.place).collect::<Vec<_>>();
        assert_eq!(found("- [a](ARCHITECTURE.md)\n  - [b](book/theory.md)\n"), [""; 0]);
        assert_eq!(found("- [a](ARCHITECTURE.md)\n"), ["docs/book/theory.md"]);
    }

    #[test]
    fn ignored_examples_are_caught() {
        assert_eq!(ignored_examples("a.md", "```rust,ignore\nx\n```\n").len(), 1);
        assert_eq!(ignored_examples("a.md", "```toml\nx = 1\n```\n").len(), 0);
    }
}
