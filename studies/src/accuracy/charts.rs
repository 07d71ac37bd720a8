//! Charts of a problem: error against time per frame. Each backend and method has a color, each
//! number of substeps a line.

use std::collections::BTreeMap;

use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};

use super::front::pareto;
use super::measurement::{Measure, Measurement};

/// Points by the number of substeps.
type Lines = BTreeMap<u32, Vec<[f64; 2]>>;

/// The chart of one error of a problem as SVG. `None` if no measurement has this error.
pub fn chart(problem: &str, rows: &[Measurement], measure: Measure) -> Option<String> {
    let mut families: BTreeMap<(bool, String), Lines> = BTreeMap::new();
    let mut all = Vec::new();
    for row in rows {
        let Some(error) = row.valid_error(measure) else { continue };
        let point = [row.ms_min, error];
        all.push(point);
        let family = families.entry((!row.is_usual(), row.family())).or_default();
        family.entry(row.substeps).or_default().push(point);
    }
    let front: Vec<[f64; 2]> = pareto(&all).into_iter().map(|n| all[n]).collect();
    let mut named = vec![("Pareto front".to_owned(), front, Mark::Band)];
    for ((other, name), mut lines) in families {
        lines.values_mut().for_each(|line| line.sort_by(|a, b| a[0].total_cmp(&b[0])));
        // A point that is not finite breaks the line.
        let lines: Vec<Vec<[f64; 2]>> = lines.into_values().collect();
        named.push((name, lines.join(&[f64::NAN; 2]), if other { Mark::Rings } else { Mark::Dots }));
    }
    let series: Vec<Series<'_>> =
        named.iter().map(|(name, points, mark)| Series { name, points, mark: *mark }).collect();
    let axis = |label| Axis { label, scale: Scale::Log };
    let title = format!("{problem}: {}", measure.label());
    (!all.is_empty())
        .then(|| line_chart(&title, axis("shortest time of a frame / ms"), axis(measure.name()), &series))
}
