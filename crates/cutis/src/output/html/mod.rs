//! `report.html`: the report for people, one file with pictures, plots and a view of the skin that
//! turns and plays.
//!
//! The page needs no other file and no network: its policy forbids both. Its script and its style
//! are the files in `assets`. Without scripts or WebGL 2 the pictures stay.

mod data;
mod page;
mod plots;
mod summary;
mod table;
mod tables;
pub(crate) mod text;

use std::path::PathBuf;

use super::report::Report;
use super::slices::SlicePair;
use super::surface::Recorder;
use crate::Error;
use crate::body::Body;
use crate::run::files::{self, RunFolder};
use crate::run::frames::FrameRow;

use data::Data;
use page::Page;
use plots::Quantity;

/// A picture of the page.
pub(crate) struct Figure {
    /// Its file in the run folder.
    pub(crate) path: fn(&RunFolder) -> PathBuf,
    pub(crate) caption: &'static str,
    /// Whether it takes the whole width of the page instead of half.
    pub(crate) wide: bool,
    /// The picture as a PNG file.
    pub(crate) png: Vec<u8>,
    /// A smaller one for the page, if the picture is large.
    pub(crate) small: Option<Vec<u8>>,
}

/// What the page shows in addition to the report.
pub(crate) struct Shown<'a> {
    pub(crate) body: &'a Body,
    pub(crate) rows: &'a [FrameRow],
    pub(crate) figures: &'a [Figure],
    pub(crate) slices: &'a [SlicePair],
}

/// Bytes of a page above which states of the surface are left out.
const MOST_BYTES: usize = 8_000_000;

/// Writes `report.html`, with the states of the surface that fit. There is no surface without a
/// skin.
///
/// # Errors
/// [`Error::File`] if it cannot be written.
pub(crate) fn write(
    report: &Report,
    shown: &Shown<'_>,
    recorder: Option<&mut Recorder>,
    folder: &RunFolder,
) -> Result<(), Error> {
    let rows = plots::shown_rows(shown.rows);
    let quantities = shown.rows.first().map(Quantity::of).unwrap_or_default();
    let page = Page {
        report,
        figures: shown.figures,
        slices: shown.slices,
        rows: shown.rows,
        over_time: &plots::over_time(&quantities, &rows),
        search: report.rest.as_ref().and_then(plots::search),
        has_view: recorder.is_some(),
        resumed: recorder.as_ref().and_then(|recorder| recorder.resumed),
        scene: &toml::to_string(&report.scene).unwrap_or_else(|e| e.to_string()),
    };
    let data = |bytes: usize| {
        recorder.map_or_else(String::new, |recorder| {
            let data = |recorder: &Recorder| Data::of(shown.body, recorder, &quantities, &rows);
            // Base64 has four letters for three bytes.
            let rest = bytes + data(recorder).elements_without_surface().len();
            recorder.thin(MOST_BYTES.saturating_sub(rest) / 4 * 3);
            data(recorder).elements()
        })
    };
    files::write(&folder.html(), page.html(data).as_bytes())
}
