//! The words that prose and names avoid: reads `xtask/words.toml` and finds them in texts.

use anyhow::{Context, Result, bail};

use super::Finding;
use super::rules;
use super::text::{Part, Text};

/// Path of the table from the root of the checkout.
pub const TABLE: &str = "xtask/words.toml";

/// One entry of the table.
struct Entry {
    phrases: Vec<Vec<String>>,
    instead: String,
    /// The only kind of text to which the entry applies.
    only: Option<Part>,
    /// Paths in which the words are allowed.
    except: Vec<String>,
}

/// The table.
pub struct Words(Vec<Entry>);

impl Words {
    /// # Errors
    /// The text is not TOML, or an entry is incomplete. An exception needs a reason.
    pub fn parse(text: &str) -> Result<Self> {
        let table: toml::Table = text.parse().context("the table of words is not TOML")?;
        let entries = table.get("word").and_then(toml::Value::as_array).context("there is no list `word`")?;
        entries.iter().map(entry).collect::<Result<_>>().map(Self)
    }

    /// Every word to avoid in `text`.
    pub fn check(&self, text: &Text) -> Vec<Finding> {
        let holds = |entry: &&Entry| !entry.except.iter().any(|path| text.path.starts_with(path));
        let entries: Vec<&Entry> = self.0.iter().filter(holds).collect();
        let mut findings = Vec::new();
        for piece in &text.pieces {
            let texts: Vec<Vec<String>> = match piece.part {
                Part::Name => rules::words(&piece.text).map(split).collect(),
                Part::Prose => vec![split(&piece.text)],
            };
            for entry in entries.iter().filter(|entry| entry.only.is_none_or(|only| only == piece.part)) {
                if let Some(phrase) =
                    entry.phrases.iter().find(|phrase| texts.iter().any(|words| contains(words, phrase)))
                {
                    let message = format!("avoid `{}`; write: {}", phrase.join(" "), entry.instead);
                    findings.push(Finding::failure(text.path, piece.line, message));
                }
            }
        }
        findings
    }
}

fn entry(value: &toml::Value) -> Result<Entry> {
    let list = |key: &str| value.get(key).and_then(toml::Value::as_array).map_or(&[][..], Vec::as_slice);
    let phrases: Vec<Vec<String>> = list("avoid")
        .iter()
        .filter_map(|phrase| Some(phrase.as_str()?.split_whitespace().map(str::to_owned).collect()))
        .collect();
    if phrases.is_empty() || phrases.iter().any(Vec::is_empty) {
        bail!("an entry has no words in `avoid`: {value}");
    }
    let instead = value.get("use").and_then(toml::Value::as_str);
    let only = match value.get("only").map(|only| only.as_str()) {
        None => None,
        Some(Some("prose")) => Some(Part::Prose),
        Some(Some("names")) => Some(Part::Name),
        Some(_) => bail!("`only` is neither \"prose\" nor \"names\": {value}"),
    };
    let mut except = Vec::new();
    for exception in list("except") {
        let text =
            |key: &str| exception.get(key).and_then(toml::Value::as_str).filter(|text| !text.is_empty());
        match (text("path"), text("reason")) {
            (Some(path), Some(_)) => except.push(path.to_owned()),
            _ => bail!("an exception needs `path` and `reason`: {exception}"),
        }
    }
    Ok(Entry { phrases, instead: instead.context("an entry has no `use`")?.to_owned(), only, except })
}

/// The words of a text in lower case. `snake_case` and `CamelCase` are split.
fn split(text: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut previous = ' ';
    for character in text.chars() {
        let starts = character.is_uppercase() && previous.is_lowercase();
        if (!character.is_alphabetic() || starts) && words.last().is_some_and(|word| !word.is_empty()) {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut().filter(|_| character.is_alphabetic()) {
            word.extend(character.to_lowercase());
        }
        previous = character;
    }
    words
}

fn contains(words: &[String], phrase: &[String]) -> bool {
    let fits = |window: &[String]| window.iter().zip(phrase).all(|(word, pattern)| fits(word, pattern));
    words.windows(phrase.len()).any(fits)
}

/// Whether a word fits a pattern with an optional `*` at its start or end.
fn fits(word: &str, pattern: &str) -> bool {
    match (pattern.strip_prefix('*'), pattern.strip_suffix('*')) {
        (Some(end), _) => word.ends_with(end),
        (_, Some(start)) => word.starts_with(start),
        _ => word == pattern,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORDS: &str = r#"
        [[word]]
        avoid = ["is sent", "mammal"]
        use = "arrives"
        [[word]]
        avoid = ["gem*", "*stone"]
        use = "rock"
        except = [{ path = "docs/book/", reason = "a title" }]
        [[word]]
        avoid = ["road"]
        use = "path"
        only = "names"
    "#;

    fn lines(path: &str, text: &str) -> Vec<usize> {
        let words = Words::parse(WORDS).unwrap();
        words.check(&Text::parse(path, text)).iter().map(|finding| finding.line).collect()
    }

    const NONE: [usize; 0] = [];

    #[test]
    fn words_are_found_in_comments_names_and_messages() {
        let text = "//! Gems.\n\nfn what_is_sent() {\n    let a = \"for a mammal\";\n    let b = LimestoneKind; // Mammal.\n}\n";
        assert_eq!(lines("a.rs", text), [1, 3, 4, 5, 5]);
        assert_eq!(lines("a.md", "Mammal\nis sent.\n"), [1, 2]);
        assert_eq!(lines("a.py", "# Mammal\ngem = 1\n"), [1, 2]);
        assert_eq!(lines("a.wgsl", "// Mammal\nlet gem = 1;\n"), [1, 2]);
    }

    #[test]
    fn other_words_code_in_backticks_and_links_pass() {
        assert_eq!(lines("a.rs", "//! This sends mammals. Stones.\nfn this_is(sent: bool) {}\n"), NONE);
        assert_eq!(lines("a.rs", "//! Reads `gem` from <https://x.org/gem>.\n"), NONE);
        assert_eq!(lines("a.md", "[Rock](gems.md), `gem`, https://gem.org.\n```\ngem\n```\n"), NONE);
    }

    #[test]
    fn an_entry_may_hold_for_names_only() {
        assert_eq!(lines("a.rs", "// A wide road.\nmod road;\n"), [2]);
        assert_eq!(lines("a.md", "A wide road.\n"), NONE);
    }

    #[test]
    fn an_exception_holds_for_its_path_only() {
        assert_eq!(lines("docs/book/a.md", "Gems, for a mammal.\n"), [1]);
        assert_eq!(lines("docs/a.md", "Gems.\n"), [1]);
    }

    #[test]
    fn incomplete_tables_are_errors() {
        for text in [
            "",
            "[[word]]\nuse = \"a\"",
            "[[word]]\navoid = [\"a\"]",
            "[[word]]\navoid = [\"a\"]\nuse = \"b\"\nonly = \"code\"",
            "[[word]]\navoid = [\"a\"]\nuse = \"b\"\nexcept = [{ path = \"x\" }]",
            "[[word]]\navoid = [\"a\"]\nuse = \"b\"\nexcept = [{ path = \"x\", reason = \"\" }]",
        ] {
            assert!(Words::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_table_of_the_checkout_is_complete() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(TABLE);
        Words::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
    }
}
