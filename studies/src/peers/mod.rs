//! The speed of Cutis and of other programs on the same beam, in the same run and in turns.
//!
//! The beam is a block of cubes of six tetrahedra each, fixed at one end. Position-based dynamics
//! with distances on edges and volumes of tetrahedra is compared with pyPBD and with a kernel in
//! numba. Vertex block descent is compared with Newton, which has it too, and with MuJoCo, which
//! solves a similar solid in explicit steps. The scripts of the other programs are in
//! `studies/python/`.

mod beam;
mod checks;
mod job;
mod ours;
mod script;
mod tables;
mod turns;

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::Parser;

use self::checks::Agreement;
use self::job::{Job, Kinds, Order};
use self::ours::Ours;
use self::script::Script;
use self::turns::{Entry, Program, Row};
use crate::kit::{Checks, Failure, Page, Provenance, results, target_dir};

/// Compares the speed of Cutis with other programs.
///
/// `cargo xtask study peers` installs them in an environment of their own in the target folder.
#[derive(Clone, Debug, Parser)]
#[command(name = "peers", bin_name = "cargo xtask study peers")]
pub struct Options {
    /// Only the small beam with position-based dynamics.
    #[arg(long, conflicts_with = "write")]
    pub quick: bool,
    /// Only position-based dynamics, on both beams.
    #[arg(long, conflicts_with = "write")]
    pub projections: bool,
    /// Number of turns of each program. The shortest frame counts.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=25))]
    pub turns: u8,
    /// Python with the packages of studies/python/requirements.txt.
    #[arg(long, value_name = "PROGRAM")]
    pub python: Option<PathBuf>,
    /// Write the tables of docs/results/peers.md.
    #[arg(long)]
    pub write: bool,
}

/// Tables of the page.
pub const TABLES: [&str; 5] = ["provenance", "pbd", "kinds", "vbd", "checks"];

/// Name of Cutis in tables.
const CUTIS: &str = "Cutis";
const NUMBA: &str = "numba";
const PYPBD: &str = "pyPBD";
const NEWTON_SPRINGS: &str = "Newton, springs and volumes";
const NEWTON_SOLID: &str = "Newton, Neo-Hookean";
const MUJOCO: &str = "MuJoCo, explicit steps";

/// Threads of the programs that use several.
const THREADS: usize = 2;
const SMALL: [usize; 3] = [25, 9, 9];
const LARGE: [usize; 3] = [65, 65, 38];
/// Frames in all turns for the small beam, after which the sags are compared.
const FRAMES: [usize; 2] = [75, 200];
/// Frames of a turn for the large beam, for projections and for vertex block descent.
const LARGE_FRAMES: [usize; 2] = [8, 3];

/// How close the sags must be. The same projections in the same order differ by rounding. The order
/// of the constraints changes the result of a few iterations by some percent. The solids are equal
/// only for small strains.
const AGREE: [Agreement; 2] = [
    Agreement { name: NUMBA, most: 1e-4, what: "the same projections in the same order" },
    Agreement { name: PYPBD, most: 0.06, what: "the same projections in another order" },
];
const AGREE_DESCENT: [Agreement; 3] = [
    Agreement { name: NEWTON_SPRINGS, most: 0.05, what: "the same energy" },
    Agreement { name: NEWTON_SOLID, most: 0.12, what: "a similar solid" },
    Agreement { name: MUJOCO, most: 0.12, what: "a similar solid" },
];

/// Measures everything. Returns whether all checks hold.
///
/// # Errors
/// No Python is named, Cutis fails, or a file cannot be written. Another program that fails is
/// listed with its reason.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("peers", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "peers --write" } else { "peers" });
    let python = options.python.as_deref().context("`--python PROGRAM` is needed; xtask passes it")?;
    let run = Run {
        python: std::path::absolute(python)?,
        folder: target_dir()?.join("studies/peers"),
        turns: options.turns.into(),
    };
    let mut checks = Checks::default();

    let [frames, descent_frames] = FRAMES.map(|frames| frames / run.turns);
    let small = Job::pbd(SMALL, frames);
    let rows = run.projections(small);
    let soft = Job { stiffness: 0.8, ..small };
    let wrong_m = Ours::new(&soft, Order::Lattice, THREADS)?.sag_after(run.turns)?;
    checks::compare(&rows, &AGREE, "of stiffness 0.8", wrong_m, &mut checks);
    let mut projections = vec![(small, rows)];
    if options.quick {
        checks::steady(&projections[0].1, &mut checks);
        writeln!(out, "{}", tables::projections(&projections).markdown())?;
        checks.print(out)?;
        return Ok(checks.pass());
    }

    let [large_frames, large_descent_frames] = LARGE_FRAMES;
    let large = Job::pbd(LARGE, large_frames);
    projections.push((large, run.projections(large)));
    let [edges, tets] = [Kinds::Edges, Kinds::Tets].map(|kinds| run.projections(Job { kinds, ..large }));
    let rows = projections.iter().map(|(_, rows)| rows);
    rows.chain([&edges, &tets]).for_each(|rows| checks::steady(rows, &mut checks));
    let mut tables =
        vec![("pbd", tables::projections(&projections)), ("kinds", tables::single_kinds(&edges, &tets))];

    if !options.projections {
        let small = Job::descent(SMALL, descent_frames);
        let rows = run.descents(small);
        let stiff = Job { youngs_pa: 4.0 * small.youngs_pa, bulk_pa: 4.0 * small.bulk_pa, ..small };
        let wrong_m = Ours::new(&stiff, Order::Lattice, THREADS)?.sag_after(run.turns)?;
        checks::compare(&rows, &AGREE_DESCENT, "four times as stiff", wrong_m, &mut checks);
        let large = Job::descent(LARGE, large_descent_frames);
        let descents = [(small, rows), (large, run.descents(large))];
        descents.iter().for_each(|(_, rows)| checks::steady(rows, &mut checks));
        tables.push(("vbd", tables::descents(&descents)));
    }

    for (_, table) in &tables {
        writeln!(out, "{}", table.markdown())?;
    }
    checks.print(out)?;
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        for (name, table) in &tables {
            page.set(name, &table.markdown())?;
        }
        page.set("provenance", &provenance.markdown())?;
        page.set("checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}

/// How programs are started.
struct Run {
    python: PathBuf,
    folder: PathBuf,
    turns: usize,
}

impl Run {
    fn ours(&self, job: Job, order: Order, threads: usize) -> Entry<'_> {
        let start = move || Ok(Box::new(Ours::new(&job, order, threads)?) as Box<dyn Program>);
        Entry { name: CUTIS, order, start: Box::new(start) }
    }

    fn script(
        &self,
        name: &'static str,
        job: &Job,
        order: Order,
        script: &'static str,
        more: &[&str],
    ) -> Entry<'_> {
        let mut arguments = job.arguments();
        let shuffled = (order == Order::Shuffled).then_some("--shuffled");
        let turns = [("--turns", self.turns), ("--threads", THREADS)];
        arguments.extend(turns.into_iter().flat_map(|(name, n)| [name.to_owned(), n.to_string()]));
        arguments.extend(shuffled.iter().chain(more).map(|word| (*word).to_owned()));
        let start = move || {
            let script = Script::start(&self.python, script, &arguments, &self.folder)?;
            Ok(Box::new(script) as Box<dyn Program>)
        };
        Entry { name, order, start: Box::new(start) }
    }

    /// Position-based dynamics.
    fn projections(&self, job: Job) -> Vec<Row> {
        let orders = [Order::Lattice, Order::Shuffled];
        let mut entries: Vec<Entry<'_>> = Vec::new();
        entries.extend(orders.map(|order| self.ours(job, order, THREADS)));
        entries.extend(orders.map(|order| self.script(NUMBA, &job, order, "pbd_numba", &[])));
        entries.push(self.script(PYPBD, &job, Order::Lattice, "pbd_pypbd", &[]));
        turns::take(&entries, self.turns)
    }

    /// Vertex block descent.
    fn descents(&self, job: Job) -> Vec<Row> {
        let newton =
            |name, energy| self.script(name, &job, Order::Lattice, "vbd_newton", &["--energy", energy]);
        let entries = [
            self.ours(job, Order::Lattice, THREADS),
            self.ours(job, Order::Lattice, 1),
            self.ours(job, Order::Shuffled, THREADS),
            newton(NEWTON_SPRINGS, "springs"),
            newton(NEWTON_SOLID, "solid"),
            self.script(MUJOCO, &job, Order::Lattice, "flex_mujoco", &[]),
        ];
        turns::take(&entries, self.turns)
    }
}
