//! Check: a SIMD lane gives the same bits as scalar code.

use cutis_constraints::{Constraint, Eval, Params, Real, Scalar};
use nalgebra::{Point3, Vector3};
use simba::simd::SimdValue;

use crate::checks::degenerate_cases;
use crate::measure::numbers;
use crate::{Case, Report, Subject};

/// Samples evaluated in SIMD lanes, in `f32` and in `f64`, have the same bits in each lane as in
/// scalar code. Some of the samples are degenerate. The CPU backend relies on this equality.
/// Control: the next lane must differ.
pub fn lanes<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let mut report = Report::new(C::NAME, "lanes");
    // Interleave the samples, so that lanes differ in scale and mix regular with degenerate shapes.
    let (mut cases, degenerate) = (subject.cases(), degenerate_cases(subject));
    cases.extend(degenerate);
    let stride = cases.len() / 5 + 1;
    let order: Vec<Case<N>> =
        (0..stride).flat_map(|first| cases.iter().skip(first).step_by(stride)).cloned().collect();
    compare::<C, f32, N>(&mut report, "f32", &order);
    compare::<C, f64, N>(&mut report, "f64", &order);
    report
}

fn compare<C: Constraint<N>, T: Scalar, const N: usize>(report: &mut Report, name: &str, cases: &[Case<N>]) {
    let lanes = T::Lanes::LANES;
    let (mut different, mut next, mut compared) = (0usize, 0usize, 0usize);
    for group in cases.chunks_exact(lanes) {
        let x = std::array::from_fn::<_, N, _>(|i| {
            let axis = |axis: usize| T::lanes(|lane| T::constant(group[lane].x[i][axis]));
            Point3::new(axis(0), axis(1), axis(2))
        });
        let params = Params::from_fn(|k| T::lanes(|lane| T::constant(group[lane].params[k])));
        let in_lanes = C::eval(&x, &params);
        for (lane, case) in group.iter().enumerate() {
            let scalar = case.eval::<C, T>();
            different += usize::from(!same_bits(&of_lane::<T, N>(&in_lanes, lane), &scalar));
            next += usize::from(!same_bits(&of_lane::<T, N>(&in_lanes, (lane + 1) % lanes), &scalar));
            compared += 1;
        }
    }
    report.at_most(format!("of {compared} samples in {name}, other bits in a lane"), different as f64, 0.0);
    report.control(format!("{name}, the next lane"), next as f64, compared as f64 / 2.0);
}

fn of_lane<T: Scalar, const N: usize>(in_lanes: &Eval<T::Lanes, N>, lane: usize) -> Eval<T, N>
where
    T::Lanes: Real + SimdValue<Element = T>,
{
    let grad = in_lanes.grad.map(|g| Vector3::from_fn(|axis, _| g[axis].extract(lane)));
    Eval { c: in_lanes.c.extract(lane), grad }
}

/// Returns whether the bits are equal. All NaN count as equal.
fn same_bits<T: Scalar, const N: usize>(a: &Eval<T, N>, b: &Eval<T, N>) -> bool {
    let bits = |value: T| if value.to_f64().is_nan() { u64::MAX } else { value.to_f64().to_bits() };
    numbers(a).map(bits).eq(numbers(b).map(bits))
}
