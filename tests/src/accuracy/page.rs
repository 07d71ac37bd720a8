//! The page `docs/results/accuracy.md`.

use std::fmt::Write as _;

use cutis::report::Machine;

use super::checks::Check;
use super::front::pareto;
use super::row::{Measure, Row};
use super::words::{
    LEVELS, MOVES, against_iterating, cheapest, choice, method_by_method, methods, ms, pbd, percent,
    precision, same_sweeps, stalls, told,
};

/// A problem that was run.
pub struct Section {
    /// Its name.
    pub name: &'static str,
    /// In words.
    pub what: String,
    /// Vertices that move, constraints, substeps of the fine run.
    pub sizes: [u64; 3],
    /// Instants of E1, frame of E2, most frames to rest.
    pub frames: (Vec<u32>, u32, u32),
    /// Opening of the wound at the equilibrium, with its unit.
    pub opening: Option<(f64, &'static str)>,
    /// The rows.
    pub rows: Vec<Row>,
}

/// Where and how the page was made.
pub struct Origin {
    /// The command line.
    pub command: String,
    /// Of the source, if it is known.
    pub commit: Option<String>,
    /// Load of the machine at the start and at the end.
    pub load: [Option<String>; 2],
    /// The GPU, in words.
    pub gpu: String,
    /// How long it took, s.
    pub took_s: f64,
    /// Problems whose data are absent.
    pub skipped: Vec<&'static str>,
}

const MEASURES: &str = "\
A *setting* is written substeps × iterations; a frame has as many sweeps over all constraints as the product says, and with
`vbd` twice as many over all vertices. Times are the
shortest and the middle one of all frames, in milliseconds; configurations took turns, so that load falls on all alike.

- **E1**, algebraic: one substep from the moving body, against the minimizer of the implicit step, which Newton's method with a
  sparse direct solution finds in `f64` from the same energies without any code of the solver (`cutis-newton`). Root mean square
  of the difference over that of the minimizer's own displacement; the largest over the instants.
- **E2**, temporal: positions at one frame, against an `f64` run with at least 64 times the substeps; relative to the displacement
  from rest.
- **E3**, physical: the settled body against the equilibrium of the same energies by Newton's method, likewise.
- **E4**, residual: root mean square of `C` over rest size, less that of the equilibrium, constraint by constraint; the kind with
  the largest. The CSV has every kind, the residual itself and that of the equilibrium, at which constraints carry load and `C` is
  not zero.
- A body that still moves by more than 5 % of its displacement in the second half of its frames has not come to rest: its E3,
  E4, opening and stiffness, marked †, owe part of themselves to time. They are in the tables and the CSV (`unrest`), and
  neither in a chart nor in a choice.
- **Stiffness**: how stiff the settled body seems, over what its material says: by how much more load it would take to move it as
  far as the equilibrium, and where a handle pulls, the reaction on it over that at the equilibrium.

PBD has no E1 and no E2: it minimizes nothing, and its result has no limit as substeps grow.
";

/// The whole page.
pub fn page(origin: &Origin, sections: &[Section], checks: &[Check]) -> String {
    let machine = Machine::here();
    let load = |load: &Option<String>| load.clone().unwrap_or_else(|| "unknown".into());
    let mut text = format!(
        "# Error against run time\n\n\
         Written by `{}` at commit {}, on {}, {} cores, {}, in {:.0} s; load of the machine {} at the start, {} at the end. GPU: {}. \
         All figures are from [accuracy.csv](accuracy.csv).\n\n{MEASURES}",
        origin.command,
        origin.commit.as_deref().unwrap_or("unknown"),
        machine.cpu,
        machine.cores,
        machine.system,
        origin.took_s,
        load(&origin.load[0]),
        load(&origin.load[1]),
        origin.gpu,
    );
    for name in &origin.skipped {
        let _ = writeln!(
            text,
            "\n`{name}` was left out: its scan is not part of the repository, and was not there."
        );
    }
    text += &summary(sections);
    for section in sections {
        text += &of_problem(section);
    }
    text += "\n## Checks\n\nThe command ends with an error if one of these does not hold.\n\n";
    for Check { what, holds } in checks {
        let _ = writeln!(text, "- {} {what}", if *holds { "holds:" } else { "**FAILS:**" });
    }
    text
}

/// The fastest usual settings of all problems, side by side.
fn summary(sections: &[Section]) -> String {
    let mut text = String::from(
        "\n## What to choose\n\nThe fastest setting on the CPU in `f32`, by what is asked for.\n\n\
         | problem | error at most |",
    );
    for measure in Measure::ALL {
        let _ = write!(text, " {} |", measure.label());
    }
    text += "\n|---|---|---|---|---|---|\n";
    for section in sections {
        let rows: Vec<&Row> = section.rows.iter().filter(|row| row.is_usual()).collect();
        for level in LEVELS {
            let _ = write!(text, "| {} | {} |", section.name, percent(level));
            for measure in Measure::ALL {
                let _ = match cheapest(&rows, measure, level) {
                    Some(row) => write!(text, " {} |", row.setting()),
                    None => write!(text, " none |"),
                };
            }
            text.push('\n');
        }
    }
    text
}

fn of_problem(section: &Section) -> String {
    let Section {
        name,
        what,
        sizes: [free, constraints, fine],
        frames: (instants, compared, most),
        opening,
        rows,
    } = section;
    let instants: Vec<String> = instants.iter().map(u32::to_string).collect();
    let mut text = format!(
        "\n## {name}\n\nThe problem: {what}. {free} vertices move, {constraints} constraints. E1 after frames {}; E2 at frame {compared}, \
         against {fine} substeps a frame; at rest after at most {most} frames.",
        instants.join(" and ")
    );
    if let Some((opening, unit)) = opening {
        let _ = write!(text, " At the equilibrium the wound has opened by {opening:.4} {unit}.");
    }
    text += "\n\n";
    for measure in Measure::ALL {
        let _ =
            writeln!(text, "![{}](accuracy-{name}-{}.svg)", measure.label(), measure.name().to_lowercase());
    }
    text += "\nA line has one number of substeps; from point to point its iterations double. Settings on the front of at least one error (that \
             error in bold):\n\n";
    text += &front_table(rows);
    let usual: Vec<&Row> = rows.iter().filter(|row| row.is_usual()).collect();
    text += "\nThe fastest on the CPU in `f32`:\n\n";
    for measure in Measure::ALL {
        let _ = writeln!(text, "- {}: {}.", measure.name(), choice(&usual, measure));
    }
    let _ = writeln!(text, "\n{}\n", against_iterating(&usual, 0.01));
    let lines = method_by_method(&usual, 0.01);
    let _ = writeln!(
        text,
        "An E1 of 1 %, by the number of substeps, with how many iterations: {}.\n\nWhere iterating stalls:\n",
        lines.join("; ")
    );
    let mut sentences = Vec::new();
    for method in &methods(&usual) {
        let rows: Vec<&Row> = usual.iter().copied().filter(|row| row.method() == *method).collect();
        for measure in [Measure::E1, Measure::E2, Measure::E3] {
            let lines = stalls(&rows, measure);
            if !lines.is_empty() {
                let _ = writeln!(text, "- {method}, {}. {}.", measure.label(), lines.join(". "));
            }
        }
        let same = [20, 80, 160].into_iter().filter_map(|sweeps| same_sweeps(&rows, sweeps));
        sentences.extend(same.map(|sentence| format!("{method}. {sentence}")));
    }
    text.push('\n');
    sentences.extend(Measure::ALL.into_iter().filter_map(|measure| precision(rows, measure)));
    sentences.extend(pbd(rows));
    for sentence in sentences {
        let _ = writeln!(text, "- {sentence}");
    }
    for row in rows.iter().filter(|row| row.failure.is_some()) {
        let _ = writeln!(text, "- {} failed: {}.", row.name(), row.failure.as_deref().unwrap_or_default());
    }
    text
}

/// The rows on a front of one of the errors, by time.
pub fn front_table(rows: &[Row]) -> String {
    let fronts: Vec<Vec<usize>> = Measure::ALL
        .iter()
        .map(|&measure| {
            let points: Vec<[f64; 2]> =
                rows.iter().map(|row| [row.ms_min, row.valid_error(measure).unwrap_or(f64::NAN)]).collect();
            pareto(&points)
        })
        .collect();
    let mut chosen: Vec<usize> = fronts.concat();
    chosen.sort_by(|&a, &b| rows[a].ms_min.total_cmp(&rows[b].ms_min).then(a.cmp(&b)));
    chosen.dedup();
    let mut text = String::from(
        "| setting | ms, shortest | ms, middle | E1 | E2 | E3 | E4 | opening | stiffness |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for n in chosen {
        let row = &rows[n];
        let _ = write!(text, "| {} | {} | {} |", row.name(), ms(row.ms_min), ms(row.ms_median));
        for (measure, front) in Measure::ALL.into_iter().zip(&fronts) {
            let _ = match told(row, measure) {
                Some(error) if front.contains(&n) => write!(text, " **{error}** |"),
                Some(error) => write!(text, " {error} |"),
                None => write!(text, " |"),
            };
        }
        for ratio in [row.opening, row.stiffness] {
            let _ = match ratio {
                Some(ratio) => write!(text, " {ratio:.3}{} |", if row.still_moves() { MOVES } else { "" }),
                None => write!(text, " |"),
            };
        }
        text.push('\n');
    }
    text
}
