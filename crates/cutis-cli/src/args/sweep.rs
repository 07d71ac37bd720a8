//! The options of `cutis sweep`.

use std::path::PathBuf;

use clap::{Args, value_parser};

/// Options of `cutis sweep`.
#[derive(Clone, Debug, Args)]
pub(crate) struct SweepArgs {
    /// Folder of the sweep [default: the study's name with `-sweep`, in the current folder]
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Cases that run at the same time
    #[arg(long, value_name = "NUMBER", default_value_t = 1, value_parser = value_parser!(u16).range(1..))]
    pub(crate) jobs: u16,
    /// Threads of each case [default: all cores, shared by the cases that run at the same time]
    #[arg(long, value_name = "NUMBER", value_parser = value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
    /// Run only the case with this name, in this process
    #[arg(long, value_name = "NAME", conflicts_with_all = ["list", "dry_run", "table", "jobs"])]
    pub(crate) case: Option<String>,
    /// Print the names of the cases; read no scan and run nothing
    #[arg(long, conflicts_with_all = ["dry_run", "table"])]
    pub(crate) list: bool,
    /// Print which cases would run; run nothing
    #[arg(long, conflicts_with = "table")]
    pub(crate) dry_run: bool,
    /// Write the table and the plots of the cases that are done; run nothing
    #[arg(long)]
    pub(crate) table: bool,
    /// Print as JSON
    #[arg(long)]
    pub(crate) json: bool,
}
