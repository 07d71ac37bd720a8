//! Checks of a study, and controls: measurements of a wrong answer that a check must refuse.

use std::io::{self, Write};

/// The checks of one run. The run passes if there is at least one and all hold.
#[derive(Clone, Debug, Default)]
pub struct Checks {
    entries: Vec<Entry>,
}

#[derive(Clone, Debug)]
struct Entry {
    what: String,
    holds: bool,
    control: bool,
}

impl Checks {
    /// Adds a statement with its figures, and whether it holds.
    pub fn add(&mut self, what: impl Into<String>, holds: bool) {
        self.entries.push(Entry { what: what.into(), holds, control: false });
    }

    /// Adds a control, and whether the wrong answer was refused.
    pub fn control(&mut self, what: impl Into<String>, refused: bool) {
        self.entries.push(Entry { what: what.into(), holds: refused, control: true });
    }

    /// Takes over the checks of a part of the run.
    pub fn append(&mut self, mut other: Self) {
        self.entries.append(&mut other.entries);
    }

    /// True if there are checks and all of them hold.
    pub fn pass(&self) -> bool {
        !self.entries.is_empty() && self.entries.iter().all(|entry| entry.holds)
    }

    /// Prints one line per check.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        for Entry { what, holds, control } in &self.entries {
            let verdict = if *holds { "holds" } else { "FAILS" };
            writeln!(out, "{verdict}: {}{what}", if *control { "control: " } else { "" })?;
        }
        Ok(())
    }

    /// The number of checks that hold and of controls among them, for a page; failures are listed.
    pub fn summary(&self) -> String {
        let held = self.entries.iter().filter(|entry| entry.holds).count();
        let controls = self.entries.iter().filter(|entry| entry.control).count();
        let mut text =
            format!("{held} of {} checks hold; {controls} of the checks are controls.\n", self.entries.len());
        for entry in self.entries.iter().filter(|entry| !entry.holds) {
            text += &format!("\n**Fails**: {}\n", entry.what);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_passes_only_if_it_has_checks_and_all_hold() {
        let mut checks = Checks::default();
        assert!(!checks.pass());
        checks.add("error 0.1", true);
        checks.control("a wrong step", true);
        assert!(checks.pass());
        assert_eq!(checks.summary(), "2 of 2 checks hold; 1 of the checks are controls.\n");
        checks.control("a wrong sign", false);
        assert!(!checks.pass());
        assert!(checks.summary().contains("2 of 3") && checks.summary().contains("**Fails**: a wrong sign"));
        let mut text = Vec::new();
        checks.print(&mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert_eq!(text.lines().last(), Some("FAILS: control: a wrong sign"));
    }
}
