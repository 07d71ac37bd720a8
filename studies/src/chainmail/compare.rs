//! The same drag on the same scan by several models.

use std::path::Path;

use cutis::Override;
use nalgebra::{Point3, Vector3};

use super::runs::positions;
use super::{Failure, set};
use crate::kit::Checks;

/// Width of a ring around the dragged vertices, mm.
pub(super) const RING_MM: f64 = 10.0;
/// Number of rings.
const RINGS: usize = 12;
/// Step of the lattice, mm.
const SPACING_MM: f64 = 6.0;
/// A vertex that moved by less than this distance counts as unmoved, mm.
pub(super) const STAYED_MM: f64 = 1.0;

/// Result of one model.
pub(super) struct Answer {
    pub(super) name: &'static str,
    /// Longest frame, ms.
    pub(super) frame_ms: f64,
    /// All frames, s.
    pub(super) all_s: f64,
    pub(super) frames: u32,
    /// Vertices that moved by more than [`STAYED_MM`].
    pub(super) moved: usize,
    /// Mean displacement by ring, mm.
    pub(super) rings_mm: Vec<f64>,
    /// Difference from the result of the last model, over all vertices that moved in either: mean,
    /// 95th percentile and maximum, mm.
    pub(super) differs_mm: [f64; 3],
    displacements: Vec<Vector3<f64>>,
}

/// The results of all models for one drag. The last one is the reference.
pub(super) struct Comparison {
    pub(super) scene: String,
    pub(super) vertices: usize,
    pub(super) spacing_mm: f64,
    pub(super) answers: Vec<Answer>,
}

/// Position-based dynamics with the material of the scenes.
const PBD: [(&str, &str); 3] = [
    ("model", "\"pbd\""),
    ("constraints", "{ distance = { youngs_modulus_pa = 5e3 }, volume = { bulk_modulus_pa = 5e4 } }"),
    ("run.frames", "120"),
];

/// Materials whose elements can stretch, shorten and shear widely, and rigid bone.
const ELASTIC: &str = "[{ from_hu = -1024, shortest = 0.4, longest = 1.8, shear = 0.8 }, \
                       { from_hu = 250, shortest = 1, longest = 1, shear = 0 }]";

impl Comparison {
    pub(super) fn of(scene: &str, own: &[Override], folder: &Path) -> Result<Self, Failure> {
        let spacing_mm = SPACING_MM;
        let common: Vec<Override> =
            [set("incision", "[]"), set("lattice.spacing_mm", &spacing_mm.to_string())].into();
        let run = |name: &str, changes: &[(&str, &str)]| {
            let changes: Vec<Override> = changes.iter().map(|(key, value)| set(key, value)).collect();
            positions(scene, &[own, &common, &changes].concat(), &folder.join(format!("{scene}-{name}")))
        };
        let (_, _, rest) = run("rest", &[("handle", "[]"), ("run.frames", "1")])?;
        let vbd = [("solver.formulation", "\"vbd\""), ("solver.substeps", "5"), ("solver.iterations", "2")];
        let xpbd = [("solver.formulation", "\"xpbd\""), ("solver.substeps", "20")];
        let elastic = [("chainmail.materials", ELASTIC), ("chainmail.relax_per_frame", "200")];
        let models: [(&'static str, Vec<(&str, &str)>); 6] = [
            ("ChainMail, not relaxed", vec![("chainmail.relax_per_frame", "0")]),
            ("ChainMail, `uniform`", vec![("chainmail.materials", "\"uniform\"")]),
            ("ChainMail, the scene's", vec![]),
            ("ChainMail, `k` = 0, relaxed to the end", elastic.into()),
            ("XPBD, 20 substeps", [&PBD[..], &xpbd].concat()),
            ("vertex block descent, 5 × 2", [&PBD[..], &vbd].concat()),
        ];
        let mut answers = Vec::new();
        for (n, (name, changes)) in models.into_iter().enumerate() {
            let (report, frame_ms, ends) = run(&n.to_string(), &changes)?;
            let displacements: Vec<Vector3<f64>> =
                ends.iter().zip(&rest).map(|(end, rest)| (end - rest).cast::<f64>() * 1e3).collect();
            answers.push(Answer {
                name,
                frame_ms,
                all_s: report.frames.ms_mean * f64::from(report.frames.count) / 1e3,
                frames: report.frames.count,
                moved: displacements.iter().filter(|by| by.norm() > STAYED_MM).count(),
                rings_mm: Vec::new(),
                differs_mm: [0.0; 3],
                displacements,
            });
        }
        let mut comparison = Self { scene: scene.into(), vertices: rest.len(), spacing_mm, answers };
        comparison.measure(&rest);
        Ok(comparison)
    }

    fn measure(&mut self, rest: &[Point3<f32>]) {
        let Some(last) = self.answers.last().map(|answer| answer.displacements.clone()) else { return };
        // Only the vertices of a handle move exactly as far as the handle.
        let farthest = last.iter().map(|by| by.norm()).fold(0.0, f64::max);
        let grabbed = rest.iter().zip(&last).filter(|(_, by)| by.norm() > farthest - 1e-3);
        let grabbed: Vec<Vector3<f64>> = grabbed.map(|(at, _)| at.coords.cast()).collect();
        let center = grabbed.iter().sum::<Vector3<f64>>() / grabbed.len().max(1) as f64;
        let ring = |at: &Point3<f32>| ((at.coords.cast::<f64>() - center).norm() * 1e3 / RING_MM) as usize;
        for answer in &mut self.answers {
            let mut rings = [(0.0, 0_usize); RINGS];
            for (at, by) in rest.iter().zip(&answer.displacements) {
                if let Some((sum, count)) = rings.get_mut(ring(at)) {
                    *sum += by.norm();
                    *count += 1;
                }
            }
            answer.rings_mm = rings.iter().map(|(sum, count)| sum / (*count).max(1) as f64).collect();
            let both = answer.displacements.iter().zip(&last);
            let either = both.filter(|(a, b)| a.norm() > STAYED_MM || b.norm() > STAYED_MM);
            let mut differences: Vec<f64> = either.map(|(a, b)| (a - b).norm()).collect();
            differences.sort_by(f64::total_cmp);
            let count = differences.len();
            let at =
                |share: f64| differences.get((share * count as f64) as usize).copied().unwrap_or_default();
            let mean = differences.iter().sum::<f64>() / count.max(1) as f64;
            answer.differs_mm = [mean, at(0.95), differences.last().copied().unwrap_or_default()];
        }
    }

    pub(super) fn check(&self, checks: &mut Checks) {
        let scene = &self.scene;
        let [.., chain, _, xpbd, vbd] = self.answers.as_slice() else {
            return checks.add(format!("{scene}: all models have an answer"), false);
        };
        let fast = chain.frame_ms < 0.1 * xpbd.frame_ms;
        checks.add(format!("{scene}: the longest frame of ChainMail is below a tenth of that of XPBD"), fast);
        let close = xpbd.differs_mm[0] < 1.0;
        checks.add(
            format!("{scene}: XPBD and vertex block descent differ by less than 1 mm on average"),
            close,
        );
        let differ = chain.differs_mm[0] > 2.0 * xpbd.differs_mm[0];
        checks.control(format!("{scene}: ChainMail differs from XPBD"), differ);
        checks.add(format!("{scene}: the reference does not differ from itself"), vbd.differs_mm == [0.0; 3]);
    }
}
