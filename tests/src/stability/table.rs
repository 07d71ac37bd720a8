//! The rows: on the terminal as they come.

use std::io::Write;

use super::options::Options;
use super::{Failure, Row, page};

/// Collects rows and prints them.
pub struct Table<'a> {
    out: &'a mut dyn Write,
    rows: Vec<Row>,
}

impl<'a> Table<'a> {
    /// Empty.
    pub fn new(out: &'a mut dyn Write) -> Self {
        Self { out, rows: Vec::new() }
    }

    /// Prints a row and keeps it.
    ///
    /// # Errors
    /// Of the terminal.
    pub fn add(&mut self, row: Row) -> Result<(), Failure> {
        let number =
            |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3e}"));
        writeln!(
            self.out,
            "{:8} {:58} {:14} {:>6} energy {:>9} recovery {:>9} error {:>9} {:6.2} s  {}",
            row.outcome.to_string(),
            row.case,
            row.backend,
            row.scale.map_or_else(|| "-".to_owned(), |scale| format!("{scale:e}")),
            number(row.energy_ratio),
            number(row.recovery_s),
            number(row.error),
            row.wall_s,
            row.outcome.note(),
        )?;
        self.rows.push(row);
        Ok(())
    }

    /// Prints how many rows ended how; whether all ended as they must.
    ///
    /// # Errors
    /// Of the terminal and the files.
    pub fn finish(self, options: &Options) -> Result<bool, Failure> {
        let failed = self.rows.iter().filter(|row| !row.outcome.is_good()).count();
        writeln!(self.out, "\n{} rows, {failed} failed", self.rows.len())?;
        if self.rows.is_empty() {
            return Err("no case was run".into());
        }
        if options.write {
            for path in page::write(&self.rows, options)? {
                writeln!(self.out, "written: {}", path.display())?;
            }
        }
        Ok(failed == 0)
    }
}
