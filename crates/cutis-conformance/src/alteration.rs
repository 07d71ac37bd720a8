//! Deliberate errors for negative controls: a number off by a thousandth, or two swapped gradients,
//! in Rust and in WGSL.

use std::fmt;
use std::marker::PhantomData;

use cutis_constraints::{Constraint, Eval, Real};
use nalgebra::Point3;

use crate::Case;

/// The factor by which a number of a negative control is wrong.
pub const FACTOR: f64 = 1.001;

/// A deliberate error in an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alteration {
    /// The value is multiplied by [`FACTOR`].
    Value,
    /// The gradient at one vertex is multiplied by [`FACTOR`].
    Gradient(usize),
    /// The gradients of two vertices are swapped.
    Swapped(usize, usize),
}

impl Alteration {
    /// Returns all alterations of a constraint over `arity` vertices.
    pub(crate) fn all(arity: usize) -> Vec<Self> {
        let gradients = (0..arity).map(Self::Gradient);
        let swaps = (1..arity).map(|i| Self::Swapped(i - 1, i));
        std::iter::once(Self::Value).chain(gradients).chain(swaps).collect()
    }

    /// Returns the alterations that change at least one sample. Swapping equal gradients changes
    /// nothing.
    pub(crate) fn of<C: Constraint<N>, const N: usize>(cases: &[Case<N>]) -> Vec<Self> {
        let changes = |alteration: &Self| match *alteration {
            Self::Swapped(i, j) => cases.iter().any(|case| {
                let grad = case.eval::<C, f64>().grad;
                grad[i] != grad[j]
            }),
            Self::Value | Self::Gradient(_) => true,
        };
        Self::all(N).into_iter().filter(changes).collect()
    }

    /// Returns the evaluation with this error.
    #[inline(always)]
    pub(crate) fn apply<T: Real, const N: usize>(self, mut eval: Eval<T, N>) -> Eval<T, N> {
        let factor = T::constant(FACTOR);
        match self {
            Self::Value => eval.c *= factor,
            Self::Gradient(i) => eval.grad[i] *= factor,
            Self::Swapped(i, j) => eval.grad.swap(i, j),
        }
        eval
    }

    /// Returns the WGSL source of a constraint with this error. Its `eval` gets another name, and a
    /// new `eval` alters the result.
    pub fn wgsl(self, constraint: &str) -> String {
        let statement = match self {
            Self::Value => format!("found.c = found.c * {FACTOR};"),
            Self::Gradient(i) => format!("found.grad[{i}] = found.grad[{i}] * {FACTOR};"),
            Self::Swapped(i, j) => format!(
                "let first = found.grad[{i}]; found.grad[{i}] = found.grad[{j}]; found.grad[{j}] = first;"
            ),
        };
        wrapped(constraint, &statement)
    }
}

impl fmt::Display for Alteration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value => write!(f, "value × {FACTOR}"),
            Self::Gradient(i) => write!(f, "gradient {i} × {FACTOR}"),
            Self::Swapped(i, j) => write!(f, "gradients {i} and {j} swapped"),
        }
    }
}

/// Returns the source of a constraint whose `eval` ends with `statements`, which may change
/// `found`. A projection then reads the gradients in `found`.
pub(crate) fn wrapped(constraint: &str, statements: &str) -> String {
    let original = renamed(constraint, "eval", "unaltered_eval");
    format!(
        "{original}\nfn eval(x: array<vec3f, N>, p: Params) -> Eval {{\n    var found = unaltered_eval(x, p);\n    \
         unit_gradients = false;\n    {statements}\n    return found;\n}}\n"
    )
}

/// Returns `source` with `from` replaced wherever it is a whole word.
fn renamed(source: &str, from: &str, to: &str) -> String {
    let in_word = |character: char| character.is_alphanumeric() || character == '_';
    let mut result = String::with_capacity(source.len());
    let mut rest = source;
    while let Some(place) = rest.find(from) {
        let (before, after) = (&rest[..place], &rest[place + from.len()..]);
        let whole = !result.ends_with(in_word) || !before.is_empty();
        let whole = whole && !before.ends_with(in_word) && !after.starts_with(in_word);
        result.push_str(before);
        result.push_str(if whole { to } else { from });
        rest = after;
    }
    result + rest
}

/// The constraint `C` with an error in its Rust code. Its WGSL is correct.
pub(crate) struct Altered<C, A>(PhantomData<fn() -> (C, A)>);

/// An [`Alteration`] as a type.
pub(crate) trait Choice: Send + Sync + 'static {
    const ALTERATION: Alteration;
}

/// A wrong value.
pub(crate) struct WrongValue;
/// A wrong gradient at the first vertex.
pub(crate) struct WrongGradient;

impl Choice for WrongValue {
    const ALTERATION: Alteration = Alteration::Value;
}

impl Choice for WrongGradient {
    const ALTERATION: Alteration = Alteration::Gradient(0);
}

impl<C: Constraint<N>, A: Choice, const N: usize> Constraint<N> for Altered<C, A> {
    const NAME: &'static str = C::NAME;
    const WGSL: &'static str = C::WGSL;
    type Params<T: Real> = C::Params<T>;
    type Material = C::Material;

    fn from_rest<T: Real>(x: &[Point3<T>; N], material: &C::Material) -> C::Params<T> {
        C::from_rest(x, material)
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; N], params: &C::Params<T>) -> Eval<T, N> {
        A::ALTERATION.apply(C::eval(x, params))
    }

    #[inline(always)]
    fn inverse_reach_squared<T: Real>(x: &[Point3<T>; N], params: &C::Params<T>) -> Option<T> {
        C::inverse_reach_squared(x, params)
    }

    fn rest_size<T: Real>(params: &C::Params<T>) -> T {
        C::rest_size(params)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_words_are_renamed() {
        assert_eq!(renamed("fn eval(a) -> Eval { eval_more(eval); reeval }", "eval", "f"), {
            "fn f(a) -> Eval { eval_more(f); reeval }"
        });
        assert_eq!(renamed("evaleval eval", "eval", "f"), "evaleval f");
    }

    #[test]
    fn a_triangle_has_six_alterations() {
        assert_eq!(Alteration::all(3).len(), 1 + 3 + 2);
        assert_eq!(Alteration::all(1), [Alteration::Value, Alteration::Gradient(0)]);
    }
}
