//! The subject of the battery: a constraint type, its materials, and its properties.

use std::marker::PhantomData;

use cutis_constraints::{Constraint, Eval, Params, Scalar, UnitGradients};
use nalgebra::Point3;

use crate::random::Random;
use crate::shapes;

/// Length scales of the samples in m.
pub(crate) const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];
/// Samples per material and scale.
const SAMPLES: usize = 100;

/// A constraint type with the information that the battery needs.
///
/// By default the battery assumes that the constraint depends only on the shape and not on its
/// place or orientation, that it contains no length, and that its gradient is exact. Declare
/// exceptions with the methods below:
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
    pub(crate) anchored: bool,
    pub(crate) oriented: bool,
    pub(crate) has_length: bool,
    pub(crate) direction_only: bool,
    constraint: PhantomData<fn() -> C>,
}

impl<C: Constraint<N>, const N: usize> Subject<C, N> {
    /// Returns a subject with these materials for the samples. Choose materials for which each
    /// parameter has an effect.
    pub fn new(materials: impl IntoIterator<Item = C::Material>) -> Self {
        Self {
            materials: materials.into_iter().collect(),
            anchored: false,
            oriented: false,
            has_length: false,
            direction_only: false,
            constraint: PhantomData,
        }
    }

    /// Declares that the constraint depends on the position of the points in space, so it may push
    /// and turn a body. Skips the momentum check.
    pub fn anchored(self) -> Self {
        Self { anchored: true, ..self }
    }

    /// Declares that the constraint depends on the orientation of the points in space, but not on
    /// their place, like a load of fixed direction. It may turn a body, but not push it. The
    /// momentum check then requires a torque.
    pub fn oriented(self) -> Self {
        Self { oriented: true, ..self }
    }

    /// Declares that the constraint or its materials contain a length, so results may depend on the
    /// scale. Skips the scale check.
    pub fn with_own_length(self) -> Self {
        Self { has_length: true, ..self }
    }

    /// Declares a constraint for PBD only: `grad` has the direction of the gradient of `c` but not
    /// its length, and there is no energy. Skips XPBD and vertex block descent.
    pub fn direction_only(self) -> Self {
        Self { direction_only: true, ..self }
    }

    /// Returns the samples, the same in every run: for each material and scale 100 pairs of random
    /// shapes, one as the rest shape and one as the deformed shape. `f32` represents all numbers
    /// exactly.
    pub fn cases(&self) -> Vec<Case<N>> {
        let single = |x: f64| f64::from(x as f32);
        self.draw(SCALES, |scale, x| x.map(|p| p.map(|v| single(v * scale))))
            .map(|case| Case { params: case.params.into_iter().map(single).collect(), ..case })
            .collect()
    }

    /// Returns the samples at one length scale, for `f64`. The shapes are exactly the same at every
    /// scale.
    pub(crate) fn similar_cases(&self, scale: f64) -> Vec<Case<N>> {
        self.draw([scale], |scale, x| x.map(|p| p * scale)).collect()
    }

    /// Returns the parameters of a rest shape for each material. Those that are not finite in `f32`
    /// are omitted, because a system refuses them.
    pub(crate) fn params_of(&self, rest: &[Point3<f64>; N]) -> Vec<Vec<f64>> {
        let of = |material| {
            C::from_rest(rest, material).as_ref().iter().map(|&p: &f64| f64::from(p as f32)).collect()
        };
        let finite = |params: &Vec<f64>| params.iter().all(|p| p.is_finite());
        self.materials.iter().map(of).filter(finite).collect()
    }

    fn draw<const S: usize>(
        &self,
        scales: [f64; S],
        place: impl Fn(f64, [Point3<f64>; N]) -> [Point3<f64>; N],
    ) -> impl Iterator<Item = Case<N>> {
        scales.into_iter().flat_map(move |scale| {
            let mut random = Random::new(1);
            let mut cases = Vec::with_capacity(self.materials.len() * SAMPLES);
            for material in &self.materials {
                for _ in 0..SAMPLES {
                    let rest = place(scale, shapes::solid(&mut random));
                    let x = place(scale, shapes::solid(&mut random));
                    let params = C::from_rest::<f64>(&rest, material).as_ref().to_vec();
                    cases.push(Case { scale, x, params });
                }
            }
            cases
        })
    }
}

impl<C: Constraint<N, Material: Default>, const N: usize> Default for Subject<C, N> {
    /// Returns a subject with the default material.
    fn default() -> Self {
        Self::new([C::Material::default()])
    }
}

/// A sample: the parameters and the deformed shape of a constraint.
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
    /// Returns the parameters in another number type.
    pub(crate) fn params<C: Constraint<N>, T: Scalar>(&self) -> C::Params<T> {
        Params::from_fn(|k| T::constant(self.params[k]))
    }

    /// Returns the positions in another number type.
    pub(crate) fn positions<T: Scalar>(&self) -> [Point3<T>; N] {
        self.x.map(|p| p.map(T::constant))
    }

    /// Returns the value and gradients, computed in the number type `T`.
    pub fn eval<C: Constraint<N>, T: Scalar>(&self) -> Eval<T, N> {
        C::eval(&self.positions(), &self.params::<C, T>())
    }

    /// Returns the gradients of length 1, if the constraint has such gradients.
    pub(crate) fn unit_gradients<C: Constraint<N>, T: Scalar>(&self) -> Option<UnitGradients<T, N>> {
        C::unit_gradients(&self.positions(), &self.params::<C, T>())
    }

    /// Returns the reference size for errors of the value: the larger of the rest size and the
    /// change of the value when the points move by the scale. Errors of the gradient are relative
    /// to this size divided by the scale.
    pub fn size<C: Constraint<N>>(&self) -> f64 {
        let eval = self.eval::<C, f64>();
        let rest_size = C::rest_size(&self.params::<C, f64>()).abs();
        rest_size.max(crate::measure::length(&eval.grad) * self.scale)
    }
}
