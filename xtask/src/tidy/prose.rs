//! Rules about the form of prose: the width of its lines, and doc comments that are not full
//! phrases.

use super::Finding;
use super::source::Source;

/// The width of prose in columns.
const WIDTH: usize = 100;

/// Starts of doc comments that do not say what the item is.
const FRAGMENTS: [&str; 3] = ["Of ", "That of ", "Those of "];

/// Comments of a source that are too wide. Comments behind code follow the width of code.
pub fn comment_width(source: &Source) -> Vec<Finding> {
    let is_comment = |code: &str| code.trim().is_empty();
    let lines = source.lines.iter();
    let lines = lines.map(|line| match is_comment(&line.code) && line.literals.is_empty() {
        true => format!("{}{}", line.code, line.comment),
        false => String::new(),
    });
    too_wide(&source.path, lines)
}

/// Lines of a page that are too wide.
pub fn page_width(path: &str, text: &str) -> Vec<Finding> {
    too_wide(path, text.lines().map(str::to_owned))
}

/// Comments and docstrings in Python that are too wide.
pub fn python_width(path: &str, text: &str) -> Vec<Finding> {
    let mut in_docstring = false;
    let lines = text.lines().map(|line| {
        let is_prose = in_docstring || line.trim_start().starts_with(['#', '"']);
        in_docstring ^= line.matches("\"\"\"").count() % 2 == 1;
        if is_prose { line.to_owned() } else { String::new() }
    });
    too_wide(path, lines)
}

/// Tables, code blocks, the targets of links and addresses may be wider.
fn too_wide(path: &str, lines: impl Iterator<Item = String>) -> Vec<Finding> {
    let mut in_code = false;
    let mut findings = Vec::new();
    for (index, line) in lines.enumerate() {
        let prose = line.trim_start_matches(['/', '!', ' ', '>']);
        let fence = prose.starts_with("```");
        in_code ^= fence;
        let width = without_addresses(&line).chars().count();
        if width > WIDTH && !in_code && !fence && !prose.starts_with(['|', '<']) {
            let message = format!("{width} columns; wrap prose at {WIDTH}");
            findings.push(Finding::failure(path, index + 1, message));
        }
    }
    findings
}

/// The line with empty link targets and without words that contain an address.
fn without_addresses(line: &str) -> String {
    let mut text = String::new();
    for (number, piece) in line.split("](").enumerate() {
        text += if number == 0 { piece } else { piece.split_once(')').map_or(piece, |(_, rest)| rest) };
    }
    text.split(' ').filter(|word| !word.contains("://")).collect::<Vec<_>>().join(" ")
}

/// Doc comments whose first line is a fragment.
pub fn fragments(source: &Source) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut in_doc = false;
    for (index, line) in source.lines.iter().enumerate() {
        let doc = line.comment.strip_prefix("///").or_else(|| line.comment.strip_prefix("//!"));
        let text = doc.unwrap_or_default().trim_start();
        if !in_doc && let Some(start) = FRAGMENTS.iter().find(|start| text.starts_with(**start)) {
            let message = format!("a doc comment says what the item is, in a full phrase, not \"{start}…\"");
            findings.push(Finding::failure(&source.path, index + 1, message));
        }
        in_doc = doc.is_some();
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: [usize; 0] = [];

    fn lines(findings: Vec<Finding>) -> Vec<usize> {
        findings.iter().map(|finding| finding.line).collect()
    }

    fn in_rust(text: &str) -> Vec<usize> {
        lines(comment_width(&Source::parse("a.rs", text)))
    }

    fn in_page(text: &str) -> Vec<usize> {
        lines(page_width("a.md", text))
    }

    #[test]
    fn wide_comments_and_pages_are_caught() {
        let long = "word ".repeat(20);
        assert_eq!(in_rust(&format!("//! Title.\n/// {long}\nfn f() {{\n    // {long}\n}}\n")), [2, 4]);
        assert_eq!(in_page(&format!("# Title\n\n{long}more\n")), [3]);
    }

    #[test]
    fn lines_up_to_the_width_pass() {
        assert_eq!(in_rust(&format!("// {}\n", "é".repeat(97))), NONE);
        assert_eq!(in_page(&format!("{}\n", "é".repeat(100))), NONE);
        assert_eq!(in_page(&format!("{}\n", "é".repeat(101))), [1]);
    }

    #[test]
    fn tables_code_links_and_addresses_may_be_wider() {
        let long = "x".repeat(120);
        assert_eq!(
            in_page(&format!("| {long} |\n```\n{long}\n```\n[a]({long}), see\n<https://{long}>\n")),
            NONE
        );
        assert_eq!(
            in_rust(&format!("/// | {long} |\n/// ```\n/// {long}\n/// ```\n// https://{long}\n")),
            NONE
        );
        assert_eq!(in_rust(&format!("let a = \"{long}\"; // {long}\n// \"{long}\n")), [2]);
    }

    #[test]
    fn comments_and_docstrings_in_python_are_caught() {
        let long = "word ".repeat(21);
        let text = format!("\"\"\"Title.\n\n{long}\n\"\"\"\n# {long}\nx = \"{long}\"\n");
        assert_eq!(lines(python_width("a.py", &text)), [3, 5]);
    }

    #[test]
    fn fragments_are_caught_at_the_start_of_a_doc_comment() {
        let found = |text: &str| lines(fragments(&Source::parse("a.rs", text)));
        assert_eq!(found("//! Of ChainMail.\n\n/// Those of a body.\nstruct A;\n"), [1, 3]);
        assert_eq!(
            found("/// Errors of a body\n/// Of this kind.\n// Of a part.\nlet a = \"/// Of\";\n"),
            NONE
        );
        assert_eq!(found("/// Offset in bytes.\n"), NONE);
    }
}
