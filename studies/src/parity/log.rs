//! The comparisons on the terminal: one line each, and one line for all controls of a comparison.

use std::io::{self, IsTerminal, Write};

use super::comparison::{Comparison, Figures, Measured, Ring, Subject, Verdict};
use super::expected::ExpectedFailure;

/// Prints and keeps the comparisons.
pub struct Log<'a> {
    out: &'a mut dyn Write,
    expected: &'a [ExpectedFailure],
    rows: Vec<Comparison>,
    /// Number of printed rows. The rest are a comparison and its controls.
    printed: usize,
    /// True if stderr is a terminal, for a line of progress.
    watched: bool,
}

impl<'a> Log<'a> {
    /// An empty log with the known failures.
    pub fn new(out: &'a mut dyn Write, expected: &'a [ExpectedFailure]) -> Self {
        Self { out, expected, rows: Vec::new(), printed: 0, watched: io::stderr().is_terminal() }
    }

    /// Prints a line of text.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn line(&mut self, text: &str) -> io::Result<()> {
        self.flush()?;
        writeln!(self.out, "{text}")
    }

    /// Shows the present comparison on a terminal, until the next line.
    pub fn working_on(&self, what: &str) {
        if self.watched {
            eprint!("\r\x1b[K  … {what}");
        }
    }

    /// Judges and adds a comparison.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn add(
        &mut self,
        subject: &Subject<'_>,
        found: Result<Measured, String>,
    ) -> io::Result<&mut Comparison> {
        if subject.control.is_none() {
            self.flush()?;
        }
        let at = self.rows.len();
        self.rows.push(Comparison::judge(subject, found, self.expected));
        Ok(&mut self.rows[at])
    }

    /// Prints the rows that are not printed yet.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        if self.watched {
            eprint!("\r\x1b[K");
        }
        let rows = &self.rows[std::mem::replace(&mut self.printed, self.rows.len())..];
        let (rejected, others): (Vec<&Comparison>, Vec<&Comparison>) =
            rows.iter().partition(|row| row.outcome == Verdict::Rejected);
        for row in others {
            let what = row.control.as_ref().map_or(String::new(), |control| format!(", CONTROL {control}"));
            let name = format!("{}{what}", row.name);
            writeln!(self.out, "{:<10}{name:<60} {}", row.ring.name(), outcome(row))?;
            for (key, value) in &row.details {
                writeln!(self.out, "{:<14}{key}: {}", "", number(*value))?;
            }
        }
        if let Some(first) = rejected.first() {
            let weakest = rejected
                .iter()
                .filter_map(|row| row.figures.as_ref())
                .min_by(|a, b| a.worst.total_cmp(&b.worst));
            let names: Vec<&str> = rejected.iter().filter_map(|row| row.control.as_deref()).collect();
            let heading = format!("  {} controls REJECTED as required", rejected.len());
            writeln!(
                self.out,
                "{:<10}{heading:<60} {}",
                first.ring.name(),
                weakest.map_or(String::new(), least)
            )?;
            writeln!(self.out, "{:<14}{}", "", names.join("; "))?;
        }
        self.out.flush()
    }

    /// Prints the summary. Returns the rows, and whether each of the `required` rings has a row and
    /// every verdict is good.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn finish(mut self, required: &[Ring]) -> io::Result<(Vec<Comparison>, bool)> {
        self.flush()?;
        let count = |outcome| self.rows.iter().filter(|row| row.outcome == outcome).count();
        let bad: Vec<&Comparison> = self.rows.iter().filter(|row| !row.outcome.is_good()).collect();
        let is_missing = |ring: &&Ring| self.rows.iter().all(|row| row.ring != **ring);
        let missing: Vec<&Ring> = required.iter().filter(is_missing).collect();
        let well = bad.is_empty() && missing.is_empty() && !self.rows.is_empty();
        let verdict = if well { "parity holds" } else { "PARITY DOES NOT HOLD" };
        writeln!(
            self.out,
            "\n{verdict}: {} exact, {} within tolerance, {} controls rejected, {} known failures, {} misses",
            count(Verdict::Exact),
            count(Verdict::Within),
            count(Verdict::Rejected),
            count(Verdict::ExpectedFailure),
            bad.len()
        )?;
        for row in bad {
            let control =
                row.control.as_ref().map_or(String::new(), |control| format!(", control {control}"));
            writeln!(
                self.out,
                "  {}, {}{control}, {}: {}",
                row.ring.name(),
                row.name,
                row.adapter,
                outcome(row)
            )?;
        }
        for ring in missing {
            writeln!(self.out, "  {}: no row", ring.name())?;
        }
        if self.rows.is_empty() {
            writeln!(self.out, "  nothing was compared")?;
        }
        Ok((self.rows, well))
    }
}

/// The verdict with its figures.
fn outcome(row: &Comparison) -> String {
    let figures = row.figures.as_ref();
    let apart = figures.map_or(String::new(), |f| {
        let (worst, tolerance) = (number(f.worst), number(f.tolerance));
        format!("{} of {} differ, by {worst} ({tolerance} allowed) of {}", f.differing, f.compared, f.of)
    });
    let compared = figures.map_or(0, |f| f.compared);
    let note = row.note.as_deref().unwrap_or_default();
    match row.outcome {
        Verdict::Exact => format!("exact    {compared} compared"),
        Verdict::Within => figures.map_or(String::new(), |f| {
            format!("within   {} of {} × {}; {compared} compared", number(f.worst), number(f.tolerance), f.of)
        }),
        Verdict::Rejected => "rejected, as required".into(),
        Verdict::ExpectedFailure => format!("fails as expected: {note}"),
        Verdict::Failed => format!("FAILED   {apart}"),
        Verdict::ControlPassed => format!("CONTROL PASSED, {note}"),
        Verdict::UnexpectedPass => format!("UNEXPECTED PASS, {note}"),
        Verdict::Error => format!("ERROR    {note}"),
    }
}

/// The smallest difference of a control.
fn least(figures: &Figures) -> String {
    format!("least: {} of {} ({} allowed)", number(figures.worst), figures.of, number(figures.tolerance))
}

fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        1.0..1e15 if value.fract() == 0.0 => format!("{value:.0}"),
        1e-3..1e6 => format!("{}", (value * 1e4).round() / 1e4),
        _ => format!("{value:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text of a log with these rows (control, agrees), and whether it passes.
    fn logged(rows: &[(Option<&str>, bool)]) -> (String, bool) {
        let mut text = Vec::new();
        let mut log = Log::new(&mut text, &[]);
        for &(control, agrees) in rows {
            let worst = if agrees { 0.0 } else { 2e-3 };
            let subject = Subject { ring: Ring::Op, name: "springs", adapter: "card", control };
            log.add(&subject, Ok(Measured::at_most(7, worst, 1e-6, "extent"))).unwrap();
        }
        let (kept, well) = log.finish(&[Ring::Op]).unwrap();
        assert_eq!(kept.len(), rows.len());
        (String::from_utf8(text).unwrap(), well)
    }

    #[test]
    fn a_control_that_passes_fails_the_command() {
        let (text, well) = logged(&[(None, true), (Some("first"), false), (Some("second"), false)]);
        assert!(well);
        assert!(text.contains("exact    7 compared") && text.contains("2 controls REJECTED"), "{text}");
        assert!(text.contains("first; second") && text.contains("least: 0.002 of extent"), "{text}");

        let (text, well) = logged(&[(None, true), (Some("first"), false), (Some("second"), true)]);
        assert!(!well);
        assert!(text.contains("PARITY DOES NOT HOLD") && text.contains("1 misses"), "{text}");
        assert!(text.contains("op, springs, control second, card: CONTROL PASSED"), "{text}");
    }

    #[test]
    fn a_failed_comparison_and_an_empty_log_fail_the_command() {
        assert!(!logged(&[(None, false), (Some("first"), false)]).1);
        assert!(!logged(&[]).1);
    }

    #[test]
    fn a_ring_without_a_row_fails_the_command() {
        let mut text = Vec::new();
        let mut log = Log::new(&mut text, &[]);
        let subject = Subject { ring: Ring::Op, name: "springs", adapter: "card", control: None };
        log.add(&subject, Ok(Measured::at_most(7, 0.0, 0.0, "extent"))).unwrap();
        assert!(!log.finish(&[Ring::Op, Ring::Scene]).unwrap().1);
        assert!(String::from_utf8(text).unwrap().contains("scene: no row"));
    }
}
