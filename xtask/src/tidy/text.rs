//! The parts of a file that people read as language: prose in comments, messages and pages, and
//! names.

use super::source::Source;

/// What kind of text a piece is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    Prose,
    Name,
}

/// A piece of a line.
#[derive(Debug, PartialEq)]
pub struct Piece {
    /// Line from 1.
    pub line: usize,
    pub part: Part,
    pub text: String,
}

/// The pieces of a file, without code in backticks, code blocks and addresses.
pub struct Text<'a> {
    pub path: &'a str,
    pub pieces: Vec<Piece>,
}

impl<'a> Text<'a> {
    /// Takes the language from the ending of the path. Other languages than Rust and WGSL count as
    /// prose.
    pub fn parse(path: &'a str, text: &str) -> Self {
        let pieces = match path.rsplit('.').next() {
            Some("rs" | "wgsl") => of_source(&Source::parse(path, text)),
            _ => of_page(text.lines()),
        };
        Self { path, pieces }
    }
}

fn of_source(source: &Source) -> Vec<Piece> {
    let mut pieces = of_page(source.lines.iter().map(|line| line.comment.as_str()));
    for (index, line) in source.lines.iter().enumerate() {
        for (part, text) in [(Part::Name, &line.code), (Part::Prose, &line.literals)] {
            if !text.is_empty() {
                pieces.push(Piece { line: index + 1, part, text: text.clone() });
            }
        }
    }
    pieces.sort_by_key(|piece| piece.line);
    pieces
}

/// The prose of a page, or of the comments of a source, line by line.
fn of_page<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<Piece> {
    let mut in_code = false;
    let mut pieces = Vec::new();
    for (index, line) in lines.enumerate() {
        let fence = line.trim_start_matches(['/', '!', ' ']).starts_with("```");
        in_code ^= fence;
        if !in_code && !fence && !line.is_empty() {
            pieces.push(Piece { line: index + 1, part: Part::Prose, text: without_code(line) });
        }
    }
    pieces
}

/// The line without code in backticks, targets of links and addresses.
pub fn without_code(line: &str) -> String {
    let prose = line.split('`').step_by(2).collect::<Vec<_>>().join("``");
    let mut text = String::new();
    for (number, piece) in prose.split("](").enumerate() {
        text += if number == 0 { piece } else { piece.split_once(')').map_or("", |(_, rest)| rest) };
    }
    let words = text.split(' ').filter(|word| !word.contains("://"));
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(path: &str, text: &str) -> Vec<(usize, Part, String)> {
        Text::parse(path, text).pieces.into_iter().map(|piece| (piece.line, piece.part, piece.text)).collect()
    }

    #[test]
    fn a_source_has_prose_and_names() {
        let found = pieces("a.rs", "//! A title.\nlet a = f(\"b\"); // C `d` e.\n");
        let expected = [
            (1, Part::Prose, "//! A title."),
            (2, Part::Prose, "// C `` e."),
            (2, Part::Name, "let a = f(\"\"); "),
            (2, Part::Prose, "\"b\""),
        ];
        assert_eq!(found, expected.map(|(line, part, text)| (line, part, text.to_owned())));
    }

    #[test]
    fn code_blocks_are_not_prose() {
        let page = "A.\n```\nb\n```\nC.\n";
        let found = pieces("a.md", page).into_iter().map(|(line, ..)| line).collect::<Vec<_>>();
        assert_eq!(found, [1, 5]);
        let found = pieces("a.rs", "/// A.\n/// ```\n/// b\n/// ```\n/// C.\n");
        assert_eq!(found.len(), 2);
    }

    #[test]
    fn links_lose_their_target_and_addresses_go() {
        assert_eq!(without_code("See [a b](c.md \"d\"), <https://e.org/f> and `g`."), "See [a b, and ``.");
        assert_eq!(without_code("[a](b) and [c](d)"), "[a and [c");
    }
}
