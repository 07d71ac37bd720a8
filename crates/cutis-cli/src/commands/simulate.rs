//! `demo`, `run`, `check` and `resample`.

use std::path::{Path, PathBuf};

use cutis::report::{Backend, MaterialRow, Report};
use cutis::volume::sample::LatticeSize;
use cutis::{Error, LoadedScene, Override, Plan, Progress, ResampleRequest, RunOptions, Scene};

use super::pretty;
use crate::args::Change;
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

pub(crate) fn settle(scene: &Path, out: Option<PathBuf>, change: &Change, json: bool) -> Result<(), Error> {
    let loaded = settled(&[], change, |overrides| {
        let until = Override { key: "run.until".into(), value: "rest".into() };
        Scene::load(scene, &[overrides, &[until]].concat())
    })?;
    let out = out.unwrap_or_else(|| folder(scene));
    Interruptible { out: out.clone(), can_resume: false, resumed: false }.watch();
    finish(&loaded, RunOptions { out, resume: false }, json)
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

pub(crate) fn run(
    scene: &Path,
    out: Option<PathBuf>,
    change: &Change,
    resume: bool,
    json: bool,
) -> Result<(), Error> {
    let loaded = change.applied(Scene::load(scene, &change.overrides(None))?);
    let options = RunOptions { out: out.unwrap_or_else(|| folder(scene)), resume };
    Interruptible { out: options.out.clone(), can_resume: true, resumed: resume }.watch();
    finish(&loaded, options, json).inspect_err(|error| {
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
fn place(backend: &Backend) -> String {
    match &backend.adapter {
        Some(adapter) => format!("{}: {adapter}", backend.name),
        None => backend.name.clone(),
    }
}

/// The backend, the reason for it, and the number of threads of a CPU backend.
fn running_on(backend: &Backend) -> String {
    let threads = match backend.adapter {
        Some(_) => String::new(),
        None => format!(", {} threads", backend.threads),
    };
    format!("{} ({}){threads}", place(backend), backend.reason)
}

pub(crate) fn check(
    scene: &Path,
    change: &Change,
    lattice: Option<LatticeSize>,
    json: bool,
) -> Result<(), Error> {
    let loaded = change.applied(Scene::load(scene, &change.overrides(lattice))?);
    let plan = cutis::check(&loaded, &Terminal::new())?;
    print(&if json { pretty(&plan) } else { table(&plan) });
    Ok(())
}

fn table(plan: &Plan) -> String {
    let sizes = &plan.sizes;
    let [nx, ny, nz] = sizes.lattice;
    let mut lines = vec![
        format!("backend          {}", running_on(&plan.backend)),
        format!("lattice          {nx} x {ny} x {nz}"),
        format!(
            "vertices         {} ({} fixed, {} cut out)",
            sizes.vertices, sizes.fixed_vertices, sizes.removed_vertices
        ),
        format!("edges            {}", sizes.edges),
        format!("tetrahedra       {}", sizes.tets),
        format!("skin triangles   {}", sizes.skin_triangles),
        format!("projections      {}", plan.projections),
        format!("memory, CT       {:.1} MB", plan.volume_bytes as f64 / 1e6),
    ];
    let peak = plan.stages.iter().filter_map(|stage| stage.peak_bytes).max();
    lines.extend(peak.map(|bytes| format!("memory, peak     {:.1} MB while planning", bytes as f64 / 1e6)));
    lines.extend((sizes.lip_pairs > 0).then(|| format!("lip pairs        {}", sizes.lip_pairs)));
    lines.extend(plan.tension.iter().map(|(kind, tension)| format!("tension          {kind}: {tension}")));
    lines.extend(plan.membrane.iter().map(|membrane| format!("lines of tension {}", membrane.summary())));
    lines.extend(plan.steps.iter().map(|step| format!("step             {}", step.summary())));
    lines.extend(material_lines(&plan.materials));
    lines.extend(cost_lines(plan));
    if !plan.device_memory.is_empty() {
        let parts: Vec<&str> = plan.device_memory.iter().map(|part| part.part.as_str()).collect();
        lines.push(format!("GPU, kernels     for {}", parts.join(", ")));
    }
    lines.push("left out:".into());
    lines.extend(plan.left_out.iter().map(|line| format!("  {line}")));
    lines.extend(plan.warnings.iter().map(|line| format!("note: {line}")));
    lines.join("\n")
}

/// The table of materials with the counts of each row, and below each row the source of its values.
fn material_lines(materials: &[MaterialRow]) -> Vec<String> {
    if materials.is_empty() {
        return Vec::new();
    }
    let line = |name: &str, [hu, depth, young, bulk, vertices, tets]: [&str; 6]| {
        format!("  {name:18} {hu:>14} {depth:>10} {young:>10} {bulk:>10} {vertices:>10} {tets:>11}")
    };
    let titles = ["HU", "depth, mm", "E, kPa", "K, kPa", "vertices", "tetrahedra"];
    let mut lines = vec!["materials:".to_owned(), line("name", titles)];
    let range = |range: Option<[f64; 2]>| {
        range.map_or_else(|| "any".to_owned(), |[low, high]| format!("{low} to {high}"))
    };
    for row in materials {
        let moduli = [row.youngs_modulus_pa, row.bulk_modulus_pa].map(|pa| format!("{}", pa / 1e3));
        let counts = [row.vertices, row.tets].map(|count| count.to_string());
        let (hu, depth) = (range(row.hu), range(row.depth_mm));
        lines.push(line(&row.name, [&hu, &depth, &moduli[0], &moduli[1], &counts[0], &counts[1]]));
        lines.extend(row.source.iter().map(|source| format!("    {source}")));
    }
    lines
}

/// The cost report as a table: exact bytes and measured times.
fn cost_lines(plan: &Plan) -> Vec<String> {
    let on_device = !plan.device_memory.is_empty();
    let row = |part: &str, colors: &str, host: &str, device: &str, time: &str| {
        let device = if on_device { format!("  {device:>12}") } else { String::new() };
        format!("  {part:12} {colors:>8}  {host:>12}{device}  {time:>12}").trim_end().to_owned()
    };
    let bytes = |bytes: usize| if bytes == 0 { String::new() } else { bytes.to_string() };
    let mut lines = vec![
        "cost of the solver:".to_owned(),
        row("part", "colors", "host, bytes", "GPU, bytes", "ms per frame"),
    ];
    lines.extend(plan.costs.parts.iter().map(|part| {
        let colors = plan.colors.get(&part.part).map(usize::to_string).unwrap_or_default();
        let time = part.ms_per_frame.map(|ms| format!("{ms:.3}")).unwrap_or_default();
        row(&part.part, &colors, &bytes(part.host_bytes), &bytes(part.device_bytes), &time)
    }));
    let sum = |of: fn(&cutis::CostPart) -> usize| bytes(plan.costs.parts.iter().map(of).sum());
    let time = plan.costs.ms_per_frame().map(|ms| format!("{ms:.3}")).unwrap_or_default();
    lines.push(row("all", "", &sum(|part| part.host_bytes), &sum(|part| part.device_bytes), &time));
    lines.push(format!("  time: {}", plan.costs.time));
    lines
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
