//! `demo`, `run`, `check` and `resample`.

use std::path::{Path, PathBuf};

use cutis::report::{Backend, Report};
use cutis::volume::sample::LatticeSize;
use cutis::{Error, LoadedScene, Override, Progress, ResampleRequest, RunOptions, Scene};

use super::{plan_table, pretty};
use crate::args::{Change, RunArgs};
use crate::interrupt::Interruptible;
use crate::terminal::{self, Terminal, print};

/// Error of the state of rest in the demo.
const DEMO_ERROR: &str = "0.01";

pub(crate) fn demo(out: &Path, change: &Change, json: bool) -> Result<(), Error> {
    let loaded = match change.frames {
        Some(_) => change.applied(cutis::demo(&change.overrides(None))?),
        None => settled(&[("run.until", "rest"), ("run.error", DEMO_ERROR)], change, cutis::demo)?,
    };
    Interruptible { out: out.into(), can_resume: false, resumed: false }.watch();
    finish(&loaded, RunOptions { out: out.into(), resume: false }, json)
}

pub(crate) fn settle(args: RunArgs) -> Result<(), Error> {
    let loaded = settled(&[], &args.change, |overrides| {
        let until = Override { key: "run.until".into(), value: "rest".into() };
        Scene::load(&args.scene, &[overrides, &[until]].concat())
    })?;
    resumable(&loaded, args)
}

/// A scene with keys that the user may change, and without frames.
fn settled(
    keys: &[(&str, &str)],
    change: &Change,
    load: impl Fn(&[Override]) -> Result<LoadedScene, Error>,
) -> Result<LoadedScene, Error> {
    let given = |&(key, value): &(&str, &str)| Override { key: key.into(), value: value.into() };
    let mut overrides: Vec<Override> = [("run.frames", "0")].iter().chain(keys).map(given).collect();
    overrides.extend(change.overrides(None));
    Ok(change.applied(load(&overrides)?))
}

pub(crate) fn run(args: RunArgs) -> Result<(), Error> {
    let RunArgs { scene, change, .. } = &args;
    let loaded = change.applied(Scene::load(scene, &change.overrides(None))?);
    resumable(&loaded, args)
}

/// A run whose state is saved when Ctrl-C ends it.
fn resumable(loaded: &LoadedScene, args: RunArgs) -> Result<(), Error> {
    let RunArgs { scene, out, resume, json, .. } = args;
    let options = RunOptions { out: out.unwrap_or_else(|| folder(&scene)), resume };
    Interruptible { out: options.out.clone(), can_resume: true, resumed: resume }.watch();
    finish(loaded, options, json).inspect_err(|error| {
        if let Error::Interrupted { checkpoint, .. } = error {
            terminal::interrupted(&Interruptible::saved(checkpoint, resume));
        }
    })
}

/// The run folder of a scene that names none.
fn folder(scene: &Path) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or_default().to_owned();
    name.push("-run");
    name.into()
}

fn finish(loaded: &LoadedScene, options: RunOptions, json: bool) -> Result<(), Error> {
    let report = cutis::run(loaded, &options, &Terminal::new())?;
    print(&if json { pretty(&report) } else { summary(&report, &options.out) });
    Ok(())
}

fn summary(report: &Report, out: &Path) -> String {
    let sizes = &report.sizes;
    let mut lines = vec![format!(
        "{} vertices, {} edges, {} tetrahedra, {} skin triangles",
        sizes.vertices, sizes.edges, sizes.tets, sizes.skin_triangles
    )];
    if report.frames.count > 0 {
        lines.push(format!(
            "{} frames on {} ({}): {:.1} ms each",
            report.frames.count,
            place(&report.backend),
            report.backend.reason,
            report.frames.ms_mean
        ));
    }
    if report.stops.len() > 1 {
        lines.extend(report.stops.iter().map(|stop| stop.summary()));
    }
    lines.extend(report.rest.iter().map(|rest| rest.summary()));
    lines.extend(report.tension_summary());
    lines.extend(report.model_summary());
    lines.extend(report.wounds.iter().map(|wound| wound.summary()));
    lines.extend(report.sutures.iter().map(|suture| suture.summary()));
    lines.extend(report.handles.iter().map(|handle| handle.summary()));
    lines.push(format!("run folder: {}", out.display()));
    if report.scene.output.report {
        lines.push(format!("look at:    {}", out.join("report.html").display()));
    }
    lines.join("\n")
}

/// The backend, and the adapter of a GPU: `cpu`, or `gpu: llvmpipe (…)`.
pub(super) fn place(backend: &Backend) -> String {
    match &backend.adapter {
        Some(adapter) => format!("{}: {adapter}", backend.name),
        None => backend.name.clone(),
    }
}

pub(crate) fn check(
    scene: &Path,
    change: &Change,
    lattice: Option<LatticeSize>,
    json: bool,
) -> Result<(), Error> {
    let loaded = change.applied(Scene::load(scene, &change.overrides(lattice))?);
    let plan = cutis::check(&loaded, &Terminal::new())?;
    print(&if json { pretty(&plan) } else { plan_table::table(&plan, &loaded.scene) });
    Ok(())
}

pub(crate) fn resample(scene: &Path, change: &Change, request: ResampleRequest) -> Result<(), Error> {
    let loaded = change.applied(Scene::load(scene, &change.overrides(None))?);
    let terminal = Terminal::new();
    let report = cutis::resample_run(&loaded, &request, &terminal)?;
    if report.folds > 0 {
        terminal.note(&format!("{} voxels are covered twice by the deformed body (folds)", report.folds));
    }
    print(&format!("{}: {} voxels of the body moved", request.out.display(), report.moved_voxels));
    Ok(())
}

impl Change {
    /// The overrides of scene keys. If a key occurs twice, the later value is used.
    pub(super) fn overrides(&self, lattice: Option<LatticeSize>) -> Vec<Override> {
        let mut list = self.set.clone();
        let mut set = |key: &str, value: String| list.push(Override { key: key.into(), value });
        if let Some(backend) = &self.backend {
            set("solver.backend", format!("{backend:?}"));
        }
        if let Some(adapter) = &self.adapter {
            set("solver.adapter", format!("{adapter:?}"));
        }
        if let Some(frames) = self.frames {
            set("run.frames", frames.to_string());
        }
        match lattice {
            Some(LatticeSize::Native) => set("lattice", "{}".into()),
            Some(LatticeSize::SpacingMm(spacing)) => {
                set("lattice", format!("{{ spacing_mm = {spacing:?} }}"))
            }
            Some(LatticeSize::Vertices(vertices)) => set("lattice", format!("{{ vertices = {vertices:?} }}")),
            None => {}
        }
        list
    }

    /// Removes the constraint kinds that `--without` names.
    pub(super) fn applied(&self, mut loaded: LoadedScene) -> LoadedScene {
        for kind in &self.without {
            loaded.scene.constraints.remove(kind);
        }
        loaded
    }
}
