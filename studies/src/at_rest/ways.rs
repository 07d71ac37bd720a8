//! XPBD in double precision with each way to hold the tension of the skin in the scan.

use std::time::Instant;

use cutis_constraints::{Constraint, SkinStrip, SkinStripAtRest, SkinStripTurn};
use cutis_solver::{Xpbd, project};
use nalgebra::{Point3, Vector3};

use super::block::{Block, Elements};

/// How the force of the skin in the scan is balanced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// A constant load, and multipliers that start at zero. A projection does not reach the full
    /// force, so the load is too strong.
    LoadOnly,
    /// The load. Multipliers start at their value in the scan, and the prediction applies them
    /// along the present gradients.
    Started,
    /// The load. Multipliers start at their value at the end of the last substep.
    Kept,
    /// The constraints contain their loads.
    Contained,
}

/// Substeps per frame and iterations per substep.
pub type Setting = [u32; 2];

/// Result of a run.
pub struct Run {
    pub positions: Vec<Point3<f64>>,
    /// Mean wall time of a frame, ms.
    pub ms_per_frame: f64,
}

const FRAME_S: f64 = 1.0 / 60.0;
/// Damping of the velocities, 1/s.
const DAMPING: f64 = 10.0;

impl Way {
    /// All ways, the control first.
    pub const ALL: [Self; 4] = [Self::LoadOnly, Self::Started, Self::Kept, Self::Contained];

    /// Text for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::LoadOnly => "load only (control)",
            Self::Started => "multipliers start at the scan's",
            Self::Kept => "multipliers are kept",
            Self::Contained => "load inside the constraint",
        }
    }

    /// Runs the block for a number of frames.
    pub fn run(self, block: &Block, [substeps, iterations]: Setting, frames: u32) -> Run {
        let h = FRAME_S / f64::from(substeps);
        let mut x = block.scan.clone();
        let mut v = vec![Vector3::zeros(); x.len()];
        let loads = self.loads(block);
        let (mut strips, mut at_rest, mut turns) = (None, None, None);
        let mut soft: [Box<dyn Projected + '_>; 2] =
            [Box::new(Plain { elements: &block.springs }), Box::new(Plain { elements: &block.volumes })];
        if self == Self::Contained {
            at_rest = Some(block.strips[0].of_type::<SkinStripAtRest>(&block.scan));
            turns = Some(block.strips[0].of_type::<SkinStripTurn>(&block.scan));
        } else {
            strips = Some(block.strips[0].of_type::<SkinStrip>(&block.scan));
        }
        let mut skin: Vec<Box<dyn Projected + '_>> = Vec::new();
        skin.extend(at_rest.iter().map(|e| Box::new(Plain { elements: e }) as Box<dyn Projected + '_>));
        skin.extend(turns.iter().map(|e| Box::new(Plain { elements: e }) as Box<dyn Projected + '_>));
        skin.extend(
            strips.iter().map(|e| Box::new(Held::new(e, self, &block.scan, h)) as Box<dyn Projected + '_>),
        );
        let mut multipliers: Vec<Vec<f64>> =
            soft.iter().chain(&skin).map(|kind| vec![0.0; kind.len()]).collect();
        let start = Instant::now();
        for _ in 0..frames * substeps {
            let before = x.clone();
            for (n, w) in block.inverse_masses.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                x[n] += (v[n] + loads[n] * (w * h)) * h;
            }
            for (kind, multipliers) in soft.iter_mut().chain(&mut skin).zip(&mut multipliers) {
                kind.predict(&before, &mut x, &block.inverse_masses, multipliers);
            }
            for _ in 0..iterations {
                for (kind, multipliers) in soft.iter_mut().chain(&mut skin).zip(&mut multipliers) {
                    kind.project(&mut x, &block.inverse_masses, multipliers, h);
                }
            }
            let kept = (-DAMPING * h).exp();
            for ((v, x), before) in v.iter_mut().zip(&x).zip(&before) {
                *v = (x - before) * (kept / h);
            }
        }
        let ms_per_frame = start.elapsed().as_secs_f64() * 1e3 / f64::from(frames);
        Run { positions: x, ms_per_frame }
    }

    /// Load on each vertex, N.
    fn loads(self, block: &Block) -> Vec<Vector3<f64>> {
        let [kept, removed] = block.loads();
        if self == Self::Contained {
            return removed;
        }
        kept.iter().zip(&removed).map(|(kept, removed)| kept + removed).collect()
    }
}

/// Constraints of one type in a substep.
trait Projected {
    fn len(&self) -> usize;

    /// Sets the multipliers at the start of a substep, and moves `x` by their forces along the
    /// gradients at `before`.
    fn predict(&self, before: &[Point3<f64>], x: &mut [Point3<f64>], w: &[f64], multipliers: &mut [f64]);

    /// Projects each constraint once.
    fn project(&self, x: &mut [Point3<f64>], w: &[f64], multipliers: &mut [f64], h: f64);
}

/// Constraints whose multipliers start at zero.
struct Plain<'a, C: Constraint<N>, const N: usize> {
    elements: &'a Elements<C, N>,
}

impl<C: Constraint<N>, const N: usize> Projected for Plain<'_, C, N> {
    fn len(&self) -> usize {
        self.elements.vertices.len()
    }

    fn predict(&self, _: &[Point3<f64>], _: &mut [Point3<f64>], _: &[f64], multipliers: &mut [f64]) {
        multipliers.fill(0.0);
    }

    fn project(&self, x: &mut [Point3<f64>], w: &[f64], multipliers: &mut [f64], h: f64) {
        let Elements { vertices, params, compliances } = self.elements;
        let rule = Xpbd { inverse_h_squared: 1.0 / (h * h) };
        for (k, vertices) in vertices.iter().enumerate() {
            let corners = vertices.map(|v| x[v as usize]);
            let weights = vertices.map(|v| w[v as usize]);
            let moved =
                project::<C, N, f64, _>(&corners, &weights, &params[k], rule, compliances[k], multipliers[k]);
            multipliers[k] += moved.multiplier;
            for (&v, correction) in vertices.iter().zip(moved.corrections) {
                x[v as usize] += correction;
            }
        }
    }
}

/// Strips whose force in the scan is balanced by a load.
struct Held<'a> {
    plain: Plain<'a, SkinStrip, 3>,
    way: Way,
    /// Multipliers in the scan for the time step of the run.
    in_scan: Vec<f64>,
}

impl<'a> Held<'a> {
    fn new(elements: &'a Elements<SkinStrip, 3>, way: Way, scan: &[Point3<f64>], h: f64) -> Self {
        let values = elements.vertices.iter().zip(&elements.params).zip(&elements.compliances);
        let in_scan = values.map(|((vertices, params), compliance)| {
            -SkinStrip::eval(&vertices.map(|v| scan[v as usize]), params).c * h * h / compliance
        });
        Self { plain: Plain { elements }, way, in_scan: in_scan.collect() }
    }
}

impl Projected for Held<'_> {
    fn len(&self) -> usize {
        self.plain.len()
    }

    fn predict(&self, before: &[Point3<f64>], x: &mut [Point3<f64>], w: &[f64], multipliers: &mut [f64]) {
        match self.way {
            Way::Kept if multipliers.iter().any(|multiplier| *multiplier != 0.0) => {}
            Way::Kept | Way::Started => multipliers.copy_from_slice(&self.in_scan),
            Way::LoadOnly | Way::Contained => return multipliers.fill(0.0),
        }
        let Elements { vertices, params, .. } = self.plain.elements;
        for ((vertices, params), multiplier) in vertices.iter().zip(params).zip(multipliers) {
            let gradients = SkinStrip::eval(&vertices.map(|v| before[v as usize]), params).grad;
            for (&v, gradient) in vertices.iter().zip(gradients) {
                x[v as usize] += gradient * (w[v as usize] * *multiplier);
            }
        }
    }

    fn project(&self, x: &mut [Point3<f64>], w: &[f64], multipliers: &mut [f64], h: f64) {
        self.plain.project(x, w, multipliers, h);
    }
}
