//! Bodies for kernels and long runs: a lattice with any kinds of constraints in any formulation.

use cutis_coloring::greedy;
use cutis_constraints::{
    Distance, SkinTension, SkinTensionMaterial, SkinTensionPaper, SkinTensionPaperMaterial, Volume,
};
use cutis_solver::{Formulation, Handle, Stiffness, System, SystemBuilder, Values};
use nalgebra::{Point3, Vector3};

use super::bench::Failure;
use cutis_test_kit::Kuhn;

/// Length of a lattice step in m.
pub const STEP: f64 = 0.1;

/// A kind of constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintKind {
    /// Springs along the edges.
    Distance,
    /// Volumes of the tetrahedra.
    Volume,
    /// Skin tension on a part of the faces.
    SkinTension,
    /// Skin tension in the form of the paper, for PBD only.
    SkinTensionPaper,
}

impl ConstraintKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Distance, Self::Volume, Self::SkinTension, Self::SkinTensionPaper];

    /// True if the kind works with the formulation.
    pub fn fits(self, formulation: Formulation) -> bool {
        self != Self::SkinTensionPaper || formulation == Formulation::Pbd
    }
}

/// Size and constraints of a body.
#[derive(Clone, Debug)]
pub struct Plan<'a> {
    /// Vertices along each axis.
    pub size: [usize; 3],
    /// Formulation of the stiffness.
    pub formulation: Formulation,
    /// Kinds of constraints, in order.
    pub kinds: &'a [ConstraintKind],
    /// True for a stiffness of each constraint, false for one stiffness of all.
    pub each: bool,
    /// True if the face at x = 0 is fixed. A free body has momentum.
    pub fixed: bool,
    /// True if handles drag two edges of the opposite face.
    pub handles: bool,
    /// Factor on the compliances. With 1, a substep of 1 ms removes about half of an error.
    pub softness: f64,
}

impl Plan<'_> {
    /// The body at rest.
    ///
    /// # Errors
    /// The builder refuses the system.
    pub fn system(&self) -> Result<System<f32>, Failure> {
        let lattice = Kuhn::new(self.size, STEP);
        let count = lattice.positions.len();
        let [nx, ny, _] = self.size;
        let inverse_mass = |n: usize| match self.fixed && n.is_multiple_of(nx) {
            true => 0.0,
            false => 0.5 + (n % 7) as f64,
        };
        let masses: Vec<f64> = (0..count).map(inverse_mass).collect();
        // Offset by numbers that are not round, as in real bodies.
        let positions: Vec<Point3<f64>> =
            lattice.positions.iter().map(|p| p + Vector3::new(-0.43, 0.117, 0.0291)).collect();
        let faces: Vec<[u32; 3]> = lattice.tets.iter().map(|&[a, b, c, _]| [a, b, c]).step_by(5).collect();
        let mut builder = SystemBuilder::<f32>::new(&positions, &masses)?;
        for &kind in self.kinds {
            builder = match kind {
                ConstraintKind::Distance => {
                    let groups = greedy(&lattice.edges, count)?;
                    let stiffness = self.stiffness(lattice.edges.len(), 1e-5);
                    builder.add_from_rest::<Distance, 2>(
                        &lattice.edges,
                        &Default::default(),
                        stiffness,
                        &groups,
                    )?
                }
                ConstraintKind::Volume => {
                    let groups = greedy(&lattice.tets, count)?;
                    let stiffness = self.stiffness(lattice.tets.len(), 1e-10);
                    builder.add_from_rest::<Volume, 4>(
                        &lattice.tets,
                        &Default::default(),
                        stiffness,
                        &groups,
                    )?
                }
                ConstraintKind::SkinTension => {
                    let material = SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 };
                    let groups = greedy(&faces, count)?;
                    let stiffness = self.stiffness(faces.len(), 5e-8);
                    builder.add_from_rest::<SkinTension, 3>(&faces, &material, stiffness, &groups)?
                }
                ConstraintKind::SkinTensionPaper => {
                    let material = SkinTensionPaperMaterial::for_stiffness(0.9, 0.8, 2.0)?;
                    let groups = greedy(&faces, count)?;
                    let stiffness = self.stiffness(faces.len(), 0.0);
                    builder.add_from_rest::<SkinTensionPaper, 3>(&faces, &material, stiffness, &groups)?
                }
            };
        }
        if self.handles {
            for row in [0, ny - 1] {
                let vertices =
                    (0..count as u32).filter(|&n| n as usize % nx == nx - 1 && n as usize / nx % ny == row);
                let (vertices, over_s) = (vertices.collect(), 0.03 + row as f64);
                builder =
                    builder.handle(Handle { vertices, move_m: [0.1, 0.23, -0.07], at_s: 0.0, over_s })?;
            }
        }
        Ok(builder.build())
    }

    fn stiffness(&self, count: usize, compliance: f64) -> Stiffness<f32> {
        let unit = match self.formulation {
            Formulation::Pbd => 0.3,
            Formulation::Xpbd | Formulation::Vbd => compliance * self.softness,
        };
        let value = |n: usize| (unit * (1 + n % 3) as f64) as f32;
        let values = match self.each {
            true => Values::Each((0..count).map(value).collect()),
            false => Values::Uniform(value(0)),
        };
        match self.formulation {
            Formulation::Pbd => Stiffness::Pbd(values),
            Formulation::Xpbd | Formulation::Vbd => Stiffness::Compliance(values),
        }
    }

    /// Diagonal of the body in m.
    pub fn extent(&self) -> f64 {
        STEP * self.size.iter().map(|&n| (n * n) as f64).sum::<f64>().sqrt()
    }
}
