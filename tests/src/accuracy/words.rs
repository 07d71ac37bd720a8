//! What the rows say, in words: every sentence is made of figures of the rows, so that it can be read off the CSV.

use super::config::{Backend, PBD, XPBD};
use super::row::{Measure, Row};

/// Errors for which the cheapest setting is named.
pub const LEVELS: [f64; 3] = [0.1, 0.01, 0.001];
/// An error that falls by less when the iterations are doubled has stalled.
const STALLED: f64 = 0.9;

/// Marks what belongs to rest and was measured on a body that still moved.
pub const MOVES: &str = " †";

/// An error in percent, marked if it belongs to rest and the body still moved.
pub fn told(row: &Row, measure: Measure) -> Option<String> {
    let mark = if row.valid_error(measure).is_none() { MOVES } else { "" };
    row.error(measure).map(|error| percent(error) + mark)
}

/// The fastest of `rows` with an error of at most `level`.
pub fn cheapest<'a>(rows: &[&'a Row], measure: Measure, level: f64) -> Option<&'a Row> {
    let good = rows.iter().filter(|row| row.valid_error(measure).is_some_and(|error| error <= level));
    good.min_by(|a, b| a.ms_min.total_cmp(&b.ms_min)).copied()
}

/// The row with the least error.
pub fn best<'a>(rows: &[&'a Row], measure: Measure) -> Option<&'a Row> {
    let error = |row: &Row| row.valid_error(measure).filter(|error| error.is_finite());
    let known = rows.iter().filter(|row| error(row).is_some());
    known.min_by(|a, b| error(a).unwrap_or(f64::MAX).total_cmp(&error(b).unwrap_or(f64::MAX))).copied()
}

/// What to choose for one error, level by level.
pub fn choice(rows: &[&Row], measure: Measure) -> String {
    let level = |level: f64| match cheapest(rows, measure, level) {
        Some(row) => {
            format!("{} at most: {}", percent(level), row.setting())
        }
        None => format!("{} at most: none", percent(level)),
    };
    LEVELS.map(level).join("; ")
}

/// Where iterating stalls: for each number of substeps the error with the fewest and the most iterations, and whether the last
/// doubling still helped.
pub fn stalls(rows: &[&Row], measure: Measure) -> Vec<String> {
    let mut lines = Vec::new();
    for s in substeps(rows) {
        let mut line: Vec<(u32, f64)> = rows
            .iter()
            .filter(|row| row.substeps == s)
            .filter_map(|row| Some((row.iterations, row.valid_error(measure)?)))
            .collect();
        line.sort_by_key(|(iterations, _)| *iterations);
        let (Some(&(few, first)), Some(&(most, last))) = (line.first(), line.last()) else { continue };
        if few == most {
            continue;
        }
        let before = line[line.len() - 2].1;
        let stalled = line.windows(2).find(|pair| pair[1].1 > STALLED * pair[0].1);
        let verdict = match stalled {
            Some(pair) if last > STALLED * before => {
                format!("stalls from {} iterations on", pair[0].0)
            }
            _ => format!("still falls, by {:.1} with the last doubling", before / last),
        };
        lines.push(format!(
            "{s} substep{}: {} with {few}, {} with {most} iterations; {verdict}",
            if s == 1 { "" } else { "s" },
            percent(first),
            percent(last)
        ));
    }
    lines
}

/// Everything at an E1 of `level` against plain XPBD: with its iterations raised in one substep and in as many substeps as the fastest
/// has, and with any number of both.
pub fn against_iterating(rows: &[&Row], level: f64) -> String {
    let aim = percent(level);
    let Some(fastest) = cheapest(rows, Measure::E1, level) else {
        return format!("No setting has an E1 of {aim} or less.");
    };
    let xpbd: Vec<&Row> = rows.iter().copied().filter(|row| row.method() == XPBD.formulation).collect();
    let e1 = |row: &Row| percent(row.e1.unwrap_or(f64::NAN));
    let mut text = format!(
        "The fastest setting with an E1 of {aim} or less is {} with {}.",
        fastest.setting(),
        e1(fastest)
    );
    let mut raised = vec![1, fastest.substeps];
    raised.dedup();
    for s in raised {
        let line: Vec<&Row> = xpbd.iter().copied().filter(|row| row.substeps == s).collect();
        let substeps = if s == 1 { "one substep".to_owned() } else { format!("{s} substeps") };
        text += &match (cheapest(&line, Measure::E1, level), best(&line, Measure::E1)) {
            (Some(row), _) => format!(
                " Plain XPBD with {substeps} has that with {} iterations and takes {:.2} times as long ({} ms).",
                row.iterations,
                row.ms_min / fastest.ms_min,
                ms(row.ms_min)
            ),
            (None, Some(row)) => format!(
                " Plain XPBD with {substeps} does not come there: at its best, {} iterations in {} ms, its E1 is {}.",
                row.iterations,
                ms(row.ms_min),
                e1(row)
            ),
            (None, None) => String::new(),
        };
    }
    text += &match cheapest(&xpbd, Measure::E1, level) {
        Some(row) => format!(
            " Of all settings of XPBD {} comes there first; it takes {:.2} times as long as the fastest.",
            row.setting(),
            row.ms_min / fastest.ms_min
        ),
        None => " No setting of XPBD comes there.".into(),
    };
    text
}

/// For each number of substeps, the fastest setting of each method with an E1 of at most `level`: the same problem for all, since a
/// shorter step is easier.
pub fn method_by_method(rows: &[&Row], level: f64) -> Vec<String> {
    let of_substeps = |s: u32| {
        let with: Vec<&Row> = rows.iter().copied().filter(|row| row.substeps == s).collect();
        let entry = |method: &String| {
            let rows: Vec<&Row> = with.iter().copied().filter(|row| row.method() == *method).collect();
            match (cheapest(&rows, Measure::E1, level), best(&rows, Measure::E1)) {
                (Some(row), _) => Some(format!("{method} × {} ({} ms)", row.iterations, ms(row.ms_min))),
                (None, Some(row)) => {
                    let error = percent(row.e1.unwrap_or(f64::NAN));
                    Some(format!("{method} not ({error} with × {})", row.iterations))
                }
                (None, None) => None,
            }
        };
        let entries: Vec<String> = methods(&with).iter().filter_map(entry).collect();
        format!("{s}: {}", entries.join(", "))
    };
    substeps(rows).into_iter().map(of_substeps).collect()
}

/// The methods of `rows`, in order of appearance.
pub fn methods(rows: &[&Row]) -> Vec<String> {
    let mut methods: Vec<String> = Vec::new();
    for method in rows.iter().map(|row| row.method()) {
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    methods
}

/// The numbers of substeps of `rows`, ascending.
fn substeps(rows: &[&Row]) -> Vec<u32> {
    let mut substeps: Vec<u32> = rows.iter().map(|row| row.substeps).collect();
    substeps.sort_unstable();
    substeps.dedup();
    substeps
}

/// Substeps against iterations with the same number of sweeps.
pub fn same_sweeps(rows: &[&Row], sweeps: u32) -> Option<String> {
    let mut same: Vec<&Row> =
        rows.iter().copied().filter(|row| row.sweeps() == sweeps && row.e3.is_some()).collect();
    same.sort_by_key(|row| row.substeps);
    if same.len() < 2 {
        return None;
    }
    let entry = |row: &&Row| {
        format!(
            "{} × {}: E2 {}, E3 {}",
            row.substeps,
            row.iterations,
            told(row, Measure::E2).unwrap_or_else(|| "none".into()),
            told(row, Measure::E3).unwrap_or_else(|| "none".into())
        )
    };
    Some(format!("With {sweeps} sweeps a frame: {}.", same.iter().map(entry).collect::<Vec<_>>().join("; ")))
}

/// What single precision costs: the least errors of both precisions.
pub fn precision(rows: &[Row], measure: Measure) -> Option<String> {
    let of = |backend: Backend| {
        rows.iter()
            .filter(|row| row.backend == backend.name() && row.method() == XPBD.formulation)
            .collect::<Vec<&Row>>()
    };
    let (single, double) = (of(Backend::Cpu), of(Backend::CpuDouble));
    // Only where both ran.
    let ran = |row: &&&Row| {
        double.iter().any(|other| (other.substeps, other.iterations) == (row.substeps, row.iterations))
    };
    let single: Vec<&Row> = single.iter().filter(ran).copied().collect();
    let (a, b) = (best(&single, measure)?, best(&double, measure)?);
    Some(format!(
        "Least {} of the same settings: {} in `f32` ({} × {}), {} in `f64` ({} × {}).",
        measure.name(),
        percent(a.error(measure)?),
        a.substeps,
        a.iterations,
        percent(b.error(measure)?),
        b.substeps,
        b.iterations
    ))
}

/// What PBD ends up with.
pub fn pbd(rows: &[Row]) -> Option<String> {
    let mut settled: Vec<&Row> =
        rows.iter().filter(|row| row.formulation == PBD.formulation && row.e3.is_some()).collect();
    settled.sort_by_key(|row| row.sweeps());
    // Settings with the same result share an entry.
    let mut entries: Vec<(String, Vec<String>)> = Vec::new();
    for row in settled {
        let opening =
            row.opening.map_or_else(String::new, |ratio| format!(", opening {ratio:.2} times as wide"));
        let result = format!("E3 {}{opening}", told(row, Measure::E3).unwrap_or_default());
        let setting = format!("{} × {}", row.substeps, row.iterations);
        match entries.iter_mut().find(|(known, _)| *known == result) {
            Some((_, settings)) => settings.push(setting),
            None => entries.push((result, vec![setting])),
        }
    }
    let entries: Vec<String> =
        entries.iter().map(|(result, settings)| format!("{}: {result}", settings.join(", "))).collect();
    (!entries.is_empty()).then(|| {
        format!(
            "PBD has stiffness per iteration and no material: E1 and E2 have no meaning for it, and E3 says how far from the \
             material's equilibrium it ends. {}.",
            entries.join("; ")
        )
    })
}

/// A share in percent with two digits that count.
pub fn percent(share: f64) -> String {
    let value = 100.0 * share;
    match value.abs() {
        _ if !value.is_finite() => "beyond numbers".into(),
        size if size >= 9.95 => format!("{value:.0} %"),
        size if size >= 0.995 => format!("{value:.1} %"),
        size if size >= 0.0995 => format!("{value:.2} %"),
        size if size >= 0.00995 => format!("{value:.3} %"),
        _ => format!("{value:.1e} %"),
    }
}

/// Milliseconds with two or three digits.
pub fn ms(ms: f64) -> String {
    match ms {
        ms if ms >= 99.5 => format!("{ms:.0}"),
        ms if ms >= 9.95 => format!("{ms:.1}"),
        ms if ms >= 0.995 => format!("{ms:.2}"),
        ms => format!("{ms:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(substeps: u32, iterations: u32, ms_min: f64, e1: f64) -> Row {
        let (backend, formulation) = ("cpu f32", "xpbd");
        Row { backend, formulation, substeps, iterations, ms_min, e1: Some(e1), ..Row::default() }
    }

    #[test]
    fn what_still_moves_is_marked_and_never_chosen() {
        let at_rest = Row { e3: Some(0.01), unrest: Some(0.04), ms_min: 2.0, ..Row::default() };
        let moving = Row { unrest: Some(0.06), ms_min: 1.0, ..at_rest.clone() };
        let lost = Row { unrest: Some(f64::NAN), ..moving.clone() };
        for row in [&moving, &lost] {
            assert_eq!(told(row, Measure::E3).unwrap(), "1.0 % †");
            assert_eq!(cheapest(&[row, &at_rest], Measure::E3, 0.02), Some(&at_rest));
        }
        assert_eq!(told(&at_rest, Measure::E3).unwrap(), "1.0 %");
    }

    #[test]
    fn sentences_name_the_rows_that_they_are_made_of() {
        let rows = [
            row(1, 1, 1.0, 0.5),
            row(1, 2, 2.0, 0.2),
            row(1, 4, 4.0, 0.19),
            row(8, 1, 3.0, 0.004),
            row(8, 2, 9.0, 0.002),
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        let choice = choice(&rows, Measure::E1);
        assert!(
            choice.contains("10 % at most: xpbd 8 × 1 (3.00 ms)") && choice.contains("0.10 % at most: none"),
            "{choice}"
        );
        let stalls = stalls(&rows, Measure::E1);
        assert_eq!(stalls[0], "1 substep: 50 % with 1, 19 % with 4 iterations; stalls from 2 iterations on");
        assert_eq!(
            stalls[1],
            "8 substeps: 0.40 % with 1, 0.20 % with 2 iterations; still falls, by 2.0 with the last doubling"
        );
        let against = against_iterating(&rows, 0.01);
        assert!(
            against.contains(
                "is xpbd 8 × 1 (3.00 ms) with 0.40 %. Plain XPBD with one substep does not come there"
            ),
            "{against}"
        );
        assert!(
            against.contains("Plain XPBD with 8 substeps has that with 1 iterations and takes 1.00 times"),
            "{against}"
        );
        assert!(
            against.ends_with(
                "xpbd 8 × 1 (3.00 ms) comes there first; it takes 1.00 times as long as the fastest."
            ),
            "{against}"
        );
        assert!(against.contains("at its best, 4 iterations in 4.00 ms, its E1 is 19 %"), "{against}");
        let methods = method_by_method(&rows, 0.01);
        assert_eq!(methods, ["1: xpbd not (19 % with × 4)", "8: xpbd × 1 (3.00 ms)"]);
    }
}
