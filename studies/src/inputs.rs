//! What happens to each real and awkward volume: how it is read, or why it is refused.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Parser;
use cutis::volume::{Loaded, ReadOptions, VolumeError};
use cutis_test_kit::scans;

use crate::kit::{Checks, Failure, Page, Provenance, Table};

/// Reads every volume of the test data, and lists the outcomes.
#[derive(Clone, Debug, Parser)]
#[command(name = "inputs", bin_name = "cargo xtask study inputs")]
pub struct Options {
    /// Write the tables of docs/results/inputs.md.
    #[arg(long)]
    pub write: bool,
}

/// Tables of the page.
pub const TABLES: [&str; 5] = ["provenance", "series", "syntaxes", "nifti", "checks"];

/// Reads all volumes. Returns whether each was read or refused by name.
///
/// # Errors
/// The test data are missing, or a file cannot be written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let mut page = options.write.then(|| Page::open("inputs", &TABLES)).transpose()?;
    let provenance = Provenance::start(if options.write { "inputs --write" } else { "inputs" });
    let folder = scans::folder();
    let (tables, checks) = outcomes(&folder)?;
    for (name, table) in &tables {
        writeln!(out, "{name}\n\n{}", table.markdown())?;
        if let Some(page) = &mut page {
            page.set(name, &table.markdown())?;
        }
    }
    checks.print(out)?;
    if let Some(mut page) = page {
        page.set("provenance", &provenance.markdown())?;
        page.set("checks", &checks.summary())?;
        page.save(&crate::kit::results())?;
    }
    Ok(checks.pass())
}

/// Tables with their names.
pub type Tables = [(&'static str, Table); 3];

/// The tables of outcomes, by name, and the checks.
///
/// # Errors
/// The test data are missing.
pub fn outcomes(folder: &Path) -> Result<(Tables, Checks), Failure> {
    let mut checks = Checks::default();
    let mut series = Table::new(["folder", "as it is", "with `volume.resample`"]);
    for path in entries(&folder.join("dicom"))? {
        let plain = ReadOptions::default();
        let resample = ReadOptions { resample: true, ..plain };
        let cells = [plain, resample].map(|options| outcome(&path, &options, &path, &mut checks));
        series.add([format!("`{}`", name(&path)), cells[0].clone(), cells[1].clone()]);
    }
    let mut syntaxes = Table::new(["transfer syntax", "outcome"]);
    for path in entries(&folder.join("dicom/transfer_syntaxes"))? {
        // Each file alone: together they are slices at one position.
        let alone = tempfile::tempdir()?;
        fs::copy(&path, alone.path().join("slice.dcm"))?;
        let outcome = outcome(alone.path(), &ReadOptions::default(), alone.path(), &mut checks);
        syntaxes.add([syntax(&path), outcome]);
    }
    let mut nifti = Table::new(["file", "outcome"]);
    for path in entries(&folder.join("awkward"))? {
        let outcome = outcome(&path, &ReadOptions::default(), &path, &mut checks);
        nifti.add([format!("`{}`", name(&path)), outcome]);
    }
    checks.control("half of a file is refused", half_is_refused(&folder.join("awkward/plain_i16.nii"))?);
    Ok(([("series", series), ("syntaxes", syntaxes), ("nifti", nifti)], checks))
}

/// Whether the first half of a file is refused.
fn half_is_refused(path: &Path) -> Result<bool, Failure> {
    let bytes = fs::read(path)?;
    let folder = tempfile::tempdir()?;
    let half = folder.path().join("half.nii");
    fs::write(&half, &bytes[..bytes.len() / 2])?;
    Ok(cutis::volume::read(&half, &ReadOptions::default()).is_err())
}

/// Files and folders in order of name.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let list = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = list.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, Failure>>()?;
    paths.sort();
    Ok(paths)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The name of a transfer syntax and its UID, from a file name.
fn syntax(path: &Path) -> String {
    let name = name(path);
    let text = name.trim_start_matches("CTImage.dcm").trim_matches('_').trim_end_matches(".dcm");
    match text.split_once("TransferSyntax_") {
        Some((kind, uid)) => format!("{kind}, {uid}"),
        None => "the original, LittleEndianImplicit, 1.2.840.10008.1.2".into(),
    }
}

/// How a volume is read, or the message of its refusal without the path of the folder.
fn outcome(path: &Path, options: &ReadOptions, hidden: &Path, checks: &mut Checks) -> String {
    let prefix = format!("{}/", hidden.display());
    let parent = format!("{}/", hidden.parent().unwrap_or(hidden).display());
    let read = cutis::volume::read(path, options);
    let label = name(path);
    match read {
        Ok(loaded) => {
            let voxels: f64 = loaded.volume.voxels().iter().map(|&v| f64::from(loaded.volume.hu(v))).sum();
            checks.add(format!("{label} has finite values"), voxels.is_finite());
            describe(&loaded)
        }
        Err(error) => {
            let message = error.to_string();
            checks.add(format!("{label} is refused as bad input"), !matches!(error, VolumeError::Io { .. }));
            checks
                .add(format!("{label} is named: {message}"), message.contains(&hidden.display().to_string()));
            format!("refused: {}", message.replace(&prefix, "").replace(&parent, ""))
        }
    }
}

/// A value with at most three digits after the point.
fn rounded(value: f64) -> f64 {
    (1000.0 * value).round() / 1000.0
}

fn describe(loaded: &Loaded) -> String {
    let grid = loaded.volume.grid();
    let ([nx, ny, nz], [sx, sy, sz]) = (grid.shape, grid.affine.spacing_mm());
    let orientation: String = grid.affine.orientation().iter().collect();
    let mut text = format!(
        "{nx} × {ny} × {nz} voxels of {sx:.3} × {sy:.3} × {sz:.3} mm, {orientation}, {}, {} to {} HU",
        loaded.dtype,
        rounded(loaded.stats.min),
        rounded(loaded.stats.max)
    );
    loaded.warnings.iter().for_each(|warning| text += &format!("; {warning}"));
    text
}
