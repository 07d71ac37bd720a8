//! The memory and work of a run of constraints, counted before the run.

use cutis_solver::{Descent, Formulation, Kind, Settings, SolverError, StepProfile, System};

use crate::backend::Chosen;
use crate::backend::Work;
use crate::output::report::MemoryPart;

/// Memory and work of stepping a system with given settings.
pub(crate) struct CostEstimate {
    /// Memory of the solver on the host by part, equal to its
    /// [`Solver::bytes`](cutis_solver::Solver::bytes).
    pub(crate) memory: Vec<MemoryPart>,
    /// The groups of vertex block descent; none with another formulation, or without steps.
    descent: Option<Descent<f32>>,
}

impl CostEstimate {
    /// Estimates a system that is stepped with these settings.
    ///
    /// # Errors
    /// [`SolverError`] for a system that vertex block descent refuses.
    pub(crate) fn of(system: &System<f32>, settings: &Settings) -> Result<Self, SolverError> {
        let descent = match settings.formulation {
            Formulation::Vbd => Some(Descent::new(system, settings)?),
            Formulation::Pbd | Formulation::Xpbd => None,
        };
        let mut memory: Vec<MemoryPart> = system.bytes().iter().map(MemoryPart::from).collect();
        let mut add = |part: &str, bytes: usize| {
            if bytes > 0 {
                memory.push(MemoryPart { part: part.into(), bytes });
            }
        };
        if settings.keeps_multipliers() {
            let count: usize = system.kinds().iter().map(|kind| kind.len()).sum();
            add(StepProfile::MULTIPLIERS, count * size_of::<f32>());
        }
        add("incidences", descent.as_ref().map_or(0, Descent::bytes));
        Ok(Self { memory, descent })
    }

    /// Estimates a system that takes no steps.
    ///
    /// # Errors
    /// [`SolverError`] for a system that vertex block descent refuses.
    pub(crate) fn at_rest(system: &System<f32>, settings: &Settings) -> Result<Self, SolverError> {
        if settings.formulation == Formulation::Vbd {
            Descent::check(system, settings)?;
        }
        let memory = system.bytes().iter().map(MemoryPart::from).collect();
        Ok(Self { memory, descent: None })
    }

    /// Adds the memory of teams or columns, which only the threaded solver has.
    pub(crate) fn add_threaded(&mut self, backend: &Chosen, system: &System<f32>) {
        if backend.on_gpu() || backend.is_reference() {
            return;
        }
        let (part, bytes) = match &mut self.descent {
            Some(descent) => {
                descent.find_teams(system);
                ("teams", descent.team_bytes())
            }
            None => ("columns", system.column_bytes()),
        };
        if bytes > 0 {
            self.memory.push(MemoryPart { part: part.into(), bytes });
        }
    }

    /// The work of `frames` frames.
    pub(crate) fn work(&self, system: &System<f32>, settings: &Settings, frames: u32) -> Work {
        let kinds = system.kinds();
        let constraints: u64 = kinds.iter().map(|kind| kind.len() as u64).sum();
        let times = |once: u64| {
            let passes = [settings.iterations, settings.substeps, frames];
            passes.iter().fold(once, |product, &n| product.saturating_mul(n.into()))
        };
        let vertices = system.vertices().len() as u64;
        match &self.descent {
            None => {
                let colors = |kind: &Kind<f32>| {
                    (0..kind.colors()).filter(|&color| !kind.range(color).is_empty()).count() as u64
                };
                Work {
                    vertices,
                    element: "constraints",
                    elements: constraints,
                    sweeps: kinds.iter().map(colors).sum(),
                    projections: times(constraints),
                    evaluations: times(constraints),
                }
            }
            // A symmetric sweep visits each vertex twice.
            Some(descent) => {
                let groups = descent.groups();
                let steps = 2 * groups.order.len() as u64;
                let places = descent.incidences().iter().map(|kind| kind.places().len() as u64);
                Work {
                    vertices,
                    element: "vertices",
                    elements: steps,
                    sweeps: 2 * groups.iter().filter(|group| !group.is_empty()).count() as u64,
                    projections: times(steps),
                    evaluations: times(2 * places.sum::<u64>()),
                }
            }
        }
    }

    /// Number of vertex colors in vertex block descent; none with another formulation.
    pub(crate) fn vertex_colors(&self) -> Option<usize> {
        self.descent.as_ref().map(|descent| descent.groups().len())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cutis_solver::Solver;
    use cutis_solver_cpu::SolverCpu;

    use super::*;
    use crate::scene::{LoadedScene, Scene};

    /// A phantom with skin and a handle.
    fn scene(solver: &str) -> LoadedScene {
        let text = format!(
            "volume = {{ phantom = {{ size = [32, 32, 24], seed = 1 }} }}\nlattice = {{ spacing_mm = 16.0 }}\n\
             handle = [{{ at_mm = [-40, 100, 0], radius_mm = 30, move_mm = [0, 20, 5] }}]\n\
             fixed = {{ end_layers = [\"k\"] }}\n\
             constraints = {{ distance = {{ youngs_modulus_pa = 5e3 }}, volume = {{ bulk_modulus_pa = 5e4 }}, \
             stc = {{ area_modulus_n_per_m = 100 }} }}\nsolver = {solver}\nrun = {{ frames = 3 }}"
        );
        Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap()
    }

    /// The estimate and the plan agree with the bytes and the schedule of a solver.
    #[test]
    fn the_estimate_agrees_with_the_solver() {
        for (solver, more) in [
            ("{ backend = \"cpu\" }", vec!["incidences", "teams"]),
            ("{ backend = \"cpu\", formulation = \"xpbd\" }", vec![]),
            ("{ backend = \"cpu\", formulation = \"xpbd\", iterations = 4 }", vec!["multipliers"]),
            ("{ backend = \"cpu\", formulation = \"vbd\", iterations = 2 }", vec!["incidences", "teams"]),
            ("{ backend = \"cpu\", formulation = \"pbd\", iterations = 2 }", vec![]),
        ] {
            let loaded = scene(solver);
            let built = crate::build_system(&loaded).unwrap();
            let system = built.system.clone();
            let solver = SolverCpu::new(built.system, built.settings, Some(1)).unwrap();
            let stored: Vec<MemoryPart> = solver.bytes().iter().map(MemoryPart::from).collect();
            let parts: Vec<&str> = stored.iter().map(|part| part.part.as_str()).collect();
            let usual = ["vertices", "distance", "volume", "stc", "handles"];
            assert_eq!(parts, usual.into_iter().chain(more).collect::<Vec<_>>());

            let plan = crate::check(&loaded, &crate::Silent).unwrap();
            assert_eq!(plan.memory, stored);
            let schedule = solver.schedule();
            assert_eq!(plan.projections, 3 * schedule.projections_per_frame());
            let estimate = CostEstimate::of(&system, solver.settings()).unwrap();
            let work = estimate.work(&system, solver.settings(), 1);
            assert_eq!(work.sweeps as usize, schedule.sweeps.len() + 2 * schedule.color_passes.len());
            let passes = u64::from(schedule.iterations) * u64::from(schedule.substeps);
            assert_eq!(work.elements * passes, schedule.projections_per_frame());
            let host = plan.costs.parts.iter().filter(|part| part.host_bytes > 0);
            let host: Vec<_> =
                host.map(|part| MemoryPart { part: part.part.clone(), bytes: part.host_bytes }).collect();
            assert_eq!(host, stored);
        }
    }
}
