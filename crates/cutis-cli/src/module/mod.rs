//! The program as a command-line module of 3D Slicer.
//!
//! `cutis --xml` describes the module. Slicer then calls the program with the flags of the
//! description and no subcommand.

mod args;
mod progress;
mod xml;

use std::ffi::OsString;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::{CommandFactory, Parser};
use cutis::volume::{Format, PartialFile, ReadOptions, VolumeError};
use cutis::{Error, LoadedScene, Override, RunFolder, RunOptions, Scene};

use args::ModuleArgs;
use progress::ModuleProgress;

const SCENE: &str = include_str!("scene.toml");

/// What 3D Slicer asks for, if it calls the program.
pub(crate) enum Call {
    /// The description of the module.
    Describe,
    /// A run of the module.
    Run,
}

/// Whether the words of a command line are a call by 3D Slicer: `--xml`, or a flag of the module.
pub(crate) fn call(words: &[OsString]) -> Option<Call> {
    let first = words.first()?.to_str()?.strip_prefix("--")?;
    if first == "xml" {
        return (words.len() == 1).then_some(Call::Describe);
    }
    let name = first.split('=').next().unwrap_or_default();
    let command = ModuleArgs::command();
    let is_flag = command.get_arguments().any(|arg| arg.get_long() == Some(name));
    is_flag.then_some(Call::Run)
}

/// Prints the description.
pub(crate) fn describe() {
    crate::terminal::print(xml::description().trim_end());
}

/// Runs the module.
pub(crate) fn run() -> Result<(), Error> {
    let args = ModuleArgs::parse();
    check_outputs(&args)?;
    let loaded = scene(&args)?;
    let (folder, scratch) = match &args.run_folder {
        Some(folder) => (folder.clone(), None),
        None => {
            let scratch = Scratch::new()?;
            (scratch.0.clone(), Some(scratch))
        }
    };
    let options = RunOptions { out: folder.clone(), resume: false };
    let report = cutis::run(&loaded, &options, &ModuleProgress::default())?;
    let files = RunFolder(folder);
    if let Some(path) = &args.output_volume {
        let deformed = cutis::volume::read(files.volume(), &ReadOptions::default())?.volume;
        cutis::volume::write(path, &deformed)?;
    }
    if let Some(path) = &args.output_transform {
        copy(&files.displacement(), path)?;
    }
    if let Some(path) = &args.output_model {
        copy(&files.ply(), path)?;
    }
    if let Some(path) = &args.return_parameter_file {
        let opening = report.wound.as_ref().map_or(0.0, |wound| wound.final_mm);
        let mut file = PartialFile::create(path)?;
        file.write_all(format!("opening = {opening}\n").as_bytes()).map_err(|source| failed(path, source))?;
        file.commit()?;
    }
    drop(scratch);
    Ok(())
}

/// Refuses names of outputs that cannot be written, before the time for a run is spent.
fn check_outputs(args: &ModuleArgs) -> Result<(), Error> {
    let ModuleArgs { output_volume, output_transform, output_model, run_folder, .. } = args;
    if let Some(path) = output_volume {
        Format::of(path)?;
    }
    let named =
        [(output_transform, "nrrd", ".nrrd, which holds the displacement"), (output_model, "ply", ".ply")];
    for (path, extension, expected) in named {
        let Some(path) = path else { continue };
        if path.extension().is_none_or(|found| !found.eq_ignore_ascii_case(extension)) {
            return Err(VolumeError::Extension { path: path.clone(), expected }.into());
        }
    }
    if output_volume.is_none() && output_transform.is_none() && output_model.is_none() && run_folder.is_none()
    {
        let why = "give --outputVolume, --outputTransform, --outputModel or --runFolder".into();
        return Err(Error::Request { what: "nothing to write".into(), why });
    }
    Ok(())
}

/// The scene of a call.
fn scene(args: &ModuleArgs) -> Result<LoadedScene, Error> {
    let mut keys = vec![("volume", format!("{{ path = {} }}", quoted(&args.input_volume)?))];
    if let Some(path) = &args.incision {
        let path = quoted(path)?;
        keys.push(("incision", format!("[{{ markups = {path}, depth_mm = {:?} }}]", args.depth)));
    }
    let outputs = format!(
        "{{ volume = {}, displacement = {}, ply = {}, report = {kept}, pictures = {kept} }}",
        args.output_volume.is_some(),
        args.output_transform.is_some(),
        args.output_model.is_some(),
        kept = args.run_folder.is_some(),
    );
    keys.extend([("output", outputs), ("solver.backend", format!("{:?}", args.backend))]);
    if args.scene.is_none() {
        let part = format!("{:?}", args.body_part);
        keys.extend([("materials", part.clone()), ("constraints.membrane.preset", part)]);
        keys.push(("lattice.spacing_mm", format!("{:?}", args.spacing)));
    }
    let keys: Vec<Override> =
        keys.into_iter().map(|(key, value)| Override { key: key.into(), value }).collect();
    match &args.scene {
        Some(path) => Scene::load(path, &keys),
        None if args.incision.is_none() => Err(Error::Request {
            what: "no incision".into(),
            why: "give its path with --incision, or a scene with --scene".into(),
        }),
        None => Scene::parse(SCENE, Path::new("the module's scene"), Path::new(""), &keys),
    }
}

/// A path as a string of TOML. Strings of JSON are strings of TOML, too.
fn quoted(path: &Path) -> Result<String, Error> {
    let text = path.to_str().ok_or_else(|| Error::Request {
        what: path.display().to_string(),
        why: "the name must be Unicode".into(),
    })?;
    Ok(serde_json::Value::from(text).to_string())
}

/// Copies a file. It appears under its name when it is complete.
fn copy(from: &Path, to: &Path) -> Result<(), Error> {
    let mut source = File::open(from).map_err(|source| failed(from, source))?;
    let mut file = PartialFile::create(to)?;
    std::io::copy(&mut source, &mut file).map_err(|source| failed(to, source))?;
    Ok(file.commit()?)
}

fn failed(path: &Path, source: std::io::Error) -> Error {
    Error::File { path: path.into(), action: "copy", why: source.to_string() }
}

/// A temporary run folder, which is removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Result<Self, Error> {
        let base = std::env::temp_dir();
        for number in 0.. {
            let path = base.join(format!("cutis-module-{}-{number}", std::process::id()));
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(Self(path)),
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => {
                    let action = "create the folder";
                    return Err(Error::File { path, action, why: error.to_string() });
                }
            }
        }
        unreachable!("one of all numbers is free")
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A destructor cannot report an error.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
