//! Splits a source in Rust or WGSL into code, comments and literals, line by line. Rules then never
//! mistake a string or a comment for code.

/// One source file.
pub struct Source {
    /// Path from the root.
    pub path: String,
    /// Its lines, in order.
    pub lines: Vec<Line>,
}

/// The parts of one line of a source.
#[derive(Debug, Default, PartialEq)]
pub struct Line {
    /// The code, without comments; string and character literals are empty.
    pub code: String,
    /// The comments, with their slashes.
    pub comment: String,
    /// The literals, with their quotes.
    pub literals: String,
}

impl Source {
    /// Splits a text. Text that is not Rust gives some split, but never a panic.
    pub fn parse(path: &str, text: &str) -> Self {
        let mut scanner = Scanner { rest: text, lines: vec![Line::default()] };
        while !scanner.rest.is_empty() {
            scanner.token();
        }
        if text.ends_with('\n') {
            scanner.lines.pop();
        }
        Self { path: path.to_owned(), lines: scanner.lines }
    }
}

struct Scanner<'a> {
    rest: &'a str,
    lines: Vec<Line>,
}

impl<'a> Scanner<'a> {
    fn take(&mut self, bytes: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(bytes);
        self.rest = rest;
        taken
    }

    fn line(&mut self) -> &mut Line {
        self.lines.last_mut().expect("starts with one line and only grows")
    }

    /// Calls `keep` with each piece of `text` between line breaks, and starts a line at each break.
    fn put(&mut self, text: &str, keep: fn(&mut Line, &str)) {
        for (number, piece) in text.split('\n').enumerate() {
            if number > 0 {
                self.lines.push(Line::default());
            }
            keep(self.line(), piece);
        }
    }

    fn token(&mut self) {
        let rest = self.rest;
        if rest.starts_with("//") {
            let text = self.take(rest.find('\n').unwrap_or(rest.len()));
            self.put(text, |line, text| line.comment += text);
        } else if rest.starts_with("/*") {
            let text = self.take(block_comment(rest));
            self.put(text, |line, text| line.comment += text);
        } else if let Some(length) = literal(rest, self.line().code.chars().last()) {
            let text = self.take(length);
            self.line().code += "\"\"";
            self.put(text, |line, text| line.literals += text);
        } else {
            let length = rest.chars().next().map_or(1, char::len_utf8);
            let text = self.take(length);
            self.put(text, |line, text| line.code += text);
        }
    }
}

/// Length of the block comment at the start of `text`, with the comments inside it.
fn block_comment(text: &str) -> usize {
    let mut depth = 0_usize;
    let mut position = 0;
    while position < text.len() {
        let rest = &text.as_bytes()[position..];
        if rest.starts_with(b"/*") {
            depth += 1;
            position += 2;
        } else if rest.starts_with(b"*/") {
            depth -= 1;
            position += 2;
            if depth == 0 {
                return position;
            }
        } else {
            position += 1;
        }
    }
    text.len()
}

/// Length of the string or character literal at the start of `text`. A prefix such as `r#` counts
/// only where no identifier ends just before it.
fn literal(text: &str, before: Option<char>) -> Option<usize> {
    let in_word = before.is_some_and(|character| character.is_alphanumeric() || character == '_');
    let prefixes: &[&str] = if in_word { &[] } else { &["br", "cr", "b", "c", "r"] };
    let prefix =
        prefixes.iter().find(|&&prefix| quote_follows(text, prefix)).map_or(0, |prefix| prefix.len());
    let body = &text[prefix..];
    let raw = text[..prefix].ends_with('r');
    if raw {
        let hashes = body.bytes().take_while(|&byte| byte == b'#').count();
        let end = format!("\"{}", "#".repeat(hashes));
        let start = hashes + 1;
        return Some(
            prefix + body.get(start..)?.find(&end).map_or(body.len(), |found| start + found + end.len()),
        );
    }
    match body.as_bytes().first()? {
        b'"' => Some(prefix + escaped_until(body, b'"')),
        b'\'' => {
            let mut characters = body.char_indices().skip(1);
            let (_, first) = characters.next()?;
            let closes = characters.next().is_some_and(|(_, second)| second == '\'');
            (first == '\\' || closes).then(|| prefix + escaped_until(body, b'\''))
        }
        _ => None,
    }
}

fn quote_follows(text: &str, prefix: &str) -> bool {
    let Some(rest) = text.strip_prefix(prefix) else { return false };
    let rest = if prefix.ends_with('r') { rest.trim_start_matches('#') } else { rest };
    rest.starts_with('"') || (prefix == "b" && rest.starts_with('\''))
}

/// Length up to and including the unescaped `quote` after the first byte.
fn escaped_until(text: &str, quote: u8) -> usize {
    let mut escaped = false;
    for (position, byte) in text.bytes().enumerate().skip(1) {
        if escaped {
            escaped = false;
        } else if byte == b'\\' {
            escaped = true;
        } else if byte == quote {
            return position + 1;
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(text: &str) -> Vec<String> {
        Source::parse("x.rs", text).lines.into_iter().map(|line| line.code).collect()
    }

    #[test]
    fn strings_and_comments_are_not_code() {
        assert_eq!(
            code("let a = \"unsafe\"; // unsafe\nb(/* unsafe /* x */ */ c)"),
            ["let a = \"\"; ", "b( c)"]
        );
        assert_eq!(code(r##"f(r#"a "unsafe" b"#, b"x", "\"unsafe")"##), [r#"f("", "", "")"#]);
    }

    #[test]
    fn lines_are_counted_through_literals_and_comments() {
        assert_eq!(code("a(\"1\n2\");\n/* 3\n4 */ b\n"), ["a(\"\"", ");", "", " b"]);
    }

    #[test]
    fn a_lifetime_is_not_a_character() {
        assert_eq!(
            code("fn f<'a>(x: &'a str) { g('\"', '\\'', b'\"') } // c"),
            ["fn f<'a>(x: &'a str) { g(\"\", \"\", \"\") } "]
        );
    }

    #[test]
    fn comments_are_kept() {
        let lines = Source::parse("x.rs", "//! Title.\nlet a; // note").lines;
        assert_eq!(lines[0], Line { comment: "//! Title.".to_owned(), ..Line::default() });
        assert_eq!(lines[1].comment, "// note");
    }

    #[test]
    fn literals_are_kept() {
        let lines = Source::parse("x.rs", "f(\"a // b\", 'c'); // \"d\"\ng(r#\"e\nf\"#);").lines;
        assert_eq!(lines[0].literals, "\"a // b\"'c'");
        assert_eq!(lines[1].literals, "r#\"e");
        assert_eq!(lines[2].literals, "f\"#");
    }

    #[test]
    fn unfinished_text_ends() {
        for text in ["\"abc", "/* abc", "r#\"abc", "'", "b'", "'\\", "r#", "é\"é"] {
            Source::parse("x.rs", text);
        }
    }
}
