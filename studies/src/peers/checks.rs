//! Checks that the programs bend the same beam alike, with beams of another stiffness as controls.

use super::job::Order;
use super::turns::Row;
use crate::kit::{Checks, percent};

/// How close a program must be to Cutis.
pub struct Agreement {
    /// Name of the program.
    pub name: &'static str,
    /// Largest difference of the sags over that of Cutis.
    pub most: f64,
    /// What both programs have in common.
    pub what: &'static str,
}

fn apart(found: f64, reference: f64) -> f64 {
    (found / reference - 1.0).abs()
}

/// Compares each row with the row of Cutis in the same order, and with `wrong_m`: the sag of a beam
/// of another stiffness, which must not agree.
pub fn compare(rows: &[Row], agreements: &[Agreement], wrong: &str, wrong_m: f64, checks: &mut Checks) {
    for Agreement { name, most, what } in agreements {
        for row in rows.iter().filter(|row| row.name == *name) {
            let sag_m = |row: &Row| row.found().map(|found| found.sag_m);
            let ours = rows.iter().filter(|other| other.name == super::CUTIS && other.order == row.order);
            let (Some(found), Some(reference)) = (sag_m(row), ours.flat_map(sag_m).next()) else { continue };
            let difference = apart(found, reference);
            let order = match row.order {
                Order::Lattice => "",
                Order::Shuffled => ", shuffled",
            };
            let bound = percent(*most);
            checks.add(
                format!("{name}{order}, {what}: {} apart, at most {bound}", percent(difference)),
                difference <= *most,
            );
            let difference = apart(wrong_m, found);
            checks.control(
                format!("{name}{order} and a beam {wrong}: {} apart, more than {bound}", percent(difference)),
                difference > *most,
            );
        }
    }
}

/// Largest ratio of the second shortest turn to the shortest.
const STEADY: f64 = 1.25;

/// Checks that two turns of each program have about the same shortest frame. On a busy machine they
/// do not: programs whose threads wait for each other then take many times as long, and the ratios
/// would say nothing.
pub fn steady(rows: &[Row], checks: &mut Checks) {
    for row in rows {
        let Some(found) = row.found() else { continue };
        let mut turns = found.turns_ms.clone();
        turns.sort_by(f64::total_cmp);
        if let [shortest, second, ..] = turns[..] {
            let spread = second / shortest;
            checks.add(
                format!(
                    "{} ({}), {} vertices: the second shortest turn is {spread:.2} times the shortest, \
                     at most {STEADY}",
                    row.name,
                    row.order.name(),
                    found.about.vertices,
                ),
                spread <= STEADY,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::turns::{About, Found};
    use super::*;

    #[test]
    fn a_single_short_turn_is_not_steady() {
        let passes = |turns_ms: [f64; 3]| {
            let mut row = row("other", 1.0);
            row.found.as_mut().unwrap().turns_ms = turns_ms.into();
            let mut checks = Checks::default();
            steady(&[row], &mut checks);
            checks.pass()
        };
        assert!(passes([5.0, 1.2, 1.0]));
        assert!(!passes([1.3, 1.0, 1.3]) && !passes([f64::NAN, 1.0, f64::NAN]));
    }

    fn row(name: &'static str, sag_m: f64) -> Row {
        let (version, precision) = (String::new(), String::new());
        let about = About { version, threads: 1, precision, iterations: 1, vertices: 1, edges: 1, tets: 1 };
        let found = Ok(Found { about, ms: 1.0, turns_ms: Vec::new(), sag_m });
        Row { name, order: Order::Lattice, found }
    }

    fn passes(sag_m: f64, wrong_m: f64) -> bool {
        let agreement = Agreement { name: "other", most: 0.1, what: "the same" };
        let mut checks = Checks::default();
        compare(
            &[row(super::super::CUTIS, 1.0), row("other", sag_m)],
            &[agreement],
            "",
            wrong_m,
            &mut checks,
        );
        checks.pass()
    }

    #[test]
    fn a_beam_must_agree_with_ours_and_not_with_the_wrong_one() {
        assert!(passes(1.09, 1.3));
        assert!(!passes(1.11, 1.3) && !passes(0.89, 1.3) && !passes(f64::NAN, 1.3));
        assert!(!passes(1.09, 1.1), "the comparison would not notice the wrong stiffness");
    }
}
