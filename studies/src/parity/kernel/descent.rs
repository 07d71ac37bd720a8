//! Vertex block descent: one iteration, a symmetric sweep over all colors of a deformed body.

use anyhow::bail;
use cutis_conformance::Alteration;
use cutis_gpu::{BindGroup, Gpu, Kernel};
use cutis_shaders::solver::{self, DESCEND, VERTEX_FORCE};
use cutis_solver::{
    ConstraintSet, Descent, DescentStep, Formulation, Method, Settings, Simulation, Solver, SolverReference,
};
use nalgebra::{Point3, Vector3};

use super::replaced;
use crate::parity::bench::{Bench, Effort, Failure};
use crate::parity::bodies::{ConstraintKind, Plan, STEP};
use crate::parity::comparison::Ring;
use crate::parity::difference::{Difference, triples};

/// The fault in the iteration of the device.
#[derive(Clone, Copy)]
enum Wrong {
    Nothing,
    Constraint(Alteration),
    /// A part of the kernel `vertex_force`, and its replacement.
    VertexForce([&'static str; 2]),
    /// A part of the kernel `descend`, and its replacement.
    Descend([&'static str; 2]),
    /// Both passes have the same order of colors.
    OneWay,
}

/// A deformed, moving body with one kind of constraint.
struct Body {
    simulation: Simulation<f32>,
    positions: Vec<Point3<f32>>,
    velocities: Vec<Vector3<f32>>,
    extent: f64,
}

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let size = if bench.effort == Effort::Quick { [7, 6, 5] } else { [15, 13, 11] };
    for kind in ConstraintKind::ALL.into_iter().filter(|kind| kind.fits(Formulation::Vbd)) {
        for each in [false, true] {
            compare(bench, kind, each, size)?;
        }
    }
    Ok(())
}

fn compare(
    bench: &mut Bench<'_, '_>,
    kind: ConstraintKind,
    each: bool,
    size: [usize; 3],
) -> Result<(), Failure> {
    let formulation = Formulation::Vbd;
    let plan = Plan { size, formulation, kinds: &[kind], each, fixed: true, handles: false, softness: 1.0 };
    let body = Body::new(&plan)?;
    let stiffness = if each { "a stiffness each" } else { "one stiffness" };
    let name = format!("descent of {}: {stiffness}", body.set().name());
    let expected = body.on_cpu()?;
    let measure = |gpu: &Gpu, policy, wrong| {
        let found = body.on_gpu(gpu, wrong)?;
        Ok(Difference::default().add(triples(&found), triples(&expected), body.extent).judged(policy))
    };
    bench.compare(Ring::Kernel, &name, |gpu, policy| measure(gpu, policy, Wrong::Nothing))?;
    for (what, wrong) in [
        ("value × 1.001", Wrong::Constraint(Alteration::Value)),
        ("gradients 0 and 1 swapped", Wrong::Constraint(Alteration::Swapped(0, 1))),
        ("force × 1.001", Wrong::VertexForce(["exact3(kg * c)", "exact3(kg * (c * 1.001))"])),
        (
            "two mixed entries swapped",
            Wrong::VertexForce(["kg.x * g.y, kg.x * g.z,", "kg.x * g.z, kg.x * g.y,"]),
        ),
        ("no inertia in the matrix", Wrong::Descend(["+ vec3f(least)", "+ vec3f(least * 0.0)"])),
        ("relaxation × 1.001", Wrong::Descend(["* descent.relaxation", "* (descent.relaxation * 1.001)"])),
        ("one way only", Wrong::OneWay),
    ] {
        bench.control(Ring::Kernel, &name, what, |gpu, policy| measure(gpu, policy, wrong))?;
    }
    Ok(())
}

impl Body {
    fn new(plan: &Plan<'_>) -> Result<Self, Failure> {
        let gravity_m_s2 = [0.31, -9.81, 1.7];
        let settings = Settings {
            formulation: Formulation::Vbd,
            gravity_m_s2,
            substeps: 1,
            relaxation: 1.3,
            ..Settings::default()
        };
        let simulation = Simulation::new(plan.system()?, settings)?;
        let wave = |n: usize| {
            let phase = n as f32 * 0.7;
            Vector3::new(phase.sin(), (1.3 * phase).cos(), (2.1 * phase).sin())
        };
        let place = |(n, x): (usize, &Point3<f32>)| x + wave(n) * (0.2 * STEP as f32);
        let positions: Vec<_> = simulation.system().positions().iter().enumerate().map(place).collect();
        // Fixed vertices have no velocity.
        let moves = |n: usize| if simulation.system().vertices()[n].inverse_mass() > 0.0 { 1.0 } else { 0.0 };
        let velocities = (0..positions.len()).map(|n| wave(n + 3) * moves(n)).collect();
        Ok(Self { simulation, positions, velocities, extent: plan.extent() })
    }

    fn set(&self) -> &dyn ConstraintSet<f32> {
        &*self.simulation.system().kinds()[0]
    }

    fn descent(&self) -> Result<&Descent<f32>, Failure> {
        match self.simulation.method() {
            Method::Descend(descent) => Ok(descent),
            Method::Project(_) | Method::Rest => bail!("vertex block descent does not move the body"),
        }
    }

    /// One frame of the reference, which has one iteration.
    fn on_cpu(&self) -> Result<Vec<[f32; 4]>, Failure> {
        let mut solver = SolverReference::new(self.simulation.system().clone(), *self.simulation.settings())?;
        solver.restore(&self.positions, &self.velocities, 0)?;
        solver.step(1)?;
        Ok(bytemuck::cast_slice(solver.system()?.vertices()).to_vec())
    }

    fn on_gpu(&self, gpu: &Gpu, wrong: Wrong) -> Result<Vec<[f32; 4]>, Failure> {
        let set = self.set();
        let &DescentStep { h, gravity_h_squared: g, inverse_h_squared, relaxation } = self.descent()?.step();
        let masses = self.simulation.system().vertices().iter().map(|vertex| vertex.inverse_mass());
        let row = |x: &Point3<f32>, w: f32| [x.x, x.y, x.z, w];
        let places = self.positions.iter().zip(&self.velocities).zip(masses);
        let predicted: Vec<[f32; 4]> = places.map(|((x, v), w)| row(&(x + v * h), w)).collect();
        let previous: Vec<[f32; 4]> = self.positions.iter().map(|x| row(x, 0.0)).collect();
        let velocities: Vec<[f32; 4]> = self.velocities.iter().map(|v| [v.x, v.y, v.z, 0.0]).collect();
        let constraint = match wrong {
            Wrong::Constraint(alteration) => alteration.wgsl(set.wgsl()),
            _ => set.wgsl().to_owned(),
        };
        let [mut vertex_force, mut descend] =
            [solver::vertex_force(set.arity(), &constraint), solver::descend(solver::Loads::None)];
        match wrong {
            Wrong::VertexForce([from, to]) => vertex_force = replaced(&vertex_force, from, to)?,
            Wrong::Descend([from, to]) => descend = replaced(&descend, from, to)?,
            Wrong::Nothing | Wrong::Constraint(_) | Wrong::OneWay => {}
        }
        let vertex_force = gpu.kernel("vertex_force", &vertex_force, VERTEX_FORCE)?;
        let descend = gpu.kernel("descend", &descend, DESCEND)?;
        let vertices = gpu.buffer("vertices", &predicted)?;
        let previous = gpu.buffer("previous", &previous)?;
        let velocities = gpu.buffer("velocities", &velocities)?;
        let forces = gpu.zeroed::<[f32; 12]>("vertex forces", self.positions.len())?;
        let step = [g.x, g.y, g.z, h, inverse_h_squared, relaxation, 0.0, 0.0];
        let step = gpu.uniform("step", &step)?;
        let acting = gpu.bind(&vertex_force, 0, &[(0, vertices.whole()), (1, forces.whole())])?;
        let moving = [
            (0, vertices.whole()),
            (1, forces.whole()),
            (2, previous.whole()),
            (3, velocities.whole()),
            (4, step.whole()),
        ];
        let moving = gpu.bind(&descend, 0, &moving)?;
        let groups = self.descent()?.groups();
        let colors: Vec<Color> = groups
            .iter()
            .filter(|chosen| !chosen.is_empty())
            .map(|chosen| self.color(gpu, [&vertex_force, &descend], chosen))
            .collect::<Result<_, _>>()?;
        let back = if matches!(wrong, Wrong::OneWay) { &[][..] } else { &colors[..] };
        let mut pass = gpu.pass("descent");
        for color in colors.iter().chain(back.iter().rev()) {
            if let Some((group, len)) = &color.acting {
                pass.dispatch(&vertex_force, &[&acting, group], *len);
            }
            pass.dispatch(&descend, &[&moving, &color.chosen], color.len);
        }
        pass.submit()?;
        Ok(gpu.read(&vertices, 0..vertices.len())?)
    }

    /// The vertices of a color and their constraints.
    fn color(
        &self,
        gpu: &Gpu,
        [vertex_force, descend]: [&Kernel; 2],
        chosen: &[u32],
    ) -> Result<Color, Failure> {
        let (set, descent) = (self.set(), self.descent()?);
        let moved = chosen.len();
        let (mut places, mut shares) = (Vec::<u32>::new(), Vec::<[u32; 3]>::new());
        for (n, &vertex) in (0u32..).zip(chosen) {
            let start = places.len() as u32;
            places.extend(descent.incidences()[0].of(vertex));
            if places.len() as u32 > start {
                shares.push([n, start, places.len() as u32]);
            }
        }
        let order = gpu.buffer("vertices of a color", chosen)?;
        let chosen = gpu.bind(descend, 1, &[(0, order.whole())])?;
        if shares.is_empty() {
            return Ok(Color { chosen, len: moved, acting: None });
        }
        let stiffness = set.stiffness().values();
        let shape: Vec<[f32; 2]> =
            (0..set.len()).map(|k| [1.0 / stiffness.at(k), set.rest_size(k).abs()]).collect();
        let tuples = gpu.buffer("tuples", set.indices())?;
        let params = gpu.buffer("params", set.params())?;
        let shape = gpu.buffer("shape", &shape)?;
        let places = gpu.buffer("places", &places)?;
        let len = shares.len();
        let shares = gpu.buffer("shares", &shares)?;
        let bindings = [
            (0, tuples.whole()),
            (1, params.whole()),
            (2, shape.whole()),
            (3, places.whole()),
            (4, shares.whole()),
        ];
        Ok(Color { chosen, len: moved, acting: Some((gpu.bind(vertex_force, 1, &bindings)?, len)) })
    }
}

struct Color {
    chosen: BindGroup,
    /// Vertices of the color.
    len: usize,
    /// Empty if no constraint acts on the color.
    acting: Option<(BindGroup, usize)>,
}
