//! Check: a projection creates no force and no torque.

use cutis_constraints::Constraint;
use nalgebra::Vector3;

use crate::alteration::{Alteration, FACTOR};
use crate::measure::{largest, length};
use crate::{Case, Report, Subject};

/// Bound on the rounding error in `f64`.
const BOUND: f64 = 1e-11;

/// The gradients sum to zero, `Σ ∇_iC = 0`, and have no torque, `Σ x_i × ∇_iC = 0`: in `f64`,
/// relative to their length and the length scale, to 1e-11.
///
/// Skipped for [`anchored`](Subject::anchored) constraints. Controls: each gradient off by 1e-3
/// must be noticed in the sum. A couple, which is invisible in the sum, must be noticed in the
/// torque. The torque of an [`oriented`](Subject::oriented) constraint is not limited; as a control,
/// it must be noticed.
pub fn momentum<C: Constraint<N>, const N: usize>(subject: &Subject<C, N>) -> Report {
    let check = "momentum";
    if subject.anchored {
        return Report::skipped(C::NAME, check, "the constraint is anchored in space");
    }
    let mut report = Report::new(C::NAME, check);
    let cases = subject.cases();
    let worst = |measure: &dyn Fn(&Case<N>, [Vector3<f64>; N]) -> f64| {
        let of_case = |case: &Case<N>| {
            let grad = case.eval::<C, f64>().grad;
            if length(&grad) == 0.0 { 0.0 } else { measure(case, grad) }
        };
        cases.iter().map(of_case).fold(0.0, largest)
    };
    report.at_most("sum of the gradients", worst(&|_, grad| force(&grad)), BOUND);
    if subject.oriented {
        report.control("torque of an oriented constraint", worst(&torque), 1e5 * BOUND);
    } else {
        report.at_most("torque of the gradients", worst(&torque), BOUND);
    }
    for i in 0..N {
        let altered = |mut grad: [Vector3<f64>; N]| {
            grad[i] *= FACTOR;
            grad
        };
        let value = worst(&|_, grad| force(&altered(grad)));
        report.control(format!("sum, {}", Alteration::Gradient(i)), value, 1e5 * BOUND);
    }
    if N > 1 && !subject.oriented {
        let value = worst(&|case, grad| torque(case, with_couple(case, grad)));
        report.control("torque, a couple of 1e-3", value, 1e5 * BOUND);
    }
    report
}

fn force<const N: usize>(grad: &[Vector3<f64>; N]) -> f64 {
    grad.iter().sum::<Vector3<f64>>().norm() / length(grad)
}

/// Returns the torque about the first point, so that the position of the shape adds no rounding
/// error.
fn torque<const N: usize>(case: &Case<N>, grad: [Vector3<f64>; N]) -> f64 {
    let torque: Vector3<f64> = (0..N).map(|i| (case.x[i] - case.x[0]).cross(&grad[i])).sum();
    torque.norm() / (case.scale * length(&grad))
}

/// Adds two vectors that sum to zero, perpendicular to the line between the first two points.
fn with_couple<const N: usize>(case: &Case<N>, mut grad: [Vector3<f64>; N]) -> [Vector3<f64>; N] {
    let arm = case.x[1] - case.x[0];
    let across = arm.cross(&Vector3::new(arm.y, arm.z, -arm.x));
    let couple = across * (1e-3 * length(&grad) / across.norm());
    grad[0] += couple;
    grad[1] -= couple;
    grad
}
