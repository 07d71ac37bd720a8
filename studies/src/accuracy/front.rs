//! The Pareto front of time and error.

/// Indices of the `points` (time, error) that no other point dominates, by ascending time. Points
/// with a coordinate that is not a finite number above zero do not count.
pub fn pareto(points: &[[f64; 2]]) -> Vec<usize> {
    let valid = |n: &usize| points[*n].iter().all(|value| value.is_finite() && *value > 0.0);
    let mut order: Vec<usize> = (0..points.len()).filter(valid).collect();
    order.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1])));
    let mut least = f64::INFINITY;
    order.retain(|&n| {
        let better = points[n][1] < least;
        least = least.min(points[n][1]);
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dominated_points_are_dropped() {
        let points =
            [[2.0, 0.5], [1.0, 1.0], [3.0, 0.6], [2.0, 0.4], [4.0, f64::NAN], [9.0, 0.1], [0.5, 0.0]];
        assert_eq!(pareto(&points), [1, 3, 5]);
    }
}
