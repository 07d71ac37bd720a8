//! Tables as Markdown and CSV, and the number formats of their cells.

use std::fmt::Write as _;

/// A result that is one line of a table.
pub trait Row {
    /// Column heads.
    const COLUMNS: &'static [&'static str];

    /// The cells, one for each column.
    fn cells(&self) -> Vec<String>;
}

/// Column heads and lines of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    columns: Vec<String>,
    lines: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new<S: ToString>(columns: impl IntoIterator<Item = S>) -> Self {
        Self { columns: columns.into_iter().map(|c| c.to_string()).collect(), lines: Vec::new() }
    }

    /// The table of `rows`.
    pub fn of<'a, R: Row + 'a>(rows: impl IntoIterator<Item = &'a R>) -> Self {
        let mut table = Self::new(R::COLUMNS);
        rows.into_iter().for_each(|row| table.add(row.cells()));
        table
    }

    /// Adds a line.
    ///
    /// # Panics
    /// The number of cells is not the number of columns.
    pub fn add<S: ToString>(&mut self, cells: impl IntoIterator<Item = S>) {
        let cells: Vec<String> = cells.into_iter().map(|cell| cell.to_string()).collect();
        assert_eq!(cells.len(), self.columns.len(), "a cell for each of {:?}", self.columns);
        self.lines.push(cells);
    }

    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let mut text = line(&self.columns) + &"|---".repeat(self.columns.len()) + "|\n";
        self.lines.iter().for_each(|cells| text += &line(cells));
        text
    }

    /// The table as CSV (RFC 4180, lines end with `\n`).
    pub fn csv(&self) -> String {
        let mut text = String::new();
        for cells in std::iter::once(&self.columns).chain(&self.lines) {
            for (n, cell) in cells.iter().enumerate() {
                let comma = if n > 0 { "," } else { "" };
                let _ = match cell.contains([',', '"', '\n']) {
                    true => write!(text, "{comma}\"{}\"", cell.replace('"', "\"\"")),
                    false => write!(text, "{comma}{cell}"),
                };
            }
            text.push('\n');
        }
        text
    }
}

/// Three significant digits, with an exponent for numbers below 0.001 and from 100 000.
pub fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        1e2..1e5 => format!("{value:.0}"),
        1e1..1e2 => format!("{value:.1}"),
        1e0..1e1 => format!("{value:.2}"),
        1e-1..1e0 => format!("{value:.3}"),
        1e-3..1e-1 => format!("{value:.4}"),
        _ if value.is_finite() => format!("{value:.1e}"),
        _ => value.to_string(),
    }
}

/// A share as a percentage.
pub fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share))
}

/// A value in its format, or a dash if there is none.
pub fn optional<T>(value: Option<T>, format: impl FnOnce(T) -> String) -> String {
    value.map_or_else(|| "–".into(), format)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_separators_are_escaped() {
        let mut table = Table::new(["case", "error"]);
        table.add(["a | b, \"c\"", "1"]);
        assert_eq!(table.markdown(), "| case | error |\n|---|---|\n| a \\| b, \"c\" | 1 |\n");
        assert_eq!(table.csv(), "case,error\n\"a | b, \"\"c\"\"\",1\n");
    }

    #[test]
    #[should_panic(expected = "a cell for each of")]
    fn a_line_with_a_missing_cell_is_refused() {
        Table::new(["a", "b"]).add(["1"]);
    }

    #[test]
    fn numbers_have_three_digits() {
        let texts = [0.0, 314.2, 31.42, 3.456, 0.3142, 0.03142, 2.7e-5, 2e6, f64::NAN].map(number);
        assert_eq!(texts, ["0", "314", "31.4", "3.46", "0.314", "0.0314", "2.7e-5", "2.0e6", "NaN"]);
        assert_eq!((percent(0.5), optional(None, percent)), ("50.0 %".into(), "–".into()));
    }
}
