//! `inspect`, `skin`, `phantom` and `render`: commands that simulate nothing.

use std::path::Path;

use cutis::mesh::{SkinMode, SkinReport, Split};
use cutis::render::{Focus, Plane, Side, SliceView, View, raymarch, slice};
use cutis::volume::{nifti, phantom::Phantom, sample::LatticeSize};
use cutis::{Error, Inspection, Progress, SkinRequest};

use super::pretty;
use crate::terminal::{Terminal, print};

pub(crate) fn inspect(volume: &Path, json: bool) -> Result<(), Error> {
    let found = cutis::inspect(volume)?;
    print(&if json { pretty(&found) } else { page(&found) });
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
    volume: &Path,
    lattice: LatticeSize,
    mode: SkinMode,
    split: Split,
    out: Option<&Path>,
    json: bool,
) -> Result<(), Error> {
    let request = SkinRequest { lattice, split, mode };
    let report = cutis::find_skin(volume, &request, out, &Terminal::new())?;
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
pub(crate) fn render(volume: &Path, out: &Path, look: &Look) -> Result<(), Error> {
    let focus = match (&look.focus, look.zoom) {
        (Some(text), Some(size_mm)) => {
            Some(Focus { center_mm: numbers("--focus", text, ',', "x,y,z in mm")?, size_mm })
        }
        _ => None,
    };
    let [level_hu, window_hu] =
        numbers("--window", &look.window, '/', "level/width in HU, for example 40/400")?;
    let slice_at = look.slice.as_deref().map(plane).transpose()?;
    let terminal = Terminal::new();
    terminal.begin("read the CT", 0);
    let volume = nifti::read(volume)?.volume;
    terminal.end();
    terminal.begin("draw", 0);
    let image = match slice_at {
        Some((plane, at_mm)) => {
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
