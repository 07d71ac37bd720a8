//! Check: a SIMD lane gives the same bits as scalar code.

use std::marker::PhantomData;

use cutis_constraints::{Constraint, Eval, LaneTask, Lanes, Params, Scalar, SimdLevel};
use nalgebra::{Point3, Vector3};

use crate::checks::degenerate_cases;
use crate::measure::numbers;
use crate::{Case, Report, Subject};

/// Samples evaluated in SIMD lanes, in `f32` with every SIMD level and in `f64`, have the same bits
/// in each lane as in scalar code. Some of the samples are degenerate. The CPU backend relies on
/// this equality. Control: the next lane must differ.
pub fn lanes<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let mut report = Report::new(C::NAME, "lanes");
    // Interleave the samples, so that lanes differ in scale and mix regular with degenerate shapes.
    let (mut cases, degenerate) = (subject.cases(), degenerate_cases(subject));
    cases.extend(degenerate);
    let stride = cases.len() / 5 + 1;
    let order: Vec<Case<N>> =
        (0..stride).flat_map(|first| cases.iter().skip(first).step_by(stride)).cloned().collect();
    for level in SimdLevel::available() {
        compare::<C, f32, N>(&mut report, level, &format!("{} lanes of f32", level.lanes()), &order);
    }
    compare::<C, f64, N>(&mut report, SimdLevel::best(), "f64", &order);
    report
}

fn compare<C: Constraint<N>, T: Scalar, const N: usize>(
    report: &mut Report,
    level: SimdLevel,
    name: &str,
    cases: &[Case<N>],
) {
    let mut counts = Counts::default();
    T::in_lanes(level, Compare::<C, N> { cases, counts: &mut counts, kind: PhantomData });
    let Counts { different, next, compared } = counts;
    report.at_most(format!("of {compared} samples in {name}, other bits in a lane"), different as f64, 0.0);
    report.control(format!("{name}, the next lane"), next as f64, compared as f64 / 2.0);
}

/// Samples that were compared, and those with other bits in their own lane and in the next one.
#[derive(Default)]
struct Counts {
    different: usize,
    next: usize,
    compared: usize,
}

/// The comparison for any number of lanes.
struct Compare<'a, C, const N: usize> {
    cases: &'a [Case<N>],
    counts: &'a mut Counts,
    kind: PhantomData<C>,
}

impl<C: Constraint<N>, T: Scalar, const N: usize> LaneTask<T> for Compare<'_, C, N> {
    fn run<L: Lanes<T>>(self) {
        for group in self.cases.chunks_exact(L::LANES) {
            let x = std::array::from_fn::<_, N, _>(|i| {
                let axis = |axis: usize| L::from_lanes(|lane| T::constant(group[lane].x[i][axis]));
                Point3::new(axis(0), axis(1), axis(2))
            });
            let params = Params::from_fn(|k| L::from_lanes(|lane| T::constant(group[lane].params[k])));
            let in_lanes = C::eval(&x, &params);
            let of_lane = |lane: usize| Eval {
                c: in_lanes.c.extract(lane),
                grad: in_lanes.grad.map(|g| Vector3::from_fn(|axis, _| g[axis].extract(lane))),
            };
            for (lane, case) in group.iter().enumerate() {
                let scalar = case.eval::<C, T>();
                let next = (lane + 1) % L::LANES;
                self.counts.different += usize::from(!same_bits(&of_lane(lane), &scalar));
                self.counts.next += usize::from(!same_bits(&of_lane(next), &scalar));
                self.counts.compared += 1;
            }
        }
    }
}

/// Returns whether the bits are equal. All NaN count as equal.
fn same_bits<T: Scalar, const N: usize>(a: &Eval<T, N>, b: &Eval<T, N>) -> bool {
    let bits = |value: T| if value.to_f64().is_nan() { u64::MAX } else { value.to_f64().to_bits() };
    numbers(a).map(bits).eq(numbers(b).map(bits))
}
