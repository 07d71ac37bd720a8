//! The cost per constraint and per vertex, over bodies of all sizes.

use std::path::Path;

use serde::Serialize;

use crate::kit::{Checks, Failure, Program, Table, number, number_at, scene};

/// Lattice spacings, mm.
const SPACINGS_MM: [f64; 5] = [11.0, 6.0, 4.0, 2.4, 1.36];
/// The spacing with which the others are compared.
const USUAL_MM: f64 = 4.0;
/// Largest cost per vertex at a finer spacing, relative to that at [`USUAL_MM`].
const MOST: f64 = 1.3;
/// Rounds over all runs. The shortest frame counts.
const ROUNDS: usize = 2;
/// Iterations of a frame: substeps times iterations.
const ITERATIONS: f64 = 4.0;

/// A body at one spacing.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    spacing_mm: f64,
    vertices: f64,
    tets: f64,
    constraints: f64,
    /// Shortest frame of position-based dynamics, ms.
    pbd_ms: f64,
    /// Shortest frame of vertex block descent, ms.
    vbd_ms: f64,
}

impl Row {
    /// Time per constraint and iteration of position-based dynamics, ns.
    fn per_constraint_ns(&self) -> f64 {
        self.pbd_ms * 1e6 / (self.constraints * ITERATIONS)
    }

    /// Time per vertex and iteration of vertex block descent, ns.
    fn per_vertex_ns(&self) -> f64 {
        self.vbd_ms * 1e6 / (self.vertices * ITERATIONS)
    }
}

/// Measures the demo at all spacings.
///
/// # Errors
/// The errors of [`Program::scene`].
pub fn measure(program: &Program, folder: &Path, checks: &mut Checks) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for spacing_mm in SPACINGS_MM {
        let mut row = Row {
            spacing_mm,
            vertices: 0.0,
            tets: 0.0,
            constraints: 0.0,
            pbd_ms: f64::INFINITY,
            vbd_ms: f64::INFINITY,
        };
        // A small body has more frames, so that a run lasts long enough to be timed.
        let frames = if spacing_mm > USUAL_MM { "200" } else { "6" };
        for _ in 0..ROUNDS {
            for (formulation, ms) in [("pbd", &mut row.pbd_ms), ("vbd", &mut row.vbd_ms)] {
                let changes = [
                    format!("lattice.spacing_mm={spacing_mm:?}"),
                    format!("solver.formulation={formulation}"),
                    "solver.backend=cpu".into(),
                    "incision=[]".into(),
                    "output={report=true}".into(),
                ];
                let report = program.scene(&scene("demo"), &changes, &["--frames", frames], folder)?;
                *ms = ms.min(number_at(&report, "/frames/ms_min")?);
                let size = |of: &str| number_at(&report, &format!("/sizes/{of}"));
                (row.vertices, row.tets) = (size("vertices")?, size("tets")?);
                row.constraints = size("edges")? + row.tets + size("skin_triangles")?;
            }
        }
        rows.push(row);
    }
    let usual = rows.iter().find(|row| row.spacing_mm == USUAL_MM);
    let mut check = |what: &str, row: &Row, cost: fn(&Row) -> f64| {
        let share = cost(row) / usual.map_or(f64::NAN, cost);
        let what = format!("{what} at {} mm: {share:.2} of the cost at {USUAL_MM} mm", row.spacing_mm);
        checks.add(format!("{what}, at most {MOST}"), share <= MOST);
    };
    for row in rows.iter().filter(|row| row.spacing_mm < USUAL_MM) {
        check("a vertex with vbd", row, Row::per_vertex_ns);
    }
    rows.last().into_iter().for_each(|row| check("a constraint with pbd", row, Row::per_constraint_ns));
    Ok(rows)
}

/// The table of all rows.
pub fn table(rows: &[Row]) -> Table {
    let mut table = Table::new([
        "spacing, mm",
        "vertices",
        "tetrahedra",
        "constraints",
        "pbd: ms/frame",
        "pbd: ns per constraint and iteration",
        "vbd: ms/frame",
        "vbd: ns per vertex and iteration",
    ]);
    for row in rows {
        table.add([
            number(row.spacing_mm),
            row.vertices.to_string(),
            row.tets.to_string(),
            row.constraints.to_string(),
            number(row.pbd_ms),
            number(row.per_constraint_ns()),
            number(row.vbd_ms),
            number(row.per_vertex_ns()),
        ]);
    }
    table
}
