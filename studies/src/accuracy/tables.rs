//! Tables of the page and of the terminal.

use super::front::pareto;
use super::measurement::{Measure, Measurement};
use crate::kit::{Row, Table, number, optional, percent};

/// Error levels of the table of choices.
const LEVELS: [f64; 3] = [0.1, 0.01, 0.001];

/// The results of one problem.
pub struct Section {
    /// Name of the problem.
    pub name: &'static str,
    /// Description of the problem.
    pub what: String,
    /// Free vertices, constraints, substeps of the fine run.
    pub sizes: [u64; 3],
    /// Opening of the wound at the equilibrium, with its unit.
    pub opening: Option<(f64, &'static str)>,
    /// One measurement per configuration.
    pub rows: Vec<Measurement>,
}

impl Row for Section {
    const COLUMNS: &'static [&'static str] =
        &["problem", "description", "free vertices", "constraints", "fine run, substeps", "opening"];

    fn cells(&self) -> Vec<String> {
        let mut cells = vec![format!("`{}`", self.name), self.what.clone()];
        cells.extend(self.sizes.map(|size| size.to_string()));
        cells.push(optional(self.opening, |(opening, unit)| format!("{} {unit}", number(opening))));
        cells
    }
}

/// The fastest usual setting of each problem, for each error and level.
pub fn choices(sections: &[Section]) -> Table {
    let labels = Measure::ALL.map(Measure::label);
    let mut table = Table::new(["problem", "error at most"].into_iter().chain(labels));
    for section in sections {
        for level in LEVELS {
            let fastest = Measure::ALL
                .map(|measure| optional(cheapest(&section.rows, measure, level), Measurement::setting));
            table.add([section.name.to_owned(), format!("{} %", 100.0 * level)].into_iter().chain(fastest));
        }
    }
    table
}

/// The least error of each method in `f32` and `f64`, with its setting.
pub fn limits(sections: &[Section]) -> Table {
    let mut table = Table::new(["problem", "method", "E1", "E2", "E3", "E4"]);
    for section in sections {
        let mut families: Vec<String> = section.rows.iter().map(Measurement::family).collect();
        families.sort_unstable();
        families.dedup();
        for family in families.iter().filter(|family| family.starts_with("cpu")) {
            let of_family = || section.rows.iter().filter(|row| row.family() == *family);
            let least = Measure::ALL.map(|measure| {
                let known = of_family().filter_map(|row| Some((row, row.valid_error(measure)?)));
                let best = known.filter(|(_, e)| e.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1));
                optional(best, |(row, error)| {
                    format!("{} ({} × {})", percent(error), row.substeps, row.iterations)
                })
            });
            table.add([section.name.to_owned(), family.clone()].into_iter().chain(least));
        }
    }
    table
}

/// The fastest usual setting with an error of at most `level`.
fn cheapest(rows: &[Measurement], measure: Measure, level: f64) -> Option<&Measurement> {
    let good = |row: &&Measurement| row.valid_error(measure).is_some_and(|error| error <= level);
    rows.iter().filter(|row| row.is_usual()).filter(good).min_by(|a, b| a.ms_min.total_cmp(&b.ms_min))
}

/// The settings on the Pareto front of one of the errors, by time.
pub fn front_table(rows: &[Measurement]) -> Table {
    let point = |row: &Measurement, measure| [row.ms_min, row.valid_error(measure).unwrap_or(f64::NAN)];
    let mut chosen: Vec<usize> = Measure::ALL
        .iter()
        .flat_map(|&measure| pareto(&rows.iter().map(|row| point(row, measure)).collect::<Vec<_>>()))
        .collect();
    chosen.sort_by(|&a, &b| rows[a].ms_min.total_cmp(&rows[b].ms_min).then(a.cmp(&b)));
    chosen.dedup();
    let mut table = Table::new(["setting", "ms", "E1", "E2", "E3", "E4", "opening", "stiffness"]);
    for row in chosen.into_iter().map(|n| &rows[n]) {
        let name = format!("{}, {} × {}", row.family(), row.substeps, row.iterations);
        let errors = Measure::ALL.map(|measure| optional(row.valid_error(measure), percent));
        let ratios = [row.opening, row.stiffness].map(|ratio| optional(ratio, number));
        table.add([name, number(row.ms_min)].into_iter().chain(errors).chain(ratios));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(substeps: u32, ms_min: f64, e1: f64) -> Measurement {
        let (backend, formulation) = ("cpu f32", "xpbd");
        Measurement {
            backend,
            formulation,
            substeps,
            iterations: 1,
            ms_min,
            e1: Some(e1),
            ..Measurement::default()
        }
    }

    #[test]
    fn the_fastest_setting_within_a_level_is_chosen() {
        let rows = vec![row(1, 1.0, 0.5), row(8, 3.0, 0.004), row(16, 9.0, 0.002)];
        let section = Section { name: "sheet", what: String::new(), sizes: [1; 3], opening: None, rows };
        let text = choices(&[section]).markdown();
        assert!(text.contains("| sheet | 10 % | xpbd 8 × 1 (3.00 ms) | – | – | – |"), "{text}");
        assert!(text.contains("| sheet | 0.1 % | – | – | – | – |"), "{text}");
    }

    #[test]
    fn a_setting_that_still_moves_is_not_chosen() {
        let moving = Measurement { e3: Some(0.01), residual_motion: Some(0.5), ..row(1, 1.0, 1.0) };
        let at_rest = Measurement { residual_motion: Some(0.0), ms_min: 2.0, ..moving.clone() };
        assert_eq!(cheapest(&[moving, at_rest.clone()], Measure::E3, 0.02), Some(&at_rest));
    }
}
