//! Rules about one source file.

use super::Finding;
use super::source::{Line, Source};
use crate::unsafe_files;

/// Every rule about sources.
pub const ALL: &[fn(&Source) -> Vec<Finding>] =
    &[begins_with_title, unsafe_is_listed_and_explained, no_leftovers, nothing_ignored, not_too_long];

/// A longer file gives a warning.
const LONG: usize = 400;
/// A longer file gives a failure.
const TOO_LONG: usize = 600;

/// The first line of a file says, after `//! `, what the file does.
fn begins_with_title(source: &Source) -> Vec<Finding> {
    let first = source.lines.first();
    if first.is_some_and(|line| {
        line.code.is_empty() && line.comment.len() > 4 && line.comment.starts_with("//! ")
    }) {
        return Vec::new();
    }
    vec![Finding::failure(
        &source.path,
        1,
        "the first line of a source is `//! ` and says what the file does",
    )]
}

/// Only listed files have `unsafe`, and a comment above each block and each `impl` says why it is
/// sound. Clippy checks the documentation of each `unsafe fn`.
fn unsafe_is_listed_and_explained(source: &Source) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (index, line) in source.lines.iter().enumerate() {
        if !has_word(&line.code, "unsafe") {
            continue;
        }
        if !unsafe_files::is_allowed(&source.path) {
            findings.push(Finding::failure(
                &source.path,
                index + 1,
                "`unsafe` outside the files that may hold it",
            ));
        }
        let promises = positions(&line.code, "unsafe").any(|end| !has_word_first(&line.code[end..], "fn"));
        if promises && !explained(&source.lines[..=index]) {
            findings.push(Finding::failure(
                &source.path,
                index + 1,
                "`unsafe` without `// SAFETY:` above it",
            ));
        }
    }
    findings
}

/// Whether the statement of the last line has a safety comment in it or directly above it.
fn explained(lines: &[Line]) -> bool {
    let Some((last, above)) = lines.split_last() else { return false };
    let explains = |line: &Line| line.comment.contains("SAFETY:");
    let belongs = |line: &&Line| {
        let code = line.code.trim_end();
        let blank = code.is_empty() && line.comment.is_empty();
        !blank && !code.ends_with([';', '}', '{', ','])
    };
    explains(last) || above.iter().rev().take_while(belongs).any(explains)
}

/// No markers for later work in comments, and no placeholders or debug prints in code.
pub fn no_leftovers(source: &Source) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (index, line) in source.lines.iter().enumerate() {
        for marker in ["TODO", "FIXME", "XXX"] {
            if has_word(&line.comment, marker) || has_word(&line.code, marker) {
                findings.push(Finding::failure(
                    &source.path,
                    index + 1,
                    format!("`{marker}`: do it or open an issue"),
                ));
            }
        }
        for name in ["todo", "unimplemented", "dbg"] {
            if positions(&line.code, name).any(|end| line.code[end..].starts_with('!')) {
                findings.push(Finding::failure(&source.path, index + 1, format!("`{name}!` is left over")));
            }
        }
    }
    findings
}

/// No test and no example is ignored.
fn nothing_ignored(source: &Source) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (index, line) in source.lines.iter().enumerate() {
        let code: String = line.code.split_whitespace().collect();
        if code.contains("#[ignore]") || code.contains("#[ignore=") {
            findings.push(Finding::failure(
                &source.path,
                index + 1,
                "a test is ignored: make it run or remove it",
            ));
        }
        if is_ignored_fence(line.comment.trim_start_matches(['/', '!', ' '])) {
            findings.push(Finding::failure(
                &source.path,
                index + 1,
                "an example is ignored: make it compile",
            ));
        }
    }
    findings
}

/// Whether a line opens a code block that doctests skip.
pub fn is_ignored_fence(line: &str) -> bool {
    line.strip_prefix("```")
        .is_some_and(|tags| tags.split([',', ' ', '{', '}']).any(|tag| tag.starts_with("ignore")))
}

/// Files that are too long for one idea.
pub fn not_too_long(source: &Source) -> Vec<Finding> {
    let count = source.lines.len();
    if count > TOO_LONG {
        vec![Finding::failure(&source.path, 0, format!("{count} lines, more than {TOO_LONG}: split it"))]
    } else if count > LONG {
        vec![Finding::warning(&source.path, 0, format!("{count} lines: is this one idea?"))]
    } else {
        Vec::new()
    }
}

fn has_word_first(text: &str, word: &str) -> bool {
    text.split_whitespace().next() == Some(word)
}

fn has_word(text: &str, word: &str) -> bool {
    positions(text, word).next().is_some()
}

/// The identifiers, keywords and numbers of a line.
pub fn words(code: &str) -> impl Iterator<Item = &str> {
    code.split(|character: char| !character.is_alphanumeric() && character != '_')
}

/// Whether a line calls a function of this name.
pub fn is_called(code: &str, name: &str) -> bool {
    positions(code, name).any(|end| code[end..].trim_start().starts_with('('))
}

/// Ends of the whole-word occurrences of `word`.
fn positions<'a>(text: &'a str, word: &'a str) -> impl Iterator<Item = usize> + 'a {
    let in_word = |character: char| character.is_alphanumeric() || character == '_';
    text.match_indices(word).map(move |(start, _)| (start, start + word.len())).filter_map(
        move |(start, end)| {
            let free = !text[..start].ends_with(in_word) && !text[end..].starts_with(in_word);
            free.then_some(end)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unsafe_files::UNSAFE_FILES;

    fn count(rule: fn(&Source) -> Vec<Finding>, path: &str, text: &str) -> usize {
        rule(&Source::parse(path, text)).len()
    }

    #[test]
    fn a_missing_title_is_caught() {
        assert_eq!(count(begins_with_title, "a.rs", "//! Title.\n"), 0);
        for text in ["", "// Title.\n", "\n//! Late.\n", "//! \n", "//!\n//! Second line.\n", "use a;\n"] {
            assert_eq!(count(begins_with_title, "a.rs", text), 1, "{text:?}");
        }
    }

    #[test]
    fn unlisted_unsafe_is_caught() {
        let text = "// SAFETY: indices of a color are disjoint.\nunsafe { f() }\n";
        assert_eq!(count(unsafe_is_listed_and_explained, UNSAFE_FILES[0].path, text), 0);
        assert_eq!(count(unsafe_is_listed_and_explained, "crates/cutis/src/lib.rs", text), 1);
        let harmless = "#![forbid(unsafe_code)] // unsafe\nlet a = \"unsafe\";\n";
        assert_eq!(count(unsafe_is_listed_and_explained, "crates/cutis/src/lib.rs", harmless), 0);
    }

    #[test]
    fn unexplained_unsafe_is_caught() {
        for (text, findings) in [
            ("unsafe { f() }\n", 1),
            ("// SAFETY: fine.\nlet a =\n    unsafe { f() };\n", 0),
            ("// SAFETY: passes on.\n#[allow(unsafe_code)]\nunsafe impl Sync for A {}\n", 0),
            ("unsafe impl Sync for A {}\n", 1),
            ("unsafe fn f(i: usize) {}\n", 0),
            ("// SAFETY: of another statement.\ng();\nunsafe { f() }\n", 1),
            ("// SAFETY: too far away.\n\nunsafe { f() }\n", 1),
        ] {
            assert_eq!(count(unsafe_is_listed_and_explained, UNSAFE_FILES[0].path, text), findings, "{text}");
        }
    }

    #[test]
    fn leftovers_are_caught() {
        for text in
            ["// TODO later\n", "/* FIXME */\n", "todo!()\n", "unimplemented!(\"x\")\n", "a(dbg!(b))\n"]
        {
            assert_eq!(count(no_leftovers, "a.rs", text), 1, "{text}");
        }
        assert_eq!(count(no_leftovers, "a.rs", "let todo = \"TODO\"; f(todo); // MASTODON\n"), 0);
    }

    #[test]
    fn ignored_tests_and_examples_are_caught() {
        for text in ["#[ignore]\n", "#[ignore = \"slow\"]\n", "/// ```ignore\n", "//! ```rust,ignore\n"] {
            assert_eq!(count(nothing_ignored, "a.rs", text), 1, "{text}");
        }
        assert_eq!(count(nothing_ignored, "a.rs", "/// ```text\nlet ignore = \"#[ignore]\";\n"), 0);
    }

    #[test]
    fn long_files_are_listed_and_longer_ones_fail() {
        let findings = |lines: usize| not_too_long(&Source::parse("a.rs", &"a\n".repeat(lines)));
        assert!(findings(LONG).is_empty());
        assert_eq!(findings(LONG + 1)[0].severity, super::super::Severity::Warning);
        assert_eq!(findings(TOO_LONG + 1)[0].severity, super::super::Severity::Failure);
    }
}
