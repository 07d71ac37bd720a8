//! What a scene could leave out, measured at the picked setting: each kind of constraint, each output, a finer lattice than
//! needed, and what lies far from the action. Each is run without it and compared with the run that has it.

use std::path::PathBuf;

use cutis_volume::Volume;
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bench::{Bench, Run};
use super::field::Field;
use super::sample::Sampler;
use super::{Setting, WoundError};
use crate::backend::{Chosen, Stages};
use crate::body::Body;
use crate::clock::Clock;
use crate::dynamics::{self, Dynamics};
use crate::files::RunFolder;
use crate::output::{self, Outcome};
use crate::report::{KindResidual, Stage};
use crate::scene::{LatticeSection, LoadedScene, RegionSection, Scene};
use crate::source::Source;
use crate::{Error, Progress};

/// How much coarser a lattice is tried.
const COARSER: [f64; 3] = [1.25, 1.5, 2.0];
/// How far a region reaches around the action, in lengths of the longest incision.
const AROUND: [f64; 2] = [1.0, 0.5];

/// What leaving one thing out saves, and what it changes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Omission {
    /// What is left out.
    pub what: String,
    /// Options of `cutis run` that leave it out.
    pub how: String,
    /// Milliseconds that a frame takes less; none for an output.
    pub saved_ms_per_frame: Option<f64>,
    /// Milliseconds that a run takes less beside its frames; none where only the frames do.
    pub saved_ms: Option<f64>,
    /// Bytes of the solver's memory that it takes less, on the host and the device; for an output, bytes of its files.
    pub saved_bytes: i64,
    /// RMS distance between the displacements without it and with it, over the RMS displacement with it; none for an output.
    pub change: Option<f64>,
    /// Opening of each wound without it, against the opening with it.
    pub wounds: Vec<WoundError>,
    /// Constraint errors without it, at the end.
    pub residuals: Vec<KindResidual>,
    /// Why it was not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skipped: Option<String>,
}

/// What omissions are measured against.
pub(super) struct Whole<'a> {
    pub(super) loaded: &'a LoadedScene,
    pub(super) source: &'a Source,
    pub(super) body: &'a Body,
    pub(super) bench: &'a Bench<'a>,
    pub(super) setting: Setting,
    pub(super) run: Run,
}

impl Whole<'_> {
    /// Measures all of them, the kinds first, within about `limit_s` seconds.
    pub(super) fn omissions(&self, limit_s: f64, clock: &mut Clock<'_>) -> Result<Vec<Omission>, Error> {
        let mut list = Vec::new();
        let mut left_s = limit_s;
        for variant in self.variants() {
            let whole_s = 1e-3 * self.run.ms_per_frame * f64::from(self.bench.frames);
            let named =
                Omission { what: variant.what.clone(), how: variant.how.clone(), ..Omission::default() };
            if whole_s * variant.share > left_s {
                list.push(Omission { skipped: Some("no time left; --minutes allows it".into()), ..named });
                continue;
            }
            let name = format!("without {}", variant.what);
            let measured =
                clock.stage(&name, self.bench.frames.into(), |progress| self.measure(&variant, progress));
            list.push(match measured {
                Ok((run_s, found)) => {
                    left_s -= run_s;
                    Omission { what: named.what, how: named.how, ..found }
                }
                // What a scene cannot do without is a finding.
                Err(error) => Omission { skipped: Some(error.to_string()), ..named },
            });
        }
        list.extend(self.outputs(clock)?);
        Ok(list)
    }

    fn variants(&self) -> Vec<Variant> {
        let scene = &self.loaded.scene;
        let mut list = Vec::new();
        let mut add = |what: String, how: String, share: f64, change: &dyn Fn(&mut Scene)| {
            let mut scene = scene.clone();
            scene.solver = self.setting.applied_to(&scene.solver);
            change(&mut scene);
            list.push(Variant { what, how, share, same_body: share == 1.0, scene });
        };
        let present = &scene.constraints;
        if present.distance.is_some() {
            add("distance".into(), "--without distance".into(), 1.0, &|s| s.constraints.distance = None);
        }
        if present.volume.is_some() {
            add("volume".into(), "--without volume".into(), 1.0, &|s| s.constraints.volume = None);
        }
        if present.stc.is_some() {
            add("stc".into(), "--without stc".into(), 1.0, &|s| s.constraints.stc = None);
        }
        for factor in COARSER {
            let (lattice, how) = self.coarser(factor);
            let what = format!("a lattice that fine ({factor} x coarser)");
            add(what, how, factor.powi(-3), &|s| s.lattice = lattice.clone());
        }
        if let (None, Some(length)) = (&scene.lattice.region, self.reach_mm()) {
            for share in AROUND {
                let around = (share * length).ceil();
                let region = RegionSection { around_mm: Some(around), min_mm: None, max_mm: None };
                let what = format!("what is {around} mm and more from the action");
                let how = format!("--set lattice.region.around_mm={around}");
                add(what, how, 0.99, &|s| s.lattice.region = Some(region.clone()));
            }
        }
        list
    }

    /// The scene's lattice with steps longer by `factor`.
    fn coarser(&self, factor: f64) -> (LatticeSection, String) {
        let lattice = &self.loaded.scene.lattice;
        match lattice.spacing_mm {
            Some(spacing) => {
                let spacing = spacing * factor;
                let how = format!("--set lattice.spacing_mm={spacing}");
                (LatticeSection { spacing_mm: Some(spacing), ..lattice.clone() }, how)
            }
            None => {
                let steps = |n: usize| ((n - 1) as f64 / factor).round().max(1.0) as usize;
                let vertices = self.body.mesh.lattice.grid().shape.map(|n| steps(n) + 1);
                let how = format!("--set lattice.vertices={vertices:?}");
                (LatticeSection { vertices: Some(vertices), ..lattice.clone() }, how)
            }
        }
    }

    /// Length of the longest incision, or twice the radius of the largest handle, mm.
    fn reach_mm(&self) -> Option<f64> {
        let scene = &self.loaded.scene;
        let incisions = scene
            .incision
            .iter()
            .map(|i| nalgebra::distance(&Point3::from(i.from_mm), &Point3::from(i.to_mm)));
        let handles = scene.handle.iter().map(|handle| 2.0 * handle.radius_mm);
        incisions.chain(handles).reduce(f64::max)
    }

    /// Runs a variant; also the seconds that its frames took.
    fn measure(&self, variant: &Variant, progress: &dyn Progress) -> Result<(f64, Omission), Error> {
        let loaded = LoadedScene { scene: variant.scene.clone(), ..self.loaded.clone() };
        let other = match variant.same_body {
            true => None,
            false => Some(Body::build(&loaded, self.volume())?),
        };
        let body = other.as_ref().unwrap_or(self.body);
        let Dynamics { system, settings, .. } = dynamics::build(&loaded, body)?;
        let bench = Bench::new(&system, settings, &body.cut.gapes, self.bench.backend, self.bench.frames);
        let run = bench.run(self.setting, progress, |_| std::ops::ControlFlow::Continue(()))?;
        let field = match &other {
            None => run.at_end().clone(),
            Some(other) => self.carried_over(other, &run.positions),
        };
        let whole = self.run.at_end();
        let wound = |(&growth_mm, &with): (&f64, &f64)| WoundError::of(growth_mm, with);
        let found = Omission {
            saved_ms_per_frame: Some(self.run.ms_per_frame - run.ms_per_frame),
            saved_bytes: self.run.bytes as i64 - run.bytes as i64,
            change: Some(field.rms_to(whole) / whole.rms()),
            wounds: run.growths_mm.iter().zip(&self.run.growths_mm).map(wound).collect(),
            residuals: run.residuals.iter().map(KindResidual::from).collect(),
            ..Omission::default()
        };
        Ok((1e-3 * run.ms_per_frame * f64::from(bench.frames), found))
    }

    fn volume(&self) -> &Volume {
        &self.source.volume
    }

    /// Displacements of another body at the vertices of this one that can move.
    fn carried_over(&self, other: &Body, deformed: &[Point3<f32>]) -> Field {
        let sampler = Sampler::new(&other.mesh, deformed);
        let (here, there) = (&self.body.mesh, &other.mesh.frame);
        let at = |&v: &u32| {
            let mm = here.frame.to_mm(here.positions[v as usize]);
            sampler.displacement(there.to_local(mm).cast())
        };
        Field(self.bench.movable.vertices().iter().map(at).collect())
    }

    /// What each output takes, from writing all of them once.
    fn outputs(&self, clock: &mut Clock<'_>) -> Result<Vec<Omission>, Error> {
        let output = &self.loaded.scene.output;
        if !(output.volume || output.surface || output.tissue || output.pictures) {
            return Ok(Vec::new());
        }
        let scratch = Scratch::new()?;
        let outcome = Outcome {
            loaded: self.loaded,
            source: self.source,
            body: self.body,
            deformed: &self.run.positions,
            folder: &scratch.0,
        };
        let mut stages = Stages::on(self.bench.backend.device()?);
        let before = clock.stages.len();
        output::write(&outcome, &mut stages, clock)?;
        let ms = |names: &[&str]| -> f64 {
            let named = |stage: &&Stage| names.contains(&stage.name.as_str());
            clock.stages[before..].iter().filter(named).map(|stage| stage.ms).sum()
        };
        let resample = |shared: bool| if shared { "" } else { "resample the CT" };
        let list: [(bool, &str, f64, &[PathBuf]); 4] = [
            (output.surface, "surface", ms(&["write skin.vtu"]), &[scratch.0.skin()]),
            (output.tissue, "tissue", ms(&["write tissue.vtu"]), &[scratch.0.tissue()]),
            (
                output.volume,
                "volume",
                ms(&["write deformed.nii.gz", resample(output.pictures)]),
                &[scratch.0.volume()],
            ),
            (
                output.pictures,
                "pictures",
                ms(&["pictures", resample(output.volume)]),
                &[scratch.0.before(), scratch.0.after(), scratch.0.slice()],
            ),
        ];
        let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |file| file.len() as i64);
        let named = list.iter().filter(|(named, ..)| *named);
        Ok(named
            .map(|&(_, name, saved_ms, files)| Omission {
                what: format!("output.{name}"),
                how: format!("--set output.{name}=false"),
                saved_ms: Some(saved_ms),
                saved_bytes: files.iter().map(size).sum(),
                ..Omission::default()
            })
            .collect())
    }
}

/// A scene without something.
struct Variant {
    what: String,
    how: String,
    /// Of the time of the whole, as far as it can be guessed.
    share: f64,
    same_body: bool,
    scene: Scene,
}

/// A folder for outputs that nobody keeps.
struct Scratch(RunFolder);

impl Scratch {
    fn new() -> Result<Self, Error> {
        let folder = std::env::temp_dir().join(format!("cutis-tune-{}", std::process::id()));
        crate::files::create_folder(&folder)?;
        Ok(Self(RunFolder(folder)))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A folder that cannot be removed is the system's to clean up: it lies among its temporary files.
        let _ = std::fs::remove_dir_all(&self.0.0);
    }
}

impl Chosen {
    /// Bytes that a body takes on a device.
    pub(super) fn device_bytes(
        &self,
        system: &cutis_solver::System<f32>,
        settings: &cutis_solver::Settings,
    ) -> usize {
        self.device_memory(system, settings).iter().map(|part| part.bytes).sum()
    }
}
