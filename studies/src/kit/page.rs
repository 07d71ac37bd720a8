//! Pages of `docs/results`: prose written by hand, with tables between markers that a study
//! replaces.
//!
//! A marker is a line `<!-- table: NAME -->`; the table ends at the next line `<!-- end -->`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};

use super::{Failure, results};

const END: &str = "<!-- end -->";
/// Columns of a line of prose.
const WIDTH: usize = 100;

/// A page with its markers.
#[derive(Clone, Debug)]
pub struct Page {
    name: String,
    text: String,
}

impl Page {
    /// Opens `docs/results/NAME.md`.
    ///
    /// # Errors
    /// The page does not exist, or its markers are not exactly `tables`. A study opens its page
    /// before it measures, so that a wrong page costs no time.
    pub fn open<S: AsRef<str>>(name: &str, tables: &[S]) -> Result<Self, Failure> {
        let path = results().join(name).with_extension("md");
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let page = Self { name: name.into(), text };
        let mut wanted: Vec<&str> = tables.iter().map(AsRef::as_ref).collect();
        let mut found = page.tables();
        wanted.sort_unstable();
        found.sort_unstable();
        ensure!(found == wanted, "{}: has the tables {found:?}, needs {wanted:?}", path.display());
        wanted.iter().try_for_each(|table| page.range(table).map(drop))?;
        Ok(page)
    }

    /// Names of the tables in order.
    fn tables(&self) -> Vec<&str> {
        let markers = self.text.lines().filter_map(|line| line.strip_prefix("<!-- table: "));
        markers.filter_map(|rest| rest.strip_suffix(" -->")).collect()
    }

    /// Where the content of a table is.
    fn range(&self, table: &str) -> Result<std::ops::Range<usize>, Failure> {
        let marker = format!("<!-- table: {table} -->\n");
        let start = self.text.find(&marker).with_context(|| format!("{}: no {marker}", self.name))?;
        let start = start + marker.len();
        let length = self.text[start..].find(END);
        let length = length.with_context(|| format!("{}: no {END} after {marker}", self.name))?;
        ensure!(
            !self.text[start..start + length].contains("<!-- table:"),
            "{}: no {END} after {marker}",
            self.name
        );
        Ok(start..start + length)
    }

    /// Replaces the content of a table.
    ///
    /// # Errors
    /// The page has no such table.
    pub fn set(&mut self, table: &str, content: &str) -> Result<(), Failure> {
        let range = self.range(table)?;
        let lines: Vec<String> = content.trim().lines().map(wrapped).collect();
        self.text.replace_range(range, &format!("\n{}\n\n", lines.join("\n")));
        Ok(())
    }

    /// Writes the page into a folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, folder: &Path) -> Result<PathBuf, Failure> {
        fs::create_dir_all(folder)?;
        let path = folder.join(&self.name).with_extension("md");
        fs::write(&path, &self.text).with_context(|| path.display().to_string())?;
        eprintln!("written: {}", path.display());
        Ok(path)
    }
}

/// A line of prose, broken at spaces to at most 100 columns. A line of a table stays as it is.
fn wrapped(line: &str) -> String {
    if line.starts_with('|') {
        return line.into();
    }
    let mut text = String::new();
    let mut column = 0;
    for word in line.split_inclusive(' ') {
        let length = word.trim_end().chars().count();
        if column > 0 && column + length > WIDTH {
            text.truncate(text.trim_end().len());
            text.push('\n');
            column = 0;
        }
        text += word;
        column += word.chars().count();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Title\n\n<!-- table: a -->\nold\n<!-- end -->\n\nProse.\n\n\
                        <!-- table: b -->\n<!-- end -->\n";

    fn page(text: &str) -> Page {
        Page { name: "page".into(), text: text.into() }
    }

    #[test]
    fn only_the_text_between_the_markers_is_replaced() {
        let mut page = page(TEXT);
        page.set("a", "| new |\n").unwrap();
        page.set("b", "second").unwrap();
        let expected = TEXT.replace("old\n", "\n| new |\n\n").replace("b -->\n", "b -->\n\nsecond\n\n");
        assert_eq!(page.text, expected);
        assert_eq!(page.tables(), ["a", "b"]);
        let again = page.text.clone();
        page.set("a", "| new |").unwrap();
        assert_eq!(page.text, again, "a second run with the same figures changes nothing");
    }

    #[test]
    fn prose_is_wrapped_and_tables_are_not() {
        let table = format!("| {} |", "x ".repeat(80));
        assert_eq!(wrapped(&table), table);
        let text = wrapped(&"word ".repeat(41));
        assert_eq!(text.lines().map(|line| line.trim_end().len()).collect::<Vec<_>>(), [99, 99, 4]);
    }

    #[test]
    fn a_missing_or_open_marker_is_an_error() {
        assert!(page(TEXT).set("c", "").unwrap_err().to_string().contains("table: c"));
        let open = TEXT.replacen("<!-- end -->\n", "", 1);
        assert!(page(&open).set("a", "").is_err(), "the table would swallow the prose");
    }
}
