//! The tables of the page.

use super::CUTIS;
use super::job::Job;
use super::turns::{Found, Row};
use crate::kit::{Table, number};

/// Time over that of Cutis with the same order and as many threads. `None` if one is missing.
fn ratio(rows: &[Row], row: &Row) -> Option<f64> {
    let found = row.found()?;
    let matches = |other: &&Row| other.name == CUTIS && other.order == row.order;
    let ours = rows.iter().filter(matches).filter_map(Row::found);
    let mut ours = ours.filter(|ours| ours.about.threads == found.about.threads);
    Some(found.ms / ours.next()?.ms)
}

fn ratio_cell(rows: &[Row], row: &Row) -> String {
    ratio(rows, row).map_or_else(|| "–".into(), |ratio| format!("{ratio:.2}"))
}

fn beam(job: &Job) -> String {
    let [x, y, z] = job.size;
    format!("{x} × {y} × {z}")
}

/// Cells of a program without a result: the reason, and dashes.
fn missing(reason: &str, count: usize) -> Vec<String> {
    let dashes = std::iter::repeat_n("–".to_owned(), count - 1);
    std::iter::once(format!("not measured: {reason}")).chain(dashes).collect()
}

/// Frames of position-based dynamics with edges and tetrahedra.
pub fn projections(parts: &[(Job, Vec<Row>)]) -> Table {
    let mut table = Table::new([
        "beam",
        "program",
        "order",
        "version",
        "threads",
        "precision",
        "ms per frame",
        "ns per constraint and iteration",
        "time / Cutis",
        "sag, m",
    ]);
    for (job, rows) in parts {
        for row in rows {
            let mut cells = vec![beam(job), row.name.into(), row.order.name().into()];
            cells.extend(match &row.found {
                Err(reason) => missing(reason, 7),
                Ok(Found { about, ms, sag_m, .. }) => vec![
                    about.version.clone(),
                    about.threads.to_string(),
                    about.precision.clone(),
                    number(*ms),
                    number(per(*ms, about.edges + about.tets, about.iterations)),
                    ratio_cell(rows, row),
                    format!("{sag_m:.4}"),
                ],
            });
            table.add(cells);
        }
    }
    table
}

/// Time of one of `count` things and of one iteration, ns.
fn per(ms: f64, count: usize, iterations: u32) -> f64 {
    1e6 * ms / (count as f64 * f64::from(iterations))
}

/// Position-based dynamics with one kind of constraints.
pub fn single_kinds(edges: &[Row], tets: &[Row]) -> Table {
    let mut table = Table::new([
        "program",
        "order",
        "ns per edge and iteration",
        "time / Cutis, edges",
        "ns per tetrahedron and iteration",
        "time / Cutis, tetrahedra",
    ]);
    for (edge, tet) in edges.iter().zip(tets) {
        let cells = |rows, row: &Row, count: fn(&Found) -> usize| match &row.found {
            Err(reason) => missing(reason, 2),
            Ok(found) => {
                vec![number(per(found.ms, count(found), found.about.iterations)), ratio_cell(rows, row)]
            }
        };
        let start = vec![edge.name.into(), edge.order.name().into()];
        let edge = cells(edges, edge, |found| found.about.edges);
        table.add([start, edge, cells(tets, tet, |found| found.about.tets)].concat());
    }
    table
}

/// Frames of vertex block descent, and of programs that solve the same beam by another method.
pub fn descents(parts: &[(Job, Vec<Row>)]) -> Table {
    let mut table = Table::new([
        "beam",
        "program",
        "order",
        "version",
        "threads",
        "precision",
        "iterations or steps of a frame",
        "ms per frame",
        "ns per vertex and iteration",
        "time / Cutis",
        "sag, m",
    ]);
    for (job, rows) in parts {
        for row in rows {
            let mut cells = vec![beam(job), row.name.into(), row.order.name().into()];
            cells.extend(match &row.found {
                Err(reason) => missing(reason, 8),
                Ok(Found { about, ms, sag_m, .. }) => vec![
                    about.version.clone(),
                    about.threads.to_string(),
                    about.precision.clone(),
                    about.iterations.to_string(),
                    number(*ms),
                    number(per(*ms, about.vertices, about.iterations)),
                    ratio_cell(rows, row),
                    format!("{sag_m:.4}"),
                ],
            });
            table.add(cells);
        }
    }
    table
}
