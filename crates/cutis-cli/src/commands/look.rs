//! `inspect`, `convert`, `skin`, `phantom` and `render`: commands that simulate nothing.

use std::path::Path;

use cutis::mesh::{SkinMode, SkinReport, Split};
use cutis::render::{Focus, Plane, Side, SliceView, View, raymarch, slice};
use cutis::volume::{Volume, phantom::Phantom, sample::LatticeSize};
use cutis::{Error, FolderInspection, Inspection, Progress, Series, SkinRequest};

use super::pretty;
use crate::args::VolumeArgs;
use crate::terminal::{Terminal, print};

pub(crate) fn inspect(volume: &VolumeArgs, json: bool) -> Result<(), Error> {
    let options = volume.options();
    if volume.path.is_dir() && options.series.is_none() {
        let found = cutis::inspect_folder(&volume.path, &options)?;
        print(&if json { pretty(&found) } else { folder_page(&found) });
    } else {
        let found = cutis::inspect(&volume.path, &options)?;
        print(&if json { pretty(&found) } else { page(&found) });
    }
    Ok(())
}

fn folder_page(found: &FolderInspection) -> String {
    let mut lines: Vec<String> = found.series.iter().map(series_lines).collect();
    if !found.damaged.is_empty() {
        lines.push("files that cannot be read; no series is read as long as they are in the folder:".into());
        lines.extend(found.damaged.iter().map(|what| format!("  {what}")));
    }
    lines.extend(found.notes.iter().map(|note| format!("note: {note}")));
    lines.extend(found.volume.as_ref().map(page));
    lines.join("\n")
}

/// A line for a series, and one for each problem.
fn series_lines(series: &Series) -> String {
    let number = series.number.map_or("-".into(), |number| number.to_string());
    let mut line = format!("series {number}  \"{}\"  {} slices", series.description, series.slices);
    if let (Some([nx, ny]), Some([dx, dy])) = (series.size, series.spacing_mm) {
        line += &format!("  {nx} x {ny} pixels of {dx:.4} x {dy:.4} mm");
    }
    if let Some([least, most]) = series.slice_distance_mm {
        line += &match most - least < 0.0005 {
            true => format!("  {least:.3} mm apart"),
            false => format!("  {least:.3} to {most:.3} mm apart"),
        };
    }
    if let Some([min, max]) = series.hu {
        line += &format!("  HU {min} to {max}");
    }
    if let Some(tilt) = series.tilt_deg.filter(|&tilt| tilt > 0.0) {
        line += &format!("  tilted by {tilt:.1} degrees");
    }
    line += &format!("\n  first file: {}", series.file.display());
    if let Some(problem) = &series.problem {
        line += &format!("\n  not readable: {problem}");
    }
    line
}

pub(crate) fn convert(volume: &VolumeArgs, out: &Path) -> Result<(), Error> {
    let terminal = Terminal::new();
    terminal.begin("convert", 0);
    let notes = cutis::convert(&volume.path, &volume.options(), out)?;
    terminal.end();
    notes.iter().for_each(|note| terminal.note(note));
    print(&out.display().to_string());
    Ok(())
}

fn page(found: &Inspection) -> String {
    let [nx, ny, nz] = found.shape;
    let [sx, sy, sz] = found.spacing_mm;
    let mut lines = vec![
        format!("shape        {nx} x {ny} x {nz}"),
        format!("spacing      {sx:.4} x {sy:.4} x {sz:.4} mm"),
        format!("orientation  {}", found.orientation),
        format!("dtype        {}", found.dtype),
        format!("HU           {} to {}", found.hu_min, found.hu_max),
        "index to RAS+ mm".into(),
    ];
    lines.extend(
        found.affine[..3].iter().map(|row| row.iter().map(|v| format!("{v:12.4}")).collect::<String>()),
    );
    if found.nan_count > 0 {
        lines.push(format!("NaN voxels   {}", found.nan_count));
    }
    lines.extend(found.warnings.iter().map(|warning| format!("note: {warning}")));
    lines.join("\n")
}

pub(crate) fn skin(
    volume: &VolumeArgs,
    lattice: LatticeSize,
    mode: SkinMode,
    split: Split,
    offset_hu: f32,
    out: Option<&Path>,
    json: bool,
) -> Result<(), Error> {
    let request = SkinRequest { read: volume.options(), lattice, split, mode, offset_hu };
    let report = cutis::find_skin(&volume.path, &request, out, &Terminal::new())?;
    print(&if json { pretty(&report) } else { skin_page(&report, out) });
    Ok(())
}

fn skin_page(report: &SkinReport, out: Option<&Path>) -> String {
    let mut lines = vec![
        format!("lattice vertices     {}", report.vertices),
        format!(
            "tetrahedra           {} (with 0 to 4 air vertices: {:?})",
            report.tets, report.air_vertex_histogram
        ),
        format!("skin triangles       {} ({} found twice)", report.triangles, report.duplicates),
        format!(
            "components           {}, Euler characteristic {}",
            report.components, report.euler_characteristic
        ),
        format!(
            "open edges           {} ({} of them where the scan ends)",
            report.open_edges, report.open_edges_on_box
        ),
        format!("non-manifold edges   {}", report.non_manifold_edges),
        format!("enclosed share       {:.1} %", 100.0 * report.enclosed_share),
        format!("coverage             {:.1} % of the iso-surface", 100.0 * report.coverage),
    ];
    lines.extend(out.map(|out| format!("written              {}", out.display())));
    lines.join("\n")
}

pub(crate) fn phantom(size: [usize; 3], seed: u64, turn_deg: &[f64], out: &Path) -> Result<(), Error> {
    let mut phantom = Phantom::new(size, seed)?;
    if let &[x, y, z] = turn_deg {
        phantom = phantom.turned([x, y, z])?;
    }
    let terminal = Terminal::new();
    terminal.begin("make the phantom", size[2] as u64);
    phantom.write(out, &|done, _total| terminal.advance(done as u64))?;
    terminal.end();
    let (from, to) = phantom.incision_site();
    print(&format!("{}\na good place to cut: from_mm = {from:.1?}, to_mm = {to:.1?}", out.display()));
    Ok(())
}

/// Options of `cutis render`.
pub(crate) struct Look {
    pub(crate) side: Side,
    pub(crate) slice: Option<String>,
    pub(crate) window: String,
    pub(crate) focus: Option<String>,
    pub(crate) zoom: Option<f64>,
    pub(crate) pixels: usize,
}

/// Draws a volume and writes a PNG.
pub(crate) fn render(volume: &VolumeArgs, out: &Path, look: &Look) -> Result<(), Error> {
    let focus = match (&look.focus, look.zoom) {
        (Some(text), Some(size_mm)) => {
            Some(Focus { center_mm: numbers("--focus", text, ',', "x,y,z in mm")?, size_mm })
        }
        _ => None,
    };
    let [level_hu, window_hu] =
        numbers("--window", &look.window, '/', "level/width in HU, for example 40/400")?;
    let slice_at = look.slice.as_deref().map(plane).transpose()?;
    if out.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("png")) {
        return Err(Error::Request {
            what: format!("--out {}", out.display()),
            why: "must end in .png, the only format of pictures".into(),
        });
    }
    let terminal = Terminal::new();
    terminal.begin("read the CT", 0);
    let volume = cutis::volume::read(&volume.path, &volume.options())?.volume;
    terminal.end();
    terminal.begin("draw", 0);
    let image = match slice_at {
        Some((plane, at_mm)) => {
            require_inside(&volume, plane, at_mm)?;
            let (window_hu, level_hu) = (window_hu as f32, level_hu as f32);
            let long_side = Some(look.pixels);
            slice(
                &volume,
                &SliceView { window_hu, level_hu, focus, long_side, ..SliceView::new(plane, at_mm) },
            )?
        }
        None => {
            let (width, height) = (look.pixels, look.pixels);
            raymarch(&volume, &View { width, height, focus, ..View::new(look.side) })?
        }
    };
    image.write_png(out)?;
    terminal.end();
    print(&out.display().to_string());
    Ok(())
}

/// Refuses a plane that does not meet the scan.
fn require_inside(volume: &Volume, plane: Plane, at_mm: f64) -> Result<(), Error> {
    let (name, axis) = match plane {
        Plane::Sagittal => ("sagittal", 0),
        Plane::Coronal => ("coronal", 1),
        Plane::Axial => ("axial", 2),
    };
    let grid = volume.grid();
    let corner = |n: usize| {
        let index = std::array::from_fn(|axis| if n >> axis & 1 == 1 { grid.shape[axis] - 1 } else { 0 });
        grid.mm(index)[axis]
    };
    let (low, high) = (0..8)
        .map(corner)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mm| (low.min(mm), high.max(mm)));
    if (low..=high).contains(&at_mm) {
        return Ok(());
    }
    Err(Error::Request {
        what: format!("--slice {name}@{at_mm}"),
        why: format!("the scan has nothing there; it goes from {low:.1} to {high:.1} mm"),
    })
}

/// Parses a slice such as `axial@120`.
fn plane(text: &str) -> Result<(Plane, f64), Error> {
    let parsed = text.split_once('@').and_then(|(name, at)| {
        let plane = match name {
            "axial" => Plane::Axial,
            "coronal" => Plane::Coronal,
            "sagittal" => Plane::Sagittal,
            _ => return None,
        };
        Some((plane, at.parse().ok()?))
    });
    parsed.ok_or_else(|| Error::Request {
        what: format!("--slice {text}"),
        why: "must be axial@MM, coronal@MM or sagittal@MM, for example axial@120".into(),
    })
}

/// Parses `N` numbers with `separator` between them.
fn numbers<const N: usize>(
    option: &str,
    text: &str,
    separator: char,
    expected: &str,
) -> Result<[f64; N], Error> {
    let parsed: Option<Vec<f64>> = text.split(separator).map(|part| part.trim().parse().ok()).collect();
    parsed.and_then(|parts| parts.try_into().ok()).ok_or_else(|| Error::Request {
        what: format!("{option} {text}"),
        why: format!("must be {expected}"),
    })
}
