//! The tables of the trials, and their page.

use std::fmt::Write as _;

use super::super::page::Origin;
use super::super::words::percent;
use super::{LEVELS, MOST_SWEEPS, Outcome, SUBSTEPS};

/// The trials on one problem.
pub struct Tried {
    /// Its name.
    pub problem: &'static str,
    /// In words.
    pub what: String,
    /// Nodes of the grid of the coarse start.
    pub nodes: usize,
    /// What came of them.
    pub outcomes: Vec<Outcome>,
}

impl Tried {
    /// Sweeps to each level, recipe by recipe.
    pub fn table(&self) -> String {
        let mut text = String::from("| recipe |");
        for substeps in SUBSTEPS {
            let _ = write!(text, " {substeps} substeps |");
        }
        text += "\n|---|---|---|---|---|\n";
        let mut names: Vec<&str> = Vec::new();
        for outcome in &self.outcomes {
            if !names.contains(&outcome.name.as_str()) {
                names.push(&outcome.name);
            }
        }
        for name in names {
            let _ = write!(text, "| {name} |");
            for substeps in SUBSTEPS {
                let found = self.outcomes.iter().find(|o| o.name == name && o.substeps == substeps);
                let _ = write!(text, " {} |", found.map_or_else(String::new, cell));
            }
            text.push('\n');
        }
        text
    }
}

/// `12 / 34`; for a level that is not reached, the least error instead.
fn cell(outcome: &Outcome) -> String {
    let sweeps = |n: Option<usize>| n.map_or_else(|| "never".into(), |n| n.to_string());
    match outcome.sweeps {
        [None, _] if !outcome.last.is_finite() || outcome.last > 10.0 => "diverges".into(),
        [None, _] => format!("never ({})", percent(outcome.least)),
        [one, two] => format!("{} / {}", sweeps(one), sweeps(two)),
    }
}

/// The page.
pub fn page(origin: &Origin, tried: &[Tried]) -> String {
    let [one, two] = LEVELS.map(percent);
    let mut text = format!(
        "# Accelerations that were tried\n\n\
         Written by `{}` at commit {}. All figures are from [accelerations.csv](accelerations.csv); they are counts, which no \
         machine changes.\n\n\
         How many sweeps an implicit substep takes until its error E1 (see [accuracy.md](accuracy.md)) stays below {one} / {two}, \
         serially and in `f64`, of at most {MOST_SWEEPS}. The moment is the first instant of the problem, when the body moves most. \
         In brackets the least error where {one} is not reached. What a recipe costs beside its sweeps (dot products of \
         Anderson's, the coarse solution) is left out, in favor of the recipes.\n\n\
         - *ω*: each change is taken so many times.\n\
         - *there and back*: every other sweep goes through the colors backwards, as in symmetric Gauss–Seidel.\n\
         - *half there, half back*: the second half of the sweeps does; their number was raised by a quarter at a time.\n\
         - *Chebyshev ρ*: semi-iterative weights for an assumed spectral radius, from the second sweep on.\n\
         - *Anderson m*: the combination of the last m + 1 iterates whose changes cancel best; for XPBD the multipliers are combined \
         with the same weights.\n\
         - *coarse start*: the substep is first minimized among the displacements that a grid of {COARSER} times the lattice's mean \
         edge interpolates, by Gauss–Newton to its end; a multilevel method could start from nothing better.\n",
        origin.command,
        origin.commit.as_deref().unwrap_or("unknown"),
        COARSER = super::COARSER,
    );
    for of_problem in tried {
        let Tried { problem, what, nodes, outcomes } = of_problem;
        let _ = write!(text, "\n## {problem}\n\nThe problem: {what}. The coarse grid has {nodes} nodes");
        for substeps in SUBSTEPS {
            let starts = ["vbd", "vbd, coarse start"].map(|name| {
                let found = outcomes.iter().find(|o| o.substeps == substeps && o.name == name);
                found.map_or_else(String::new, |o| percent(o.at_start))
            });
            let _ = write!(
                text,
                "; with {substeps} substeps its start is off by {}, the plain one by {}",
                starts[1], starts[0]
            );
        }
        text += ".\n\n";
        text += &of_problem.table();
    }
    text
}

/// The table as CSV.
pub fn csv(tried: &[Tried]) -> String {
    let mut text =
        String::from("problem,substeps,recipe,e1_at_start,sweeps_to_0.01,sweeps_to_0.001,least_e1,last_e1\n");
    for Tried { problem, outcomes, .. } in tried {
        for Outcome { substeps, name, at_start, sweeps, least, last } in outcomes {
            let [one, two] = sweeps.map(|n| n.map_or_else(String::new, |n| n.to_string()));
            let name = name.replace(", ", " + ");
            let _ = writeln!(
                text,
                "{problem},{substeps},{name},{at_start:.4e},{one},{two},{least:.4e},{last:.4e}"
            );
        }
    }
    text
}
