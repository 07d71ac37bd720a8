//! How many instructions the inner loops execute per constraint and per vertex, by Valgrind.
//!
//! Instructions do not depend on the load of the machine, so that a loop that lost its SIMD lanes,
//! its runs or its teams is found on any machine. They say nothing about memory: `cargo bench` and
//! the study `speed` measure time. The program starts itself under Callgrind, with few and with
//! more frames, so that the work before the first frame cancels out.

use std::io::Write;
use std::process::Command;

use anyhow::{Context, ensure};
use clap::Parser;
use cutis::coloring::Groups;
use cutis::constraints::{Distance, SimdLevel, Volume};
use cutis::solver::{Formulation, Settings, Solver, SolverReference, Stiffness, System, SystemBuilder};
use cutis::solver_cpu::SolverCpu;
use cutis_test_kit::Kuhn;

use crate::kit::{Checks, Failure, Table};

/// Counts the instructions of the sweeps over constraints and vertices.
#[derive(Clone, Debug, Parser)]
#[command(name = "instructions", bin_name = "cargo xtask study instructions")]
pub struct Options {
    /// Only run the loops of this case, for Valgrind.
    #[arg(long, hide = true, requires = "frames")]
    case: Option<String>,
    /// Number of frames of the case.
    #[arg(long, hide = true)]
    frames: Option<usize>,
    /// Number of SIMD lanes of the case; 1 is the scalar reference.
    #[arg(long, hide = true, default_value_t = 1)]
    lanes: usize,
}

/// Vertices along each axis.
const SIZE: [usize; 3] = [33, 17, 12];
/// Iterations of a frame.
const ITERATIONS: u32 = 4;
/// Numbers of frames. The difference counts.
const FRAMES: [usize; 2] = [1, 3];

/// A loop with its limits.
struct Case {
    name: &'static str,
    formulation: Formulation,
    edges: bool,
    tets: bool,
    /// Largest number of instructions per constraint, or per vertex in vertex block descent, and
    /// iteration, with 4 and with 8 lanes: 5 % above what was counted with Rust 1.95.
    most: [f64; 2],
}

const CASES: [Case; 4] = [
    Case { name: "edges-pbd", formulation: Formulation::Pbd, edges: true, tets: false, most: [119.9, 50.3] },
    Case { name: "tets-pbd", formulation: Formulation::Pbd, edges: false, tets: true, most: [236.9, 94.0] },
    Case {
        name: "edges-xpbd",
        formulation: Formulation::Xpbd,
        edges: true,
        tets: false,
        most: [136.7, 58.2],
    },
    Case {
        name: "vertices-vbd",
        formulation: Formulation::Vbd,
        edges: true,
        tets: true,
        most: [8425.0, 4640.0],
    },
];

/// Counts all cases and compares them with their limits. The loop with fewer lanes must exceed a
/// limit. Edges in four lanes take as many instructions as scalars, because the lanes of every
/// x86-64 processor have no instruction to select: their limit only finds a longer loop.
///
/// # Errors
/// Valgrind is missing or failed, or the output cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    if let (Some(name), Some(frames)) = (&options.case, options.frames) {
        let case = CASES.iter().find(|case| case.name == name).context("no such case")?;
        case.work(frames, options.lanes)?;
        return Ok(true);
    }
    let mut table = Table::new(["loop", "scalar reference", "4 lanes", "8 lanes"]);
    let mut checks = Checks::default();
    for case in &CASES {
        let scalar = case.count(1)?;
        let mut row = vec![case.name.to_owned(), format!("{scalar:.1}")];
        let mut fewer = case.tets.then_some((1, scalar));
        for (lanes, most) in [4, 8].into_iter().zip(case.most) {
            if level(lanes).is_none() {
                row.push("this processor has none".to_owned());
                continue;
            }
            let count = case.count(lanes)?;
            row.push(format!("{count:.1}"));
            let name = case.name;
            checks.add(
                format!("{name}, {lanes} lanes: {count:.1} instructions, at most {most}"),
                count <= most,
            );
            if let Some((lanes, count)) = fewer {
                let what = format!("{name}, {lanes} lanes: {count:.1} instructions, more than {most}");
                checks.control(what, count > most);
            }
            fewer = Some((lanes, count));
        }
        table.add(row);
    }
    writeln!(out, "{}", table.markdown())?;
    checks.print(out)?;
    Ok(checks.pass())
}

/// The level with this number of lanes in `f32`, if the processor has it.
fn level(lanes: usize) -> Option<SimdLevel> {
    SimdLevel::available().into_iter().find(|level| level.lanes() == lanes)
}

impl Case {
    /// Runs frames of a block of a lattice on one thread.
    fn work(&self, frames: usize, lanes: usize) -> Result<(), Failure> {
        let settings = Settings {
            formulation: self.formulation,
            dt_s: 0.005,
            substeps: 1,
            iterations: ITERATIONS,
            gravity_m_s2: [0.0, -9.81, 0.0],
            ..Settings::default()
        };
        let system = self.system()?;
        if lanes == 1 {
            SolverReference::new(system, settings)?.step(frames)?;
        } else {
            let level = level(lanes).context("this processor does not have these lanes")?;
            SolverCpu::new(system, settings, Some(1))?.with_level(level).step(frames)?;
        }
        Ok(())
    }

    fn system(&self) -> Result<System<f32>, Failure> {
        let lattice = Kuhn::new(SIZE, 0.1);
        let masses: Vec<f32> = lattice.positions.iter().map(|p| if p.x == 0.0 { 0.0 } else { 1.0 }).collect();
        let stiffness = |compliance| match self.formulation {
            Formulation::Pbd => Stiffness::pbd(1.0),
            Formulation::Xpbd | Formulation::Vbd => Stiffness::compliance(compliance),
        };
        let [nx, ny, _] = SIZE;
        let color = |n: usize| ((n % nx + n / nx % ny + n / nx / ny) % 4) as u16;
        let colors: Vec<u16> = (0..masses.len()).map(color).collect();
        let builder = SystemBuilder::new(&lattice.positions, &masses)?;
        let mut builder = builder.vertex_groups(Groups::from_colors(&colors)?);
        if self.edges {
            let groups = Groups::from_colors(&lattice.edge_colors)?;
            let (edges, material) = (&lattice.edges, Default::default());
            builder = builder.add_from_rest::<Distance, 2>(edges, &material, stiffness(1e-4), &groups)?;
        }
        if self.tets {
            let groups = Groups::from_colors(&lattice.tet_colors)?;
            let (tets, material) = (&lattice.tets, Default::default());
            builder = builder.add_from_rest::<Volume, 4>(tets, &material, stiffness(1e-7), &groups)?;
        }
        Ok(builder.build())
    }

    /// Instructions per constraint, or per vertex, and iteration.
    fn count(&self, lanes: usize) -> Result<f64, Failure> {
        let [few, more] = FRAMES;
        let instructions = self.instructions(more, lanes)?.checked_sub(self.instructions(few, lanes)?);
        let instructions = instructions.context("more frames took fewer instructions")?;
        let system = self.system()?;
        let items = match self.formulation {
            Formulation::Vbd => system.vertices().iter().filter(|vertex| vertex.inverse_mass() > 0.0).count(),
            Formulation::Pbd | Formulation::Xpbd => system.kinds().iter().map(|kind| kind.len()).sum(),
        };
        Ok(instructions as f64 / ((more - few) * items * ITERATIONS as usize) as f64)
    }

    /// Instructions of a whole run of this program with the case.
    fn instructions(&self, frames: usize, lanes: usize) -> Result<u64, Failure> {
        let program = std::env::current_exe().context("the path of this program")?;
        let mut command = Command::new("valgrind");
        command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program);
        command.args(["instructions", "--case", self.name, "--frames", &frames.to_string()]);
        let output = command.args(["--lanes", &lanes.to_string()]).output();
        let output = output.context("cannot start valgrind; on Debian, `apt-get install -y valgrind`")?;
        let text = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "valgrind: {text}");
        collected(&text).with_context(|| format!("no count of instructions in: {text}"))
    }
}

/// The number in the line `==123== Collected : 456` of Callgrind.
fn collected(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.split_once("Collected :"));
    line?.1.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_of_callgrind_is_read() {
        assert_eq!(collected("==7== Events    : Ir\n==7== Collected : 7247606\n==7==\n"), Some(7_247_606));
        assert_eq!(collected("==7== Events    : Ir\n"), None);
    }

    #[test]
    fn each_case_runs_with_each_number_of_lanes() {
        for case in &CASES {
            case.work(1, 1).unwrap();
            SimdLevel::available().iter().for_each(|level| case.work(1, level.lanes()).unwrap());
        }
    }
}
