//! Where the time of a step goes, part by part; only for whoever asks.

use std::cell::RefCell;
use std::time::Instant;

use cutis_constraints::Scalar;

use crate::{ColoredVertices, ConstraintSet, Execute, Step, Sweep, Vertex, VertexBlock};

/// Time of one part of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimePart {
    /// One of the constants of [`StepProfile`], or the name of a kind of constraint.
    pub name: &'static str,
    /// Wall time in seconds.
    pub seconds: f64,
}

/// Wall time of steps by part, added up over as many steps as it is given to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepProfile {
    parts: Vec<TimePart>,
}

impl StepProfile {
    /// Prediction and velocities.
    pub const VERTICES: &'static str = "vertices";
    /// Vertices that handles carry.
    pub const HANDLES: &'static str = "handles";
    /// Multipliers, set to zero at the start of a substep.
    pub const MULTIPLIERS: &'static str = "multipliers";
    /// The steps of the vertices in vertex block descent, all kinds together.
    pub const DESCENT: &'static str = "descent";
    /// The look at whether all positions are finite.
    pub const CHECK: &'static str = "check";
    /// The whole step, of a backend that cannot tell its parts.
    pub const STEP: &'static str = "step";

    /// The parts in the order in which they first ran; a kind under its name, and what did not run not at all.
    pub fn parts(&self) -> &[TimePart] {
        &self.parts
    }

    /// Seconds of one part; 0 if it did not run.
    pub fn seconds(&self, name: &str) -> f64 {
        self.parts.iter().filter(|part| part.name == name).map(|part| part.seconds).sum()
    }

    /// Seconds of all parts.
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

    /// Runs `work` and adds the time that it takes to a part.
    pub fn time<R>(&mut self, name: &'static str, work: impl FnOnce() -> R) -> R {
        let start = Instant::now();
        let result = work();
        self.add(name, start.elapsed().as_secs_f64());
        result
    }
}

/// Executes as another does, with the same bits, and enters the time of every pass.
pub struct Timed<'a, E> {
    inner: E,
    profile: RefCell<&'a mut StepProfile>,
}

impl<'a, E> Timed<'a, E> {
    /// Enters what `inner` takes into `profile`.
    pub fn new(inner: E, profile: &'a mut StepProfile) -> Self {
        Self { inner, profile: RefCell::new(profile) }
    }
}

impl<T: Scalar, E: Execute<T>> Execute<T> for Timed<'_, E> {
    fn vertices(&self, block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync)) {
        self.profile.borrow_mut().time(StepProfile::VERTICES, || self.inner.vertices(block, pass));
    }

    fn sweep(
        &self,
        sweep: Sweep,
        set: &dyn ConstraintSet<T>,
        vertices: &mut [Vertex<T>],
        step: Step<T>,
        multipliers: &mut [T],
    ) {
        let work = || self.inner.sweep(sweep, set, vertices, step, multipliers);
        self.profile.borrow_mut().time(set.name(), work);
    }

    fn color_pass(&self, color: ColoredVertices<'_, T>) {
        self.profile.borrow_mut().time(StepProfile::DESCENT, || self.inner.color_pass(color));
    }

    fn alone(&self, part: &'static str, work: &mut dyn FnMut()) {
        self.profile.borrow_mut().time(part, || self.inner.alone(part, work));
    }

    fn first_not_finite(&self, vertices: &[Vertex<T>]) -> Option<usize> {
        self.profile.borrow_mut().time(StepProfile::CHECK, || self.inner.first_not_finite(vertices))
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
