//! The table of a sweep: one line per case, with settings, results and measured costs.

use super::cases::Case;
use super::folder::{CaseState, Folder};
use super::identity::Hashes;
use super::plots;
use super::results::{self, Figure, MEASURED};
use super::study::Study;
use crate::Error;
use crate::report::Report;
use crate::run::files;

/// The results of a sweep.
pub struct Table {
    /// Names of the columns.
    pub columns: Vec<String>,
    /// One row per case, in the order of the study.
    pub rows: Vec<Vec<String>>,
    /// The state of each case.
    pub states: Vec<CaseState>,
    /// Number of columns before the results.
    pub(super) settings: usize,
}

impl Table {
    /// Collects the results of all cases that are done. It runs nothing.
    ///
    /// # Errors
    /// [`Error::File`] if a journal or a report cannot be read.
    pub fn of(study: &Study, folder: &Folder) -> Result<Self, Error> {
        let mut hashes = Hashes::default();
        let state = |case| folder.state(study, case, &mut hashes);
        let states: Vec<CaseState> = study.cases.iter().map(state).collect::<Result<_, _>>()?;
        let cases = study.cases.iter().zip(&states);
        let results = cases.map(|(case, state)| results_of(case, state, folder)).collect::<Result<_, _>>()?;
        Ok(Self::from(study, states, results))
    }

    fn from(study: &Study, states: Vec<CaseState>, results: Vec<(Vec<Figure>, String)>) -> Self {
        let has_scans = study.cases.iter().any(|case| case.scan.is_some());
        let has_without = study.cases.iter().any(|case| !case.without.is_empty());
        let mut figures: Vec<String> = Vec::new();
        for figure in results.iter().flat_map(|(figures, _)| figures) {
            if !figures.contains(&figure.column) {
                figures.push(figure.column.clone());
            }
        }
        figures.sort_by_key(|column| results::order(column));
        let (measured, figures): (Vec<_>, Vec<_>) =
            figures.into_iter().partition(|column| MEASURED.contains(&column.as_str()));

        let mut columns = vec!["case".to_owned(), "scene".into()];
        columns.extend(has_scans.then(|| "scan".into()));
        columns
            .extend(study.cases.iter().take(1).flat_map(|case| &case.settings).map(|(key, _)| key.clone()));
        columns.extend(has_without.then(|| "without".into()));
        let settings = columns.len();
        columns.extend(["state", "exit", "error"].map(String::from));
        columns.extend(figures.iter().cloned());
        columns.push("backend".into());
        columns.extend(measured.iter().cloned());

        let row = |((case, state), (found, backend)): ((&Case, &CaseState), &(Vec<Figure>, String))| {
            let scene = study.file.parent().and_then(|folder| case.scene.strip_prefix(folder).ok());
            let mut row = vec![case.name.clone(), scene.unwrap_or(&case.scene).display().to_string()];
            row.extend(has_scans.then(|| case.scan.clone().unwrap_or_default()));
            row.extend(case.settings.iter().map(|(_, value)| value.clone()));
            row.extend(has_without.then(|| case.without.join(" ")));
            let (exit, error) = match state {
                CaseState::Done(_) => ("0".into(), String::new()),
                CaseState::Failed(entry) => (
                    entry.exit.map(|code| code.to_string()).unwrap_or_default(),
                    entry.error.clone().unwrap_or_default(),
                ),
                CaseState::New | CaseState::Changed(_) => Default::default(),
            };
            row.extend([state.name(), exit, error]);
            let value = |column: &String| {
                let figure = found.iter().find(|figure| figure.column == *column);
                figure.map(Figure::text).unwrap_or_default()
            };
            row.extend(figures.iter().map(value));
            row.push(backend.clone());
            row.extend(measured.iter().map(value));
            row
        };
        let rows = study.cases.iter().zip(&states).zip(&results).map(row).collect();
        Self { columns, rows, states, settings }
    }

    /// Whether every case is done.
    pub fn is_complete(&self) -> bool {
        self.states.iter().all(CaseState::is_done)
    }

    /// The table as CSV (RFC 4180), with `\n` at the end of each line.
    pub fn csv(&self) -> String {
        let line =
            |cells: &Vec<String>| cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\n";
        std::iter::once(&self.columns).chain(&self.rows).map(line).collect()
    }

    /// Writes the table and the page with plots.
    ///
    /// # Errors
    /// [`Error::File`] if a file cannot be written.
    pub fn write(&self, study: &Study, folder: &Folder) -> Result<(), Error> {
        files::write(&folder.table(), self.csv().as_bytes())?;
        files::write(&folder.plots(), plots::page(study, self).as_bytes())
    }

    /// The values of a column, row by row. None for a cell that is no number.
    pub(super) fn numbers(&self, column: &str) -> Vec<Option<f64>> {
        let at = self.columns.iter().position(|name| name == column);
        let cell = |row: &Vec<String>| row.get(at?)?.parse().ok();
        self.rows.iter().map(cell).collect()
    }
}

/// Figures and backend of a case that is done.
fn results_of(case: &Case, state: &CaseState, folder: &Folder) -> Result<(Vec<Figure>, String), Error> {
    let CaseState::Done(entry) = state else { return Ok(Default::default()) };
    let path = folder.of_case(case).report();
    let report: Report = serde_json::from_slice(&files::read(&path)?).map_err(|e| Error::File {
        path,
        action: "read",
        why: e.to_string(),
    })?;
    Ok((results::figures(&report, entry.seconds), report.backend.name))
}

/// A cell of CSV. Line breaks become spaces, so that each case has one line.
fn quoted(cell: &str) -> String {
    let cell = cell.split_whitespace().collect::<Vec<_>>().join(" ");
    match cell.contains([',', '"']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stay_apart() {
        assert_eq!(quoted("plain"), "plain");
        assert_eq!(quoted("a, b"), "\"a, b\"");
        assert_eq!(quoted("a \"b\"\nc"), "\"a \"\"b\"\" c\"");
    }
}
