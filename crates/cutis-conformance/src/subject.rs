//! What is examined: a constraint type, the materials to build it with, and what it claims of itself.

use std::marker::PhantomData;

use cutis_constraints::{Constraint, Eval, Params, Scalar};
use nalgebra::Point3;

use crate::{Random, shapes};

/// Length scales of the samples in m. No constraint may know a length of its own.
pub const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];
/// Samples per material and scale.
const SAMPLES: usize = 100;

/// A constraint type with all that the battery has to know about it.
///
/// By default it is taken to depend on the shape alone, not on where it lies or how it is turned; to know no length of its
/// own; and to have the exact gradient of its value. Say so where that is not meant:
///
/// ```
/// use cutis_conformance::Subject;
/// use cutis_constraints::{SkinTensionPaper, SkinTensionPaperMaterial};
///
/// let material = SkinTensionPaperMaterial::for_stiffness(0.5, 0.8, 2.0)?;
/// let subject = Subject::<SkinTensionPaper, 3>::new([material]).direction_only();
/// assert_eq!(subject.cases().len(), 300);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Subject<C: Constraint<N>, const N: usize> {
    materials: Vec<C::Material>,
    shapes: fn(&mut Random) -> [Point3<f64>; N],
    pub(crate) anchored: bool,
    pub(crate) has_length: bool,
    pub(crate) direction_only: bool,
    constraint: PhantomData<fn() -> C>,
}

impl<C: Constraint<N>, const N: usize> Subject<C, N> {
    /// A constraint with the materials to examine it with: so chosen that each of its parameters has an effect.
    pub fn new(materials: impl IntoIterator<Item = C::Material>) -> Self {
        Self {
            materials: materials.into_iter().collect(),
            shapes: shapes::solid,
            anchored: false,
            has_length: false,
            direction_only: false,
            constraint: PhantomData,
        }
    }

    /// The constraint depends on where the points lie in space, so that it may push and turn a body: momentum is not
    /// checked.
    pub fn anchored(self) -> Self {
        Self { anchored: true, ..self }
    }

    /// The constraint or its materials have a length of their own, so that it may not look the same at every scale: that is
    /// not checked.
    pub fn with_own_length(self) -> Self {
        Self { has_length: true, ..self }
    }

    /// For PBD alone: `grad` has the direction of the gradient of `c`, but not its length, and there is no energy. XPBD is not
    /// checked.
    pub fn direction_only(self) -> Self {
        Self { direction_only: true, ..self }
    }

    /// Draws rest shapes and deformed ones with `shapes`: points of about −1 to 1, later scaled. By default any points do that
    /// are far from degenerate.
    pub fn shapes(self, shapes: fn(&mut Random) -> [Point3<f64>; N]) -> Self {
        Self { shapes, ..self }
    }

    /// The samples, the same in every run: for each material and scale 100 random rest shapes, each with another random shape as
    /// the deformed one. All numbers are such that `f32` holds them exactly.
    pub fn cases(&self) -> Vec<Case<N>> {
        let single = |x: f64| f64::from(x as f32);
        self.draw(|scale, x| x.map(|p| p.map(|v| single(v * scale))))
            .map(|case| Case { params: case.params.into_iter().map(single).collect(), ..case })
            .collect()
    }

    /// The samples with exactly the same shapes at every scale, for `f64`.
    pub(crate) fn similar_cases(&self) -> Vec<Case<N>> {
        self.draw(|scale, x| x.map(|p| p * scale)).collect()
    }

    /// Parameters of a rest shape for each material; only those that are finite in `f32`, as others are refused when a system
    /// is built.
    pub(crate) fn params_of(&self, rest: &[Point3<f64>; N]) -> Vec<Vec<f64>> {
        let of = |material| {
            C::from_rest(rest, material).as_ref().iter().map(|&p: &f64| f64::from(p as f32)).collect()
        };
        let finite = |params: &Vec<f64>| params.iter().all(|p| p.is_finite());
        self.materials.iter().map(of).filter(finite).collect()
    }

    /// One shape of the subject's.
    pub(crate) fn shape(&self, random: &mut Random) -> [Point3<f64>; N] {
        (self.shapes)(random)
    }

    fn draw(
        &self,
        place: impl Fn(f64, [Point3<f64>; N]) -> [Point3<f64>; N],
    ) -> impl Iterator<Item = Case<N>> {
        SCALES.into_iter().flat_map(move |scale| {
            let mut random = Random::new(1);
            let mut cases = Vec::with_capacity(self.materials.len() * SAMPLES);
            for material in &self.materials {
                for _ in 0..SAMPLES {
                    let rest = place(scale, (self.shapes)(&mut random));
                    let x = place(scale, (self.shapes)(&mut random));
                    let params = C::from_rest::<f64>(&rest, material).as_ref().to_vec();
                    cases.push(Case { scale, x, params });
                }
            }
            cases
        })
    }
}

impl<C: Constraint<N, Material: Default>, const N: usize> Default for Subject<C, N> {
    /// With the default material.
    fn default() -> Self {
        Self::new([C::Material::default()])
    }
}

/// One sample: a constraint with its parameters at a shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Case<const N: usize> {
    /// Length scale in m.
    pub scale: f64,
    /// Positions in m.
    pub x: [Point3<f64>; N],
    /// The scalars of the constraint's parameters.
    pub params: Vec<f64>,
}

impl<const N: usize> Case<N> {
    /// The parameters in another number type.
    pub fn params<C: Constraint<N>, T: Scalar>(&self) -> C::Params<T> {
        Params::from_fn(|k| T::constant(self.params[k]))
    }

    /// The positions in another number type.
    pub fn positions<T: Scalar>(&self) -> [Point3<T>; N] {
        self.x.map(|p| p.map(T::constant))
    }

    /// Value and gradients in the number type `T`.
    pub fn eval<C: Constraint<N>, T: Scalar>(&self) -> Eval<T, N> {
        C::eval(&self.positions(), &self.params::<C, T>())
    }

    /// What errors of the value are compared with: the rest size, or what moving the points by the scale would change, whichever
    /// is larger. Errors of the gradient are compared with the same over the scale.
    pub fn size<C: Constraint<N>>(&self) -> f64 {
        let eval = self.eval::<C, f64>();
        let rest_size = C::rest_size(&self.params::<C, f64>()).abs();
        rest_size.max(crate::measure::length(&eval.grad) * self.scale)
    }
}
