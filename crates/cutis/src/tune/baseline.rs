//! The whole body with the picked setting, which the ablation and the regions are compared with.

use std::ops::ControlFlow;

use nalgebra::Point3;

use super::bench::{Bench, Run};
use super::field::Field;
use super::sample::Sampler;
use super::{Setting, WoundError};
use crate::body::{Body, BodySections};
use crate::ct::source::Source;
use crate::model::ModelInput;
use crate::model::constraints::ConstraintModel;
use crate::scene::{LoadedScene, Scene};
use crate::{Error, Progress};

/// The full scene, its body and its run with the picked setting.
pub(super) struct Baseline<'a> {
    pub(super) loaded: &'a LoadedScene,
    pub(super) source: &'a Source,
    pub(super) body: &'a Body,
    pub(super) bench: &'a Bench<'a>,
    pub(super) setting: Setting,
    pub(super) run: Run,
}

/// Whether a changed scene uses the baseline's body.
#[derive(Clone, Copy)]
pub(super) enum Reuse {
    Same,
    /// A new body has to be built. Its run is expected to take this share of the baseline's time.
    Another {
        share: f64,
    },
}

/// The run of a changed scene, compared with the baseline.
pub(super) struct Comparison {
    pub(super) run: Run,
    /// Tetrahedra of the body.
    pub(super) tets: usize,
    /// RMS change of the displacements over the RMS displacement of the baseline.
    pub(super) change: f64,
    /// Growth of each wound, compared with the baseline.
    pub(super) wounds: Vec<WoundError>,
}

impl Baseline<'_> {
    /// Expected time of a run with `body`, s, without building it.
    pub(super) fn seconds(&self, body: Reuse) -> f64 {
        let whole_s = 1e-3 * self.run.ms_per_frame * f64::from(self.bench.frames);
        match body {
            Reuse::Same => whole_s,
            Reuse::Another { share } => whole_s * share,
        }
    }

    /// Runs a changed scene with the picked setting.
    ///
    /// # Errors
    /// The scene is invalid, or its body, its constraints or its run fail.
    pub(super) fn compare(
        &self,
        scene: &Scene,
        body: Reuse,
        progress: &dyn Progress,
    ) -> Result<Comparison, Error> {
        let loaded = LoadedScene { scene: scene.clone(), ..self.loaded.clone() };
        let other = match body {
            Reuse::Same => None,
            Reuse::Another { .. } => Some(Body::build(&BodySections::of(&loaded), &self.source.volume)?),
        };
        let body = other.as_ref().unwrap_or(self.body);
        let input = ModelInput { file: loaded.file(), scene: &loaded.scene, body };
        let ConstraintModel { system, settings, .. } = ConstraintModel::build(&input)?.unchanging()?;
        let bench = Bench::new(&system, settings, &body.cut.gapes, self.bench.backend, self.bench.frames);
        let run = bench.run(self.setting, progress, |_| ControlFlow::Continue(()))?;
        let field = match &other {
            None => run.at_end().clone(),
            Some(other) => self.resampled(other, &run.positions),
        };
        let whole = self.run.at_end();
        let rounding_mm = 1e3 * self.bench.movable.rounding();
        let wound = |(&growth_mm, &with): (&f64, &f64)| WoundError::of(growth_mm, with, rounding_mm);
        Ok(Comparison {
            tets: body.mesh.tets.len(),
            change: field.rms_to(whole) / whole.rms(),
            wounds: run.growths_mm.iter().zip(&self.run.growths_mm).map(wound).collect(),
            run,
        })
    }

    /// Displacements of another body at the movable vertices of this one.
    fn resampled(&self, other: &Body, deformed: &[Point3<f32>]) -> Field {
        let sampler = Sampler::new(&other.mesh, deformed);
        let here = &self.body.mesh;
        let at = |&v: &u32| sampler.displacement(here.frame.to_mm(here.positions[v as usize]));
        Field(self.bench.movable.vertices().iter().map(at).collect())
    }
}
