//! Tables without empty columns.

use std::fmt::Write as _;

use super::text::escape;

/// A table of a page.
pub(super) struct Table {
    /// Titles of the columns, with units.
    titles: Vec<String>,
    rows: Vec<Vec<Cell>>,
}

/// A cell.
pub(super) enum Cell {
    /// Text, on the left.
    Text(String),
    /// A number, on the right.
    Number(String),
}

impl Cell {
    /// Text that is shown as it is.
    pub(super) fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number.
    pub(super) fn number<T: ToString>(number: T) -> Self {
        Self::Number(number.to_string())
    }

    /// A number, or an empty cell.
    pub(super) fn known<T: ToString>(number: Option<T>) -> Self {
        Self::Number(number.map(|number| number.to_string()).unwrap_or_default())
    }

    fn value(&self) -> &str {
        let (Self::Text(value) | Self::Number(value)) = self;
        value
    }
}

impl Table {
    /// A table without rows. A table whose titles are all empty has no row of titles.
    pub(super) fn new<T: Into<String>>(titles: impl IntoIterator<Item = T>) -> Self {
        Self { titles: titles.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row with a cell for each title.
    pub(super) fn add(&mut self, row: impl IntoIterator<Item = Cell>) {
        self.rows.push(row.into_iter().collect());
    }

    /// The table under its heading, without columns that are empty in all rows. Nothing without
    /// rows. A wide table scrolls by itself.
    pub(super) fn html(&self, heading: &str) -> String {
        if self.rows.is_empty() {
            return String::new();
        }
        let filled = |column: &usize| {
            self.rows.iter().any(|row| row.get(*column).is_some_and(|cell| !cell.value().is_empty()))
        };
        let columns: Vec<usize> = (0..self.titles.len()).filter(filled).collect();
        let mut out = format!("{heading}<div class=\"scroll\"><table>");
        if self.titles.iter().any(|title| !title.is_empty()) {
            out.push_str("<tr>");
            for &column in &columns {
                let class = match self.rows[0].get(column) {
                    Some(Cell::Number(_)) => " class=\"n\"",
                    _ => "",
                };
                let _ = write!(out, "<th{class}>{}</th>", escape(&self.titles[column]));
            }
            out.push_str("</tr>");
        }
        for row in &self.rows {
            out.push_str("<tr>");
            for cell in columns.iter().filter_map(|&column| row.get(column)) {
                let class = if matches!(cell, Cell::Number(_)) { " class=\"n\"" } else { "" };
                let _ = write!(out, "<td{class}>{}</td>", escape(cell.value()));
            }
            out.push_str("</tr>");
        }
        out + "</table></div>"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_columns_are_left_out_and_others_keep_their_titles() {
        let mut table = Table::new(["a", "b", "c, mm"]);
        assert_eq!(table.html("<h2>x</h2>"), "");
        table.add([Cell::text("<1>"), Cell::known(None::<f64>), Cell::number(2.5)]);
        let html = table.html("");
        assert!(html.contains("<th>a</th><th class=\"n\">c, mm</th>") && !html.contains("<th>b"), "{html}");
        assert!(html.contains("<td>&lt;1&gt;</td><td class=\"n\">2.5</td></tr>"), "{html}");
        table.add([Cell::text(""), Cell::number(7), Cell::known(None::<f64>)]);
        let html = table.html("");
        assert!(html.contains("b</th>") && html.contains("<td class=\"n\">7</td><td class=\"n\"></td>"));
    }
}
