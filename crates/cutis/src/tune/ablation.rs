//! Ablation: runs the scene without each of its parts and compares the result with the full scene.
//!
//! The parts are the constraint kinds, the outputs, and the resolution of the lattice. All runs use
//! the picked setting and the whole body.

use std::path::PathBuf;
use std::time::Instant;

use cutis_mesh::Lattice;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::WoundError;
use super::baseline::{Baseline, Comparison, Reuse};
use super::scratch::Scratch;
use crate::backend::Stages;
use crate::body::even_shape;
use crate::output::{self, DeformedBody};
use crate::report::{KindResidual, Stage};
use crate::run::clock::Clock;
use crate::scene::{LatticeSection, OutputSection, Scene};
use crate::{Error, Progress};

/// Factors by which coarser lattices are tried.
const COARSER: [f64; 3] = [1.25, 1.5, 2.0];

/// Savings and changes when one part of the scene is removed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Omission {
    /// The removed part.
    pub what: String,
    /// Options of `cutis run` that remove it.
    pub how: String,
    /// Time saved per frame, ms; none for an output.
    pub saved_ms_per_frame: Option<f64>,
    /// Time saved per run outside the frames, ms; none for parts that only cost frame time.
    pub saved_ms: Option<f64>,
    /// Memory of the solver saved on host and device, bytes; for an output, size of its files.
    pub saved_bytes: i64,
    /// RMS change of the displacements over the RMS displacement of the full scene; none for an
    /// output.
    pub change: Option<f64>,
    /// Growth of each wound without the part, compared with the full scene.
    pub wounds: Vec<WoundError>,
    /// Constraint errors at the end, without the part.
    pub residuals: Vec<KindResidual>,
    /// Reason if it was not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skipped: Option<String>,
}

impl Baseline<'_> {
    /// Measures all parts, constraint kinds first, within about `limit_s` seconds.
    pub(super) fn omissions(&self, limit_s: f64, clock: &mut Clock<'_>) -> Vec<Omission> {
        let mut list = Vec::new();
        let mut left_s = limit_s;
        for variant in self.variants() {
            let named =
                Omission { what: variant.what.clone(), how: variant.how.clone(), ..Omission::default() };
            if self.seconds(variant.body) > left_s {
                list.push(Omission { skipped: Some("no time left; increase --minutes".into()), ..named });
                continue;
            }
            let name = format!("without {}", variant.what);
            let begun = Instant::now();
            let measured =
                clock.stage(&name, self.bench.frames.into(), |progress| self.measure(&variant, progress));
            left_s -= begun.elapsed().as_secs_f64();
            list.push(match measured {
                Ok(found) => Omission { what: named.what, how: named.how, ..found },
                // A scene that cannot run without a part is a result, not a failure.
                Err(error) => Omission { skipped: Some(error.to_string()), ..named },
            });
        }
        // A full or read-only temporary folder must not discard the earlier results.
        list.extend(self.outputs(clock).unwrap_or_else(|error| {
            vec![Omission { what: "outputs".into(), skipped: Some(error.to_string()), ..Omission::default() }]
        }));
        list
    }

    fn variants(&self) -> Vec<Variant> {
        let scene = &self.loaded.scene;
        let mut list = Vec::new();
        let mut add = |what: String, how: String, body: Reuse, change: &dyn Fn(&mut Scene)| {
            let mut scene = scene.clone();
            scene.solver = self.setting.applied_to(&scene.solver);
            change(&mut scene);
            list.push(Variant { what, how, body, scene });
        };
        for (row, _) in scene.constraints.named() {
            let how = format!("--without {}", row.key);
            add(row.key.into(), how, Reuse::Same, &|s| {
                s.constraints.remove(row.key);
            });
        }
        for factor in COARSER {
            let (lattice, how) = coarser(&scene.lattice, &self.body.mesh.lattice, factor);
            let what = format!("lattice resolution ({factor} x coarser)");
            add(what, how, Reuse::Another { share: factor.powi(-3) }, &|s| s.lattice = lattice.clone());
        }
        list
    }

    /// Runs a variant.
    fn measure(&self, variant: &Variant, progress: &dyn Progress) -> Result<Omission, Error> {
        let Comparison { run, change, wounds, .. } = self.compare(&variant.scene, variant.body, progress)?;
        Ok(Omission {
            saved_ms_per_frame: Some(self.run.ms_per_frame - run.ms_per_frame),
            saved_bytes: self.run.bytes as i64 - run.bytes as i64,
            change: Some(change),
            wounds,
            residuals: run.residuals.iter().map(KindResidual::from).collect(),
            ..Omission::default()
        })
    }

    /// Cost of each output, from writing all of them once.
    fn outputs(&self, clock: &mut Clock<'_>) -> Result<Vec<Omission>, Error> {
        let output = &self.loaded.scene.output;
        if *output == (OutputSection { report: output.report, ..OutputSection::NONE }) {
            return Ok(Vec::new());
        }
        let scratch = Scratch::new(&std::env::temp_dir())?;
        let deformed = DeformedBody {
            body: self.body,
            positions: &self.run.positions,
            on_device: None,
            ct: &self.source.volume,
            scene: &self.loaded.scene,
        };
        let mut stages = Stages::on(self.bench.backend.device()?);
        let before = clock.stages.len();
        output::write(&deformed, output, &scratch.0, &mut stages, clock)?;
        let ms = |names: &[&str]| -> f64 {
            let named = |stage: &&Stage| names.contains(&stage.name.as_str());
            clock.stages[before..].iter().filter(named).map(|stage| stage.ms).sum()
        };
        let resample = |shared: bool| if shared { "" } else { "resample the CT" };
        let list: [(bool, &str, f64, &[PathBuf]); 8] = [
            (output.surface, "surface", ms(&["write skin.vtu"]), &[scratch.0.skin()]),
            (output.ply, "ply", ms(&["write skin.ply"]), &[scratch.0.ply()]),
            (output.stl, "stl", ms(&["write skin.stl"]), &[scratch.0.stl()]),
            (output.tissue, "tissue", ms(&["write tissue.vtu"]), &[scratch.0.tissue()]),
            (
                output.displacement,
                "displacement",
                ms(&["write displacement.nrrd"]),
                &[scratch.0.displacement(), scratch.0.coverage()],
            ),
            (
                output.displacement_forward,
                "displacement_forward",
                ms(&["write displacement-forward.nrrd"]),
                &[scratch.0.displacement_forward()],
            ),
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
                &[scratch.0.before(), scratch.0.after(), scratch.0.slice(), scratch.0.tension()],
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

/// A scene without one of its parts.
struct Variant {
    what: String,
    how: String,
    body: Reuse,
    scene: Scene,
}

/// A lattice with steps longer by `factor`, and the command-line option for it. `built` is the
/// lattice of `section`.
fn coarser(section: &LatticeSection, built: &Lattice, factor: f64) -> (LatticeSection, String) {
    match section.spacing_mm {
        Some(spacing) => {
            let spacing = spacing * factor;
            let how = format!("--set lattice.spacing_mm={spacing}");
            (LatticeSection { spacing_mm: Some(spacing), ..section.clone() }, how)
        }
        None => {
            let steps = |n: usize| ((n - 1) as f64 / factor).round().max(1.0) as usize;
            let vertices @ [nx, ny, nz] = even_shape(built).map(|n| steps(n) + 1);
            // No blanks and quoted brackets, so that it works in any shell.
            let how = format!("--set \"lattice.vertices=[{nx},{ny},{nz}]\"");
            (LatticeSection { vertices: Some(vertices), ..section.clone() }, how)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::body::{BodySections, lattice};
    use crate::ct::source;
    use crate::scene::Override;

    /// Coarsening also applies to the fine zone of a graded lattice, by the stated factor. The
    /// printed option has the same effect.
    #[test]
    fn a_graded_lattice_coarsens_by_the_stated_factor() {
        let text = "volume = { phantom = { size = [48, 48, 40], seed = 1 } }\n[lattice]\nvertices = [41, 41, 33]\n\
                    grading = { min_mm = [20, 80, -20], max_mm = [50, 110, 20], growth = 1.5, coarsest = 4.0 }";
        let built = |set: &[Override]| {
            let loaded = Scene::parse(text, Path::new("test"), Path::new(""), set).unwrap();
            let volume = source::load(&loaded).unwrap().volume;
            let lattice = lattice(&BodySections::of(&loaded), &volume).unwrap();
            (loaded.scene.lattice, lattice)
        };
        let (section, lattice) = built(&[]);
        assert!(lattice.grid().shape[0] < 30, "{:?}", lattice.grid().shape);
        for factor in COARSER {
            let (coarser, how) = coarser(&section, &lattice, factor);
            let option = how.strip_prefix("--set \"").and_then(|rest| rest.strip_suffix('"')).unwrap();
            assert!(!option.contains(' '), "{option}");
            let (key, value) = option.split_once('=').unwrap();
            let (read, found) = built(&[Override { key: key.into(), value: value.into() }]);
            assert_eq!(read, coarser);
            let ratio = found.longest_step_mm() / lattice.longest_step_mm();
            assert!((ratio / factor - 1.0).abs() < 0.03, "{ratio} and not {factor}");
        }
    }
}
