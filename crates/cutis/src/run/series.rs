//! The skin after some of the frames, and at rest, as a time series for ParaView.

use std::fs;
use std::path::{Path, PathBuf};

use cutis_mesh::vtk::{self, Cells, DataArray, Piece, Space, Values};
use cutis_mesh::write_pvd;
use nalgebra::Point3;

use super::files::{self, RunFolder};
use crate::Error;
use crate::body::Body;
use crate::model::Simulation;

/// Writes the skin before the first frame, after every so many frames, and in each state of rest.
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
    /// first, because nothing could resume from it without the files of the series. `rests` tells
    /// whether this run has states of rest of the earlier one.
    pub(super) fn begin(&self, resumed: bool, rests: bool) -> Result<(), Error> {
        if !resumed {
            remove_file(&self.folder.checkpoint())?;
            remove(self.folder)?;
        }
        // A run that goes on with frames searches the states of rest again, and may find fewer.
        let at_rest = |path: &&PathBuf| !rests && is_of_series(path, REST);
        for path in paths(&self.folder.series_folder()).iter().filter(at_rest) {
            remove_file(path)?;
        }
        files::create_folder(&self.folder.series_folder())
    }

    /// Writes the skin if it is due after this frame. `last` is the last frame of the run.
    pub(super) fn frame(&self, simulation: &mut dyn Simulation, frame: u32, last: u32) -> Result<(), Error> {
        if !self.is_due(frame, last) {
            return Ok(());
        }
        self.write(simulation, &name(FRAME, frame))
    }

    /// Writes the skin in a state of rest. The first one has the number 1.
    pub(super) fn rest(&self, simulation: &mut dyn Simulation, number: usize) -> Result<(), Error> {
        self.write(simulation, &name(REST, number as u32))
    }

    fn write(&self, simulation: &mut dyn Simulation, name: &str) -> Result<(), Error> {
        let vertices: Vec<u32> = (0..self.body.mesh.positions.len() as u32).collect();
        let (now, _) = self.body.whole_skin(&simulation.positions_of(&vertices)?);
        let moved = |(rest, now): (&Point3<f32>, &Point3<f32>)| ((now - rest) * 1000.0).into();
        let displacement: Vec<[f32; 3]> = self.rest.iter().zip(&now).map(moved).collect();
        let data = [DataArray { name: "displacement_mm", values: Values::Vectors(&displacement) }];
        let cells = Cells::Triangles(&self.triangles);
        let frame_of = &self.body.mesh.frame;
        let piece = Piece { frame: frame_of, positions: &now, cells, data: &data, cell_data: &[] };
        let path = self.folder.series_folder().join(name);
        Ok(vtk::write_vtp(&path, Space::default(), &piece)?)
    }

    /// Writes the list of the files. `dt_s` is the duration of a frame. States of rest have no
    /// time: each one is listed a frame after the state before it.
    pub(super) fn finish(&self, last: u32, rests: usize, dt_s: f64) -> Result<(), Error> {
        let folder = self.folder.series_folder();
        let frames = (0..=last).filter(|&frame| self.is_due(frame, last)).map(|frame| (frame, FRAME, frame));
        let rests = (1..=rests as u32).map(|number| (last + number, REST, number));
        let list: Vec<(f64, String)> = frames
            .chain(rests)
            .map(|(at, kind, number)| (f64::from(at) * dt_s, name(kind, number)))
            .filter(|(_, name)| folder.join(name).exists())
            .map(|(time_s, name)| (time_s, format!("{FOLDER}/{name}")))
            .collect();
        Ok(write_pvd(&self.folder.series(), &list)?)
    }

    fn is_due(&self, frame: u32, last: u32) -> bool {
        frame.is_multiple_of(self.every) || frame == last
    }
}

/// The folder with the files of a series.
const FOLDER: &str = "skin-series";

/// Beginnings of the names of frames and of states of rest.
const FRAME: &str = "skin-";
const REST: &str = "skin-rest-";

fn name(kind: &str, number: u32) -> String {
    format!("{kind}{number:06}.vtp")
}

/// Whether a file of the folder is one of a series.
fn is_of_series(path: &Path, kind: &str) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let number = name.strip_prefix(kind).and_then(|rest| rest.strip_suffix(".vtp"));
    number.is_some_and(|number| number.len() >= 6 && number.bytes().all(|byte| byte.is_ascii_digit()))
}

/// Removes the files of a series, and their folder if nothing else is in it.
pub(super) fn remove(folder: &RunFolder) -> Result<(), Error> {
    let inside = folder.series_folder();
    let of_series = |path: &PathBuf| [FRAME, REST].iter().any(|kind| is_of_series(path, kind));
    for path in paths(&inside).into_iter().filter(of_series).chain([folder.series()]) {
        remove_file(&path)?;
    }
    // A folder with files of the user stays.
    let _ = fs::remove_dir(inside);
    Ok(())
}

/// The files of a folder. None if it does not exist.
fn paths(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder);
    entries.map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect()).unwrap_or_default()
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
        for file in ["skin-000010.vtp", "skin-rest-000001.vtp", "skin-rest-mine.vtp", "notes.txt"] {
            fs::write(inside.join(file), "").unwrap();
        }
        fs::write(folder.series(), "").unwrap();
        remove(&folder).unwrap();
        let mut left: Vec<_> =
            fs::read_dir(&inside).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, ["notes.txt", "skin-rest-mine.vtp"]);
        assert!(!folder.series().exists());
    }
}
