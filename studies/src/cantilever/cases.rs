//! The cases: beams with their materials, and real-time settings.

use cutis_solver::Formulation;
use serde::Serialize;

use super::{Material, Stepping};

/// Density of soft tissue, kg/m³.
const DENSITY_KG_M3: f64 = 1000.0;

/// A beam and its material.
#[derive(Clone, Debug, Serialize)]
pub struct BeamCase {
    /// Name in tables.
    pub name: String,
    /// Cells in 10 mm.
    pub refinement: usize,
    /// Material.
    pub material: Material,
    /// True if every real-time setting is tried.
    #[serde(skip)]
    pub in_detail: bool,
    /// True for the case of the controls.
    pub with_controls: bool,
}

/// Sag in percent of the length, and the `E` that gives it at `K = E` and at `K = 10 E`.
const SAGS: [(u32, [f64; 2]); 3] = [(1, [1.5e7, 7e6]), (10, [1.5e6, 7.5e5]), (30, [5e5, 2.7e5])];

impl BeamCase {
    fn new(refinement: usize, sag: u32, youngs_pa: f64, ratio: f64) -> Self {
        Self {
            name: format!("{} cells, K = {ratio} E, {sag} %", 20 * refinement),
            refinement,
            material: Material { youngs_pa, bulk_pa: ratio * youngs_pa, density_kg_m3: DENSITY_KG_M3 },
            in_detail: refinement == 1 && sag == 10,
            with_controls: refinement == 1 && sag == 10 && ratio == 1.0,
        }
    }

    /// All cases, or with `quick` those of the tests.
    pub fn all(quick: bool) -> Vec<Self> {
        let mut cases = Vec::new();
        for refinement in [1, 2] {
            for (sag, moduli) in SAGS {
                for (youngs_pa, ratio) in moduli.into_iter().zip([1.0, 10.0]) {
                    // One sag for the fine mesh, and one for the quick cases.
                    if sag == 10 || (refinement == 1 && !quick) {
                        cases.push(Self::new(refinement, sag, youngs_pa, ratio));
                    }
                }
            }
        }
        cases.retain(|case| !quick || case.refinement == 1);
        cases
    }

    /// Cells of the beam along x, y and z.
    pub fn cells(&self) -> [usize; 3] {
        [20, 5, 5].map(|n| n * self.refinement)
    }

    /// Time of a wave across a cell, s.
    pub fn crossing_s(&self, length_m: f64) -> f64 {
        let Material { youngs_pa, bulk_pa, density_kg_m3 } = self.material;
        length_m / self.cells()[0] as f64 * (density_kg_m3 / youngs_pa.max(bulk_pa)).sqrt()
    }
}

/// Real-time settings, with frames of 1/60 s: XPBD with 1 to 50 substeps of 1 to 5 iterations,
/// vertex block descent, and PBD with stiffness 1.
pub fn real_time(damping_per_s: f64) -> Vec<Stepping> {
    let stepping = |formulation, substeps, iterations| Stepping {
        formulation,
        dt_s: 1.0 / 60.0,
        substeps,
        iterations,
        damping_per_s,
        most_frames: 300,
    };
    let xpbd =
        [1, 5, 10, 20, 50].into_iter().flat_map(|s| [1, 2, 5].map(|i| stepping(Formulation::Xpbd, s, i)));
    let vbd = [(1, 5), (1, 20), (5, 5), (10, 2)].map(|(s, i)| stepping(Formulation::Vbd, s, i));
    let pbd = [1, 10].map(|substeps| stepping(Formulation::Pbd, substeps, 5));
    xpbd.chain(vbd).chain(pbd).collect()
}
