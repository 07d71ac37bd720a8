//! What a frame costs: the sizes of the paper's Table 4, and bodies from thousands to millions of
//! tetrahedra. And the time and memory of a whole run on a large CT.

mod memory;
mod scaling;
mod table4;

use std::io::Write;
use std::path::PathBuf;

use clap::Parser;
use serde_json::json;

use crate::kit::{Checks, Failure, Page, Program, Provenance, results, target_dir, write_json};

/// Measures frames at the sizes of the paper, and the cost per constraint over all sizes.
#[derive(Clone, Debug, Parser)]
#[command(name = "speed", bin_name = "cargo xtask study speed")]
pub struct Options {
    /// Only the sizes of the paper's Table 4.
    #[arg(long)]
    pub table4: bool,
    /// Backends of Table 4: cpu, gpu.
    #[arg(long, default_value = "cpu", value_delimiter = ',')]
    pub backends: Vec<String>,
    /// Write all figures to this file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the tables of docs/results/speed.md.
    #[arg(long, conflicts_with = "table4")]
    pub write: bool,
}

/// Tables of the page.
pub const TABLES: [&str; 5] = ["provenance", "table4", "scaling", "memory", "checks"];

/// Measures everything. Returns whether all checks hold.
///
/// # Errors
/// The program fails, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let page = options.write.then(|| Page::open("speed", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "speed --write" } else { "speed" });
    let program = Program::build()?;
    let folder = target_dir()?.join("studies/speed");
    let mut checks = Checks::default();
    let table4 = table4::measure(&program, &options.backends, &folder, &mut checks)?;
    let table = table4::table(&table4).markdown();
    writeln!(out, "{table}")?;
    let (mut scaling, mut memory) = (Vec::new(), Vec::new());
    let [mut scaling_table, mut memory_table] = [String::new(), String::new()];
    if !options.table4 {
        scaling = scaling::measure(&program, &folder, &mut checks)?;
        scaling_table = scaling::table(&scaling).markdown();
        memory = memory::measure(&program, &folder, &mut checks)?;
        memory_table = memory::table(&memory).markdown();
        writeln!(out, "{scaling_table}\n{memory_table}")?;
    }
    checks.print(out)?;
    if let Some(path) = &options.json {
        let figures =
            json!({"provenance": provenance, "table4": table4, "scaling": scaling, "memory": memory});
        write_json(path, &figures)?;
    }
    if let Some(mut page) = page.filter(|_| checks.pass()) {
        page.set("table4", &table)?;
        page.set("scaling", &scaling_table)?;
        page.set("memory", &memory_table)?;
        page.set("provenance", &provenance.markdown())?;
        page.set("checks", &checks.summary())?;
        page.save(&results())?;
    }
    Ok(checks.pass())
}
