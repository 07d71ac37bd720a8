//! One sweep over all colors of a kind: PBD, XPBD, and a second iteration of XPBD with the
//! multipliers of the first.

use std::ops::Range;

use cutis_conformance::Alteration;
use cutis_gpu::{Binding, Gpu};
use cutis_shaders::solver::{self, Multiplier, PROJECT, Rule};
use cutis_solver::{
    ConstraintColor, Execute, Formulation, Serial, Settings, Simulation, Step, Sweep, Values, Vertex,
};
use nalgebra::Vector3;

use crate::parity::bench::{Bench, Effort, Failure};
use crate::parity::bodies::{ConstraintKind, Plan, STEP};
use crate::parity::comparison::Ring;
use crate::parity::difference::{Difference, triples};

/// Result of a sweep: vertices, and a multiplier for each constraint if they are kept.
type Swept = (Vec<[f32; 4]>, Vec<f32>);

/// The fault in the sweep of the device.
#[derive(Clone, Copy)]
enum Wrong {
    Nothing,
    Shader(Alteration),
    /// A color is skipped.
    Skipped,
    /// The last constraint of each color is skipped.
    Short,
}

/// A deformed body with one kind of constraint.
struct Body {
    simulation: Simulation<f32>,
    /// Vertices away from the rest shape.
    vertices: Vec<Vertex<f32>>,
    extent: f64,
}

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let size = if bench.effort == Effort::Quick { [9, 8, 7] } else { [21, 19, 17] };
    for kind in ConstraintKind::ALL {
        for (formulation, iterations) in
            [(Formulation::Pbd, 1), (Formulation::Xpbd, 1), (Formulation::Xpbd, 2)]
        {
            for each in [false, true] {
                if kind.fits(formulation) {
                    compare(bench, kind, formulation, iterations, each, size)?;
                }
            }
        }
    }
    Ok(())
}

fn compare(
    bench: &mut Bench<'_, '_>,
    kind: ConstraintKind,
    formulation: Formulation,
    iterations: u32,
    each: bool,
    size: [usize; 3],
) -> Result<(), Failure> {
    let plan = Plan { size, formulation, kinds: &[kind], each, fixed: true, handles: false, softness: 1.0 };
    let settings = Settings { formulation, iterations, ..Settings::default() };
    let body = Body::new(&plan, settings)?;
    let formula = match (formulation, iterations) {
        (Formulation::Pbd, _) => "PBD",
        (_, 1) => "XPBD",
        _ => "XPBD with multipliers",
    };
    let stiffness = if each { "a stiffness each" } else { "one stiffness" };
    let name = format!("sweep of {}: {formula}, {stiffness}", body.name());
    let expected = body.on_cpu();
    let measure = |gpu: &Gpu, policy, wrong| {
        let found = body.on_gpu(gpu, wrong)?;
        let vertices = Difference::default().add(triples(&found.0), triples(&expected.0), body.extent);
        let largest = expected.1.iter().fold(0.0, |most: f32, &multiplier| most.max(multiplier.abs()));
        let all =
            vertices.add(found.1, expected.1.iter().copied(), f64::from(largest).max(f64::MIN_POSITIVE));
        Ok(all.judged(policy))
    };
    bench.compare(Ring::Kernel, &name, |gpu, policy| measure(gpu, policy, Wrong::Nothing))?;
    for (what, wrong) in [
        ("value × 1.001", Wrong::Shader(Alteration::Value)),
        ("gradients 0 and 1 swapped", Wrong::Shader(Alteration::Swapped(0, 1))),
        ("a skipped color", Wrong::Skipped),
        ("a color one short", Wrong::Short),
    ] {
        bench.control(Ring::Kernel, &name, what, |gpu, policy| measure(gpu, policy, wrong))?;
    }
    Ok(())
}

impl Body {
    fn new(plan: &Plan<'_>, settings: Settings) -> Result<Self, Failure> {
        let simulation = Simulation::new(plan.system()?, settings)?;
        let mut vertices = simulation.system().vertices().to_vec();
        for (n, vertex) in vertices.iter_mut().enumerate() {
            let phase = n as f32 * 0.7;
            let push = Vector3::new(phase.sin(), (1.3 * phase).cos(), (2.1 * phase).sin());
            vertex.set_position(vertex.position() + push * (0.2 * STEP as f32));
        }
        Ok(Self { simulation, vertices, extent: plan.extent() })
    }

    fn name(&self) -> &'static str {
        self.simulation.system().kinds()[0].name()
    }

    fn sweeps(&self) -> &[Sweep] {
        &self.simulation.schedule().sweeps
    }

    fn iterations(&self) -> u32 {
        self.simulation.settings().iterations
    }

    fn multipliers(&self) -> Vec<f32> {
        let kept = self.simulation.settings().keeps_multipliers();
        vec![0.0; if kept { self.simulation.system().kinds()[0].len() } else { 0 }]
    }

    fn on_cpu(&self) -> Swept {
        let kind = &*self.simulation.system().kinds()[0];
        let (mut vertices, mut multipliers) = (self.vertices.clone(), self.multipliers());
        for _ in 0..self.iterations() {
            for &sweep in self.sweeps() {
                let Some(step) = self.simulation.projection_step() else { continue };
                Serial.project(ConstraintColor {
                    set: kind,
                    color: sweep.color,
                    tile: None,
                    vertices: vertices.as_mut_slice().into(),
                    step,
                    multipliers: &mut multipliers,
                });
            }
        }
        (bytemuck::cast_slice(&vertices).to_vec(), multipliers)
    }

    fn on_gpu(&self, gpu: &Gpu, wrong: Wrong) -> Result<Swept, Failure> {
        let set = &*self.simulation.system().kinds()[0];
        let vertices = gpu.buffer::<[f32; 4]>("vertices", bytemuck::cast_slice(&self.vertices))?;
        let (rule, inverse_h_squared) = match self.simulation.projection_step() {
            Some(Step::Xpbd { inverse_h_squared }) => (Rule::Xpbd, inverse_h_squared),
            Some(Step::Pbd) | None => (Rule::Pbd, 0.0),
        };
        let settings = gpu.uniform("settings", &[0.0, 0.0, 0.0, 0.0, 0.0, inverse_h_squared, 0.0, 0.0])?;
        let (way, uniform, each) = match set.stiffness().values() {
            Values::Uniform(value) => {
                (solver::Stiffness::Uniform, Some(gpu.uniform("stiffness", value)?), &[][..])
            }
            Values::Each(values) => (solver::Stiffness::Each, None, values.as_slice()),
        };
        let constraint = match wrong {
            Wrong::Shader(alteration) => alteration.wgsl(set.wgsl()),
            _ => set.wgsl().to_owned(),
        };
        let kept = self.multipliers().len();
        let ways = if kept > 0 { &[Multiplier::First, Multiplier::Next][..] } else { &[Multiplier::None] };
        let kernels = ways
            .iter()
            .map(|&multiplier| {
                let source = solver::project(set.arity(), &constraint, rule, way, multiplier);
                gpu.kernel(set.name(), &source, PROJECT)
            })
            .collect::<Result<Vec<_>, _>>()?;

        let chunks = self.chunks(gpu, wrong);
        let mut multipliers = Vec::with_capacity(chunks.len());
        let mut pass = gpu.pass("sweep");
        for (iteration, kernel) in kernels.iter().enumerate() {
            let mut shared = vec![(0, vertices.whole())];
            if rule == Rule::Xpbd {
                shared.push((1, settings.whole()));
            }
            let shared = gpu.bind(kernel, 0, &shared)?;
            for (n, range) in chunks.iter().enumerate() {
                let part = |stride: usize| range.start * stride..range.end * stride;
                let tuples = gpu.buffer("tuples", &set.indices()[part(set.arity())])?;
                let params = gpu.buffer("params", &set.params()[part(set.param_count())])?;
                let stiffness = match &uniform {
                    Some(_) => None,
                    None => Some(gpu.buffer("stiffness", &each[range.clone()])?),
                };
                if kept > 0 && iteration == 0 {
                    multipliers.push(gpu.zeroed::<f32>("multipliers", range.len())?);
                }
                let stiffness = stiffness.as_ref().or(uniform.as_ref());
                let mut bindings: Vec<(u32, Binding<'_>)> = vec![(0, tuples.whole()), (1, params.whole())];
                bindings.extend(stiffness.map(|buffer| (2, buffer.whole())));
                bindings.extend(multipliers.get(n).map(|buffer| (3, buffer.whole())));
                pass.dispatch(kernel, &[&shared, &gpu.bind(kernel, 1, &bindings)?], range.len());
            }
        }
        pass.submit()?;
        let mut found = self.multipliers();
        for (range, buffer) in chunks.iter().zip(&multipliers) {
            found[range.clone()].copy_from_slice(&gpu.read(buffer, 0..buffer.len())?);
        }
        Ok((gpu.read(&vertices, 0..vertices.len())?, found))
    }

    /// The constraints of each dispatch: colors, split if they are too large.
    fn chunks(&self, gpu: &Gpu, wrong: Wrong) -> Vec<Range<usize>> {
        let set = &*self.simulation.system().kinds()[0];
        let most = gpu.chunk_len(size_of::<f32>() * set.arity().max(set.param_count()));
        let skipped = usize::from(matches!(wrong, Wrong::Skipped));
        let short = usize::from(matches!(wrong, Wrong::Short));
        let colors = self.sweeps().iter().skip(skipped).map(|sweep| sweep.start..sweep.end - short);
        colors
            .flat_map(|Range { start, end }| {
                (start..end).step_by(most).map(move |first| first..end.min(first + most))
            })
            .collect()
    }
}
