//! The skin after some of the frames, as a time series for ParaView.

use std::fs;
use std::path::{Path, PathBuf};

use cutis_mesh::vtk::{self, Cells, DataArray, Piece, Space, Values};
use cutis_mesh::write_pvd;
use nalgebra::Point3;

use super::files::{self, RunFolder};
use crate::Error;
use crate::body::Body;
use crate::model::Simulation;

/// Writes the skin before the first frame and after every so many frames.
pub(super) struct Series<'a> {
    folder: &'a RunFolder,
    body: &'a Body,
    every: u32,
    /// The skin in the scan, and its triangles.
    rest: Vec<Point3<f32>>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> Series<'a> {
    /// A series of a run. None if `every` is 0.
    pub(super) fn of(folder: &'a RunFolder, body: &'a Body, every: u32) -> Option<Self> {
        (every > 0).then(|| {
            let (rest, triangles) = body.whole_skin(&body.mesh.positions);
            Self { folder, body, every, rest, triangles }
        })
    }

    /// Removes the files of an earlier run that this run does not continue. Its checkpoint goes
    /// first, because nothing could resume from it without the files of the series.
    pub(super) fn begin(&self, resumed: bool) -> Result<(), Error> {
        if !resumed {
            remove_file(&self.folder.checkpoint())?;
            remove(self.folder)?;
        }
        files::create_folder(&self.folder.series_folder())
    }

    /// Writes the skin if it is due after this frame. `last` is the last frame of the run.
    pub(super) fn frame(&self, simulation: &mut dyn Simulation, frame: u32, last: u32) -> Result<(), Error> {
        if !self.is_due(frame, last) {
            return Ok(());
        }
        let vertices: Vec<u32> = (0..self.body.mesh.positions.len() as u32).collect();
        let (now, _) = self.body.whole_skin(&simulation.positions_of(&vertices)?);
        let moved = |(rest, now): (&Point3<f32>, &Point3<f32>)| ((now - rest) * 1000.0).into();
        let displacement: Vec<[f32; 3]> = self.rest.iter().zip(&now).map(moved).collect();
        let data = [DataArray { name: "displacement_mm", values: Values::Vectors(&displacement) }];
        let cells = Cells::Triangles(&self.triangles);
        let frame_of = &self.body.mesh.frame;
        let piece = Piece { frame: frame_of, positions: &now, cells, data: &data, cell_data: &[] };
        let path = self.folder.series_folder().join(name(frame));
        Ok(vtk::write_vtp(&path, Space::default(), &piece)?)
    }

    /// Writes the list of the files. `dt_s` is the duration of a frame.
    pub(super) fn finish(&self, last: u32, dt_s: f64) -> Result<(), Error> {
        let folder = self.folder.series_folder();
        let relative = |frame: u32| format!("{FOLDER}/{}", name(frame));
        let written =
            (0..=last).filter(|&frame| self.is_due(frame, last) && folder.join(name(frame)).exists());
        let list: Vec<(f64, String)> =
            written.map(|frame| (f64::from(frame) * dt_s, relative(frame))).collect();
        Ok(write_pvd(&self.folder.series(), &list)?)
    }

    fn is_due(&self, frame: u32, last: u32) -> bool {
        frame.is_multiple_of(self.every) || frame == last
    }
}

/// The folder with the files of a series.
const FOLDER: &str = "skin-series";

fn name(frame: u32) -> String {
    format!("skin-{frame:06}.vtp")
}

/// Whether a file of the folder is one of a series.
fn is_of_series(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let number = name.strip_prefix("skin-").and_then(|rest| rest.strip_suffix(".vtp"));
    number.is_some_and(|number| number.len() >= 6 && number.bytes().all(|byte| byte.is_ascii_digit()))
}

/// Removes the files of a series, and their folder if nothing else is in it.
pub(super) fn remove(folder: &RunFolder) -> Result<(), Error> {
    let inside = folder.series_folder();
    let paths: Vec<PathBuf> = fs::read_dir(&inside)
        .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
        .unwrap_or_default();
    for path in paths.into_iter().filter(|path| is_of_series(path)).chain([folder.series()]) {
        remove_file(&path)?;
    }
    // A folder with files of the user stays.
    let _ = fs::remove_dir(inside);
    Ok(())
}

/// Removes a file if it exists.
fn remove_file(path: &Path) -> Result<(), Error> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::File { path: path.into(), action: "remove", why: error.to_string() })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_a_series_are_removed() {
        let here = tempfile::tempdir().unwrap();
        let folder = RunFolder(here.path().into());
        remove(&folder).unwrap();
        let inside = folder.series_folder();
        fs::create_dir(&inside).unwrap();
        for file in ["skin-000010.vtp", "skin-mine.vtp", "notes.txt"] {
            fs::write(inside.join(file), "").unwrap();
        }
        fs::write(folder.series(), "").unwrap();
        remove(&folder).unwrap();
        let mut left: Vec<_> =
            fs::read_dir(&inside).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, ["notes.txt", "skin-mine.vtp"]);
        assert!(!folder.series().exists());
    }
}
