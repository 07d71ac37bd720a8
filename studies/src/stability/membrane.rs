//! A membrane: an uneven sheet of springs and skin strips, and its system at a scale.

use cutis_coloring::greedy;
use cutis_constraints::{
    Constraint, Distance, Scalar, SkinStrip, SkinStripAtRest, SkinStripLaw, SkinStripMaterial, SkinStripTurn,
};
use cutis_solver::{Formulation, Stiffness, System, SystemBuilder, Values};
use cutis_test_kit::Random;
use nalgebra::Point3;

use super::Failure;
use super::body::{Body, Law};
use crate::sheet::Sheet;

/// Largest height of a vertex over or below the smooth skin.
const HEIGHT: f64 = 0.25;
/// Angle between the lines of tension and the x axis, in rad.
const LINES: f64 = 0.4;
/// Tension and modulus across the lines over those along them: those of a trunk.
const ACROSS: [f64; 2] = [1.0 / 3.0, 2.0 / 3.0];

/// The skin strips of a body: two on each triangle, along the lines of tension and across them. The
/// normal of the smooth skin is the z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Membrane {
    /// True if the body is at rest in its rest shape, because a load balances the tension. If not,
    /// the membrane shrinks.
    pub at_rest: bool,
    /// Tension over modulus along the lines, below 1.
    pub tension: f64,
    /// Modulus along the lines over the stiffness of the springs.
    pub contrast: f64,
    /// As in [`SkinStripLaw`].
    pub stiffening: f64,
    /// As in [`SkinStripLaw`].
    pub compression: f64,
}

impl Membrane {
    /// A tension of 15 N/m at a modulus of 60 N/m, ten times as stiff as the springs.
    pub const TRUNK: Self =
        Self { at_rest: true, tension: 0.25, contrast: 10.0, stiffening: 0.0, compression: 0.0 };

    /// The strips that shrink.
    pub fn shrinking(self) -> Self {
        Self { at_rest: false, ..self }
    }

    /// A square sheet with this membrane, and about as many rows as columns.
    pub fn sheet(self, columns: i64, law: Law) -> Body {
        let Sheet { mut positions, springs, triangles, .. } = Sheet::new(columns);
        let mut random = Random::new(11);
        positions.iter_mut().for_each(|x| x.z = HEIGHT * random.between(-1.0, 1.0));
        Body { membrane: Some(self), ..Body::new(positions, springs, triangles, Vec::new(), law) }
    }

    /// Material and compliance of the two strips of a triangle with the shape `x` in the units of
    /// the body. `softness` is the compliance of a spring.
    fn strips(&self, x: &[Point3<f64>; 3], softness: f64) -> Result<[(SkinStripMaterial, f64); 2], Failure> {
        let (sin, cos) = LINES.sin_cos();
        let strip = |direction, [tension, modulus]: [f64; 2]| -> Result<_, Failure> {
            let law = SkinStripLaw {
                tension_n_per_m: self.tension * tension,
                modulus_n_per_m: modulus,
                stiffening: self.stiffening,
                compression: self.compression,
            };
            let material = SkinStripMaterial::new([0.0, 0.0, 1.0], direction, law)?;
            Ok((material, material.compliance(x)? * softness / self.contrast))
        };
        Ok([strip([cos, sin, 0.0], [1.0; 2])?, strip([-sin, cos, 0.0], ACROSS)?])
    }
}

/// The strips of a body in the number type of the solver.
struct Strips<T: Scalar> {
    triangles: Vec<[u32; 3]>,
    shapes: Vec<[Point3<T>; 3]>,
    materials: Vec<SkinStripMaterial>,
    stiffness: Stiffness<T>,
}

impl<T: Scalar> Strips<T> {
    fn of(body: &Body, membrane: &Membrane, scan: &[Point3<T>]) -> Result<Self, Failure> {
        let softness = match body.law {
            Law::Pbd(_) => 1.0,
            Law::Xpbd(compliances) | Law::Vbd(compliances) => compliances.distance,
        };
        let (mut triangles, mut shapes, mut materials) = (Vec::new(), Vec::new(), Vec::new());
        let mut compliances = Vec::new();
        for &triangle in &body.triangles {
            for (material, compliance) in
                membrane.strips(&triangle.map(|v| body.rest[v as usize]), softness)?
            {
                triangles.push(triangle);
                shapes.push(triangle.map(|v| scan[v as usize]));
                materials.push(material);
                compliances.push(T::constant(compliance));
            }
        }
        let stiffness = match body.law {
            Law::Pbd(share) => Stiffness::pbd(T::constant(share)),
            _ => Stiffness::Compliance(Values::Each(compliances)),
        };
        Ok(Self { triangles, shapes, materials, stiffness })
    }

    fn add<C: Constraint<3, Material = SkinStripMaterial>>(
        &self,
        builder: SystemBuilder<T>,
        count: usize,
    ) -> Result<SystemBuilder<T>, Failure> {
        let params: Vec<C::Params<T>> =
            self.shapes.iter().zip(&self.materials).map(|(x, material)| C::from_rest(x, material)).collect();
        let groups = greedy(&self.triangles, count)?;
        Ok(builder.add::<C, 3>(&self.triangles, &params, self.stiffness.clone(), &groups)?)
    }
}

impl Body {
    /// The system of a membrane at a scale. The parameters come from the rest shape as the solver
    /// stores it, so that a body at rest is exactly at rest.
    ///
    /// # Errors
    /// A material or the system is refused.
    pub(super) fn membrane_system<T: Scalar>(
        &self,
        membrane: &Membrane,
        scale: f64,
    ) -> Result<System<T>, Failure> {
        let mut system = self.membrane_at(membrane, &self.start, scale)?;
        if membrane.at_rest && self.law.formulation() == Formulation::Vbd {
            let forces = self.membrane_at::<T>(membrane, &self.rest, scale)?.constraint_forces()?;
            let loads: Vec<_> = forces.into_iter().map(|force| -force).collect();
            system.set_loads(&loads)?;
        }
        Ok(system)
    }

    /// The system without loads, with its vertices at `positions` in the units of the body.
    fn membrane_at<T: Scalar>(
        &self,
        membrane: &Membrane,
        positions: &[Point3<f64>],
        scale: f64,
    ) -> Result<System<T>, Failure> {
        let count = positions.len();
        let scan = self.builder::<T>(&self.rest, scale)?.build();
        let scan: Vec<Point3<T>> = scan.vertices().iter().map(|vertex| vertex.position()).collect();
        let lengths: Vec<_> = self
            .edges
            .iter()
            .map(|edge| Distance::from_rest(&edge.map(|v| scan[v as usize]), &Default::default()))
            .collect();
        let strips = Strips::of(self, membrane, &scan)?;
        let mut builder = self.builder::<T>(positions, scale)?;
        if !self.edges.is_empty() {
            let groups = greedy(&self.edges, count)?;
            builder = builder.add::<Distance, 2>(
                &self.edges,
                &lengths,
                self.stiffness(&self.edges, 0, scale),
                &groups,
            )?;
        }
        if membrane.at_rest && self.law.formulation() != Formulation::Vbd {
            builder = strips.add::<SkinStripAtRest>(builder, count)?;
            builder = strips.add::<SkinStripTurn>(builder, count)?;
        } else {
            builder = strips.add::<SkinStrip>(builder, count)?;
        }
        Ok(self.with_handles(builder, scale)?.build())
    }
}
