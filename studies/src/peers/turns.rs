//! Lets programs run in turns, and keeps the shortest frame of each.

use serde::{Deserialize, Serialize};

use super::job::Order;
use crate::kit::Failure;

/// What a program says about itself before its first turn.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct About {
    pub version: String,
    pub threads: usize,
    pub precision: String,
    /// Iterations of a frame, or steps of a program that has no iterations.
    pub iterations: u32,
    pub vertices: usize,
    pub edges: usize,
    pub tets: usize,
}

/// Result of a turn.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Turn {
    /// Shortest frame, ms.
    pub ms: f64,
    /// How far the free end has sunk, m.
    pub sag_m: f64,
}

/// A program with a beam. It has run one frame.
pub trait Program {
    /// Name, version and sizes.
    ///
    /// # Errors
    /// The program did not start.
    fn about(&mut self) -> Result<About, Failure>;

    /// Runs the frames of a turn.
    ///
    /// # Errors
    /// The program failed.
    fn turn(&mut self) -> Result<Turn, Failure>;
}

/// A program of the comparison, with a way to start it.
pub struct Entry<'a> {
    /// Name in tables.
    pub name: &'static str,
    /// The order of its mesh.
    pub order: Order,
    /// Starts the program.
    pub start: Box<dyn Fn() -> Result<Box<dyn Program>, Failure> + 'a>,
}

/// A program with its result, or the reason why there is none.
#[derive(Debug)]
pub struct Row {
    pub name: &'static str,
    pub order: Order,
    pub found: Result<Found, String>,
}

/// Result of all turns of a program.
#[derive(Clone, Debug, Serialize)]
pub struct Found {
    pub about: About,
    /// Shortest frame of all turns, ms.
    pub ms: f64,
    /// Shortest frame of each turn, ms.
    pub turns_ms: Vec<f64>,
    /// Sag after the last turn, m.
    pub sag_m: f64,
}

impl Row {
    /// The result, if there is one.
    pub fn found(&self) -> Option<&Found> {
        self.found.as_ref().ok()
    }
}

/// A program that runs, with its result so far.
type Started = (Box<dyn Program>, Found);

/// Starts all programs and lets them run `turns` times, one after the other. A program whose beam
/// has other sizes than that of the first program has failed.
pub fn take(entries: &[Entry<'_>], turns: usize) -> Vec<Row> {
    let mut programs: Vec<Result<Started, String>> =
        entries.iter().map(|entry| start(entry).map_err(|error| format!("{error:#}"))).collect();
    let sizes = |about: &About| [about.vertices, about.edges, about.tets];
    let expected = programs.iter().flatten().map(|(_, found)| sizes(&found.about)).next();
    for program in &mut programs {
        if let Ok((_, found)) = program
            && Some(sizes(&found.about)) != expected
        {
            *program = Err(format!("its beam has the sizes {:?}", sizes(&found.about)));
        }
    }
    for number in 0..turns {
        for (entry, state) in entries.iter().zip(&mut programs) {
            let Ok((program, found)) = state else { continue };
            match program.turn() {
                Ok(Turn { ms, sag_m }) => {
                    let (name, order) = (entry.name, entry.order.name());
                    eprintln!("turn {}: {name} ({order}): {ms:.2} ms, sag {sag_m:.4} m", number + 1);
                    found.turns_ms.push(ms);
                    (found.ms, found.sag_m) = (found.ms.min(ms), sag_m);
                }
                Err(error) => *state = Err(format!("{error:#}")),
            }
        }
    }
    let rows = entries.iter().zip(programs);
    rows.map(|(entry, program)| Row {
        name: entry.name,
        order: entry.order,
        found: program.map(|(_, found)| found),
    })
    .collect()
}

fn start(entry: &Entry<'_>) -> Result<Started, Failure> {
    eprintln!("start: {} ({})", entry.name, entry.order.name());
    let mut program = (entry.start)()?;
    let about = program.about()?;
    Ok((program, Found { about, ms: f64::INFINITY, turns_ms: Vec::new(), sag_m: f64::NAN }))
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use anyhow::bail;

    use super::*;

    /// Takes 5, 4, 3, … ms and notes its turns. Fails in the turn of 3 ms if it is named so.
    struct Fake<'a>(&'static str, f64, &'a RefCell<Vec<&'static str>>);

    impl Program for Fake<'_> {
        fn about(&mut self) -> Result<About, Failure> {
            let vertices = if self.0 == "larger" { 9 } else { 8 };
            let (version, precision) = (String::new(), String::new());
            Ok(About { version, threads: 1, precision, iterations: 1, vertices, edges: 1, tets: 1 })
        }

        fn turn(&mut self) -> Result<Turn, Failure> {
            self.2.borrow_mut().push(self.0);
            self.1 -= 1.0;
            if self.0 == "failing" && self.1 == 3.0 {
                bail!("a reason");
            }
            Ok(Turn { ms: self.1, sag_m: 0.1 * self.1 })
        }
    }

    #[test]
    fn programs_take_turns_and_failures_keep_their_reason() {
        let turns: &'static RefCell<Vec<&str>> = Box::leak(Box::default());
        let entry = |name| Entry {
            name,
            order: Order::Lattice,
            start: Box::new(move || match name {
                "missing" => bail!("not installed"),
                _ => Ok(Box::new(Fake(name, 5.0, turns)) as Box<dyn Program>),
            }),
        };
        let rows = take(&["first", "missing", "failing", "larger"].map(entry), 3);
        assert_eq!(*turns.borrow(), ["first", "failing", "first", "failing", "first"]);
        let found = rows[0].found().unwrap();
        assert_eq!((found.ms, &found.turns_ms[..]), (2.0, &[4.0, 3.0, 2.0][..]));
        assert!((found.sag_m - 0.2).abs() < 1e-12);
        let reasons: Vec<&str> =
            rows[1..].iter().map(|row| row.found.as_ref().unwrap_err().as_str()).collect();
        assert_eq!(reasons, ["not installed", "a reason", "its beam has the sizes [9, 1, 1]"]);
    }
}
