//! One implicit substep, and a sweep over it by either method, one constraint or vertex after the other.

use cutis_solver::{Descent, Formulation, Kind, Settings, System, VertexForce};
use nalgebra::{Matrix3, Point3, Vector3};

use super::super::Failure;
use super::super::yardstick::{Implicit, Yardstick};

/// Most vertices of a constraint.
const MOST: usize = 8;

/// Which method sweeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Constraint by constraint, with multipliers.
    Xpbd,
    /// Vertex by vertex.
    Vbd,
}

/// Where an iteration stands.
#[derive(Clone)]
pub struct Iterate {
    /// Positions, m.
    pub x: Vec<Point3<f64>>,
    /// XPBD's multipliers, kind after kind; empty for the other.
    pub multipliers: Vec<f64>,
}

/// A substep to be solved.
pub struct Step<'a> {
    yardstick: &'a Yardstick,
    system: &'a System<f64>,
    descent: Descent<f64>,
    inverse_masses: Vec<f64>,
    /// What is looked for.
    pub implicit: Implicit,
    /// `1/h²` in 1/s².
    pub per_h2: f64,
    /// `h²·g` in m.
    fall: Vector3<f64>,
}

impl<'a> Step<'a> {
    /// The substep from the first instant of a problem, with `substeps` in a frame.
    ///
    /// # Errors
    /// A search that does not converge, a body that vertex block descent refuses.
    pub fn new(yardstick: &'a Yardstick, settings: &Settings, substeps: u32) -> Result<Self, Failure> {
        let system = yardstick.system();
        let settings = Settings { formulation: Formulation::Vbd, substeps, ..*settings };
        let h = settings.substep_s();
        Ok(Self {
            yardstick,
            system,
            descent: Descent::new(system, &settings)?,
            inverse_masses: system.vertices().iter().map(|vertex| vertex.inverse_mass()).collect(),
            implicit: yardstick.step_of(0, substeps, 1.0)?,
            per_h2: 1.0 / (h * h),
            fall: Vector3::from(settings.gravity_m_s2) * (h * h),
        })
    }

    /// Where a method begins.
    pub fn start(&self, method: Method) -> Iterate {
        let predicted = &self.implicit.predicted;
        match method {
            Method::Xpbd => {
                let count = self.system.kinds().iter().map(|kind| kind.len()).sum();
                Iterate { x: predicted.clone(), multipliers: vec![0.0; count] }
            }
            Method::Vbd => {
                let fall = |v: usize| if self.moves(v) { self.fall } else { Vector3::zeros() };
                let x = predicted.iter().enumerate().map(|(v, x)| x - fall(v)).collect();
                Iterate { x, multipliers: Vec::new() }
            }
        }
    }

    /// E1 of positions.
    pub fn error(&self, x: &[Point3<f64>]) -> f64 {
        self.yardstick.error(x, &self.implicit.minimum, &self.implicit.start)
    }

    /// Whether a vertex is free.
    pub fn moves(&self, vertex: usize) -> bool {
        self.inverse_masses[vertex] > 0.0
    }

    /// In 1/kg.
    pub fn inverse_mass(&self, vertex: usize) -> f64 {
        self.inverse_masses[vertex]
    }

    /// The constraints.
    pub fn kinds(&self) -> &'a [Kind<f64>] {
        self.system.kinds()
    }

    /// One sweep, `relaxed` as in over-relaxation, in the order of the colors or against it.
    pub fn sweep(&self, method: Method, iterate: &mut Iterate, relaxed: f64, backwards: bool) {
        match method {
            Method::Xpbd => self.project_all(iterate, relaxed, backwards),
            Method::Vbd => {
                let order = &self.descent.groups().order;
                let x = &mut iterate.x;
                match backwards {
                    false => order.iter().for_each(|&v| self.descend(v, x, relaxed)),
                    true => order.iter().rev().for_each(|&v| self.descend(v, x, relaxed)),
                }
            }
        }
    }

    fn project_all(&self, iterate: &mut Iterate, relaxed: f64, backwards: bool) {
        let mut first = 0;
        let mut all: Vec<(usize, usize, usize)> = Vec::new();
        for (n, kind) in self.kinds().iter().enumerate() {
            all.extend((0..kind.len()).map(|k| (n, k, first + k)));
            first += kind.len();
        }
        let mut project = |(n, k, at): (usize, usize, usize)| {
            let kind = &self.kinds()[n];
            let vertices = vertices(kind, k);
            let (mut places, mut gradient) = ([Point3::origin(); MOST], [Vector3::zeros(); MOST]);
            let c = evaluate(kind, k, &iterate.x, &mut places, &mut gradient);
            let weighted = |(&v, g): (&u32, &Vector3<f64>)| self.inverse_mass(v as usize) * g.norm_squared();
            let alpha = kind.stiffness().values().at(k) * self.per_h2;
            let multiplier = &mut iterate.multipliers[at];
            let denominator = vertices.iter().zip(&gradient).map(weighted).sum::<f64>() + alpha;
            if denominator > 0.0 {
                let change = -relaxed * (c + alpha * *multiplier) / denominator;
                *multiplier += change;
                for (&v, g) in vertices.iter().zip(&gradient) {
                    iterate.x[v as usize] += g * (self.inverse_mass(v as usize) * change);
                }
            }
        };
        match backwards {
            false => all.into_iter().for_each(&mut project),
            true => all.into_iter().rev().for_each(&mut project),
        }
    }

    fn descend(&self, vertex: u32, x: &mut [Point3<f64>], relaxed: f64) {
        let mut vertex_force = VertexForce::none();
        for (kind, incidence) in self.kinds().iter().zip(self.descent.incidences()) {
            for &place in incidence.of(vertex) {
                let (k, slot) = (place as usize / kind.arity(), place as usize % kind.arity());
                let (mut places, mut gradient) = ([Point3::origin(); MOST], [Vector3::zeros(); MOST]);
                let c = evaluate(kind, k, x, &mut places, &mut gradient);
                vertex_force.add(c, &gradient[slot], kind.stiffness().values().at(k), kind.rest_size(k));
            }
        }
        let v = vertex as usize;
        let inertia = self.per_h2 / self.inverse_mass(v);
        let force = vertex_force.force + (self.implicit.predicted[v] - x[v]) * inertia;
        let (d, m) = (vertex_force.diagonal.add_scalar(inertia), vertex_force.mixed);
        let matrix = Matrix3::new(d.x, m.x, m.y, m.x, d.y, m.z, m.y, m.z, d.z);
        if let Some(factors) = matrix.cholesky() {
            x[v] += factors.solve(&force) * relaxed;
        }
    }
}

/// The vertices of constraint `k`.
pub fn vertices(kind: &Kind<f64>, k: usize) -> &[u32] {
    &kind.indices()[k * kind.arity()..(k + 1) * kind.arity()]
}

/// `C` and `∇C` of constraint `k`.
pub fn evaluate(
    kind: &Kind<f64>,
    k: usize,
    x: &[Point3<f64>],
    places: &mut [Point3<f64>; MOST],
    gradient: &mut [Vector3<f64>; MOST],
) -> f64 {
    let arity = kind.arity();
    for (place, &v) in places.iter_mut().zip(vertices(kind, k)) {
        *place = x[v as usize];
    }
    kind.evaluate(k, &places[..arity], &mut gradient[..arity])
}
