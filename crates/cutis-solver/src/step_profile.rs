//! Optional per-part timing of a step.

use std::cell::RefCell;
use std::ops::Range;
use std::time::Instant;

use cutis_constraints::Scalar;

use crate::{ConstraintColor, Execute, VertexBlock, VertexColor};

/// Time of one part of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimePart {
    /// A constant of [`StepProfile`] or the name of a kind of constraint.
    pub name: &'static str,
    /// Wall time in seconds.
    pub seconds: f64,
}

/// Wall time by part, summed over all steps that used this profile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepProfile {
    parts: Vec<TimePart>,
}

impl StepProfile {
    /// Prediction and velocity update.
    pub const VERTICES: &'static str = "vertices";
    /// Movement of the kinematic vertices.
    pub const HANDLES: &'static str = "handles";
    /// Reset of the multipliers at the start of a substep.
    pub const MULTIPLIERS: &'static str = "multipliers";
    /// Vertex steps of vertex block descent, for all kinds together.
    pub const DESCENT: &'static str = "descent";
    /// Test for positions that are not finite.
    pub const CHECK: &'static str = "check";
    /// The whole step, for a backend that does not measure parts.
    pub const STEP: &'static str = "step";

    /// Returns the parts in the order in which they first ran, without those that did not run. A
    /// kind of constraint appears under its name.
    pub fn parts(&self) -> &[TimePart] {
        &self.parts
    }

    /// Returns the seconds of one part, 0 if it did not run.
    pub fn seconds(&self, name: &str) -> f64 {
        self.parts.iter().filter(|part| part.name == name).map(|part| part.seconds).sum()
    }

    /// Returns the seconds of all parts.
    pub fn total_s(&self) -> f64 {
        self.parts.iter().map(|part| part.seconds).sum()
    }

    /// Adds `seconds` to a part.
    pub fn add(&mut self, name: &'static str, seconds: f64) {
        match self.parts.iter_mut().find(|part| part.name == name) {
            Some(part) => part.seconds += seconds,
            None => self.parts.push(TimePart { name, seconds }),
        }
    }

    /// Runs `work` and adds its duration to a part.
    pub fn time<R>(&mut self, name: &'static str, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        self.add(name, start.elapsed().as_secs_f64());
        result
    }
}

/// An executor that times every pass of another one. The bits do not change.
pub struct Timed<'a, E> {
    inner: E,
    profile: RefCell<&'a mut StepProfile>,
}

impl<'a, E> Timed<'a, E> {
    /// Adds the durations of the passes of `inner` to `profile`.
    pub fn new(inner: E, profile: &'a mut StepProfile) -> Self {
        Self { inner, profile: RefCell::new(profile) }
    }
}

impl<T: Scalar, E: Execute<T>> Execute<T> for Timed<'_, E> {
    fn workers(&self) -> usize {
        self.inner.workers()
    }

    fn vertices(&self, block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync)) {
        self.profile.borrow_mut().time(StepProfile::VERTICES, || self.inner.vertices(block, pass));
    }

    fn project(&self, color: ConstraintColor<'_, T>) {
        self.profile.borrow_mut().time(color.set.name(), || self.inner.project(color));
    }

    fn descend(&self, color: VertexColor<'_, T>) {
        self.profile.borrow_mut().time(StepProfile::DESCENT, || self.inner.descend(color));
    }

    fn serial(&self, part: &'static str, work: &mut dyn FnMut()) {
        self.profile.borrow_mut().time(part, || self.inner.serial(part, work));
    }

    fn find_first(
        &self,
        count: usize,
        find: &(dyn Fn(Range<usize>) -> Option<usize> + Sync),
    ) -> Option<usize> {
        self.profile.borrow_mut().time(StepProfile::CHECK, || self.inner.find_first(count, find))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_and_keep_their_order() {
        let mut profile = StepProfile::default();
        profile.add("b", 1.0);
        profile.add("a", 2.0);
        profile.add("b", 0.5);
        assert_eq!(profile.parts().iter().map(|part| part.name).collect::<Vec<_>>(), ["b", "a"]);
        assert_eq!((profile.seconds("b"), profile.seconds("c"), profile.total_s()), (1.5, 0.0, 3.5));
    }
}
