//! The plan of a scene as `cutis check` prints it: about a screen.

use cutis::report::{Backend, MaterialRow, MemoryPart};
use cutis::scene::{RunEnd, Scene};
use cutis::{CostPart, Plan};

use super::simulate::place;

/// Topics of the list of what is left out that are printed whole. The others are only named.
const WHOLE: [&str; 2] = ["region:", "grading:"];

/// The plan for people. `--json` has more: each part of the solver, and the reason for all that is
/// left out.
pub(super) fn table(plan: &Plan, scene: &Scene) -> String {
    let sizes = &plan.sizes;
    let [nx, ny, nz] = sizes.lattice;
    let mut lines = vec![
        format!("backend          {}", running_on(&plan.backend)),
        format!("lattice          {nx} x {ny} x {nz}"),
        format!("vertices         {} ({} fixed{})", sizes.vertices, sizes.fixed_vertices, cut_out(plan)),
        format!("tetrahedra       {}", sizes.tets),
        format!("skin triangles   {}", sizes.skin_triangles),
        format!("memory           {}", memory(plan)),
        format!("time             {}", time(plan, scene)),
    ];
    lines.extend(plan.tension.iter().map(|(kind, tension)| format!("tension          {kind}: {tension}")));
    lines.extend(plan.membrane.iter().map(|membrane| format!("lines of tension {}", membrane.summary())));
    lines.extend(plan.steps.iter().map(|step| format!("step             {}", step.summary())));
    lines.extend(material_lines(&plan.materials));
    lines.extend(left_out(plan));
    lines.extend(plan.warnings.iter().map(|line| format!("note: {line}")));
    lines.join("\n")
}

/// The backend, the reason for it, and the number of threads of a CPU backend.
fn running_on(backend: &Backend) -> String {
    let threads = match backend.adapter {
        Some(_) => String::new(),
        None => format!(", {} threads", backend.threads),
    };
    format!("{} ({}){threads}", place(backend), backend.reason)
}

/// The vertices that incisions with a width remove.
fn cut_out(plan: &Plan) -> String {
    match plan.sizes.removed_vertices {
        0 => String::new(),
        removed => format!(", {removed} cut out"),
    }
}

/// Memory of the solver, of a search, of the CT, and of the program so far.
fn memory(plan: &Plan) -> String {
    let mb = |bytes: usize| format!("{:.1} MB", bytes as f64 / 1e6);
    let (rest, solver): (Vec<&CostPart>, Vec<&CostPart>) =
        plan.costs.parts.iter().partition(|part| part.part == MemoryPart::REST);
    let place = |parts: &[&CostPart]| {
        let sum = |of: fn(&CostPart) -> usize| parts.iter().map(|part| of(part)).sum::<usize>();
        let (host, device) = (sum(|part| part.host_bytes), sum(|part| part.device_bytes));
        let on_gpu = if device > 0 { format!(" and {} on the GPU", mb(device)) } else { String::new() };
        mb(host) + &on_gpu
    };
    let mut text = format!("{} for the solver", place(&solver));
    if !rest.is_empty() {
        text += &format!(", about {} for the search for rest", place(&rest));
    }
    text += &format!(", {} for the CT", mb(plan.volume_bytes));
    let peak = plan.stages.iter().filter_map(|stage| stage.peak_bytes).max();
    text + &peak.map_or(String::new(), |bytes| format!("; at most {} while planning", mb(bytes as usize)))
}

/// Time of a frame and of all frames, and how they were measured.
fn time(plan: &Plan, scene: &Scene) -> String {
    let how = &plan.costs.time;
    let Some(ms) = plan.costs.ms_per_frame() else { return how.clone() };
    let frames = scene.run.frames;
    let all = match frames {
        0 => String::new(),
        _ => format!(", about {} for {frames} frames", seconds(ms * 1e-3 * f64::from(frames))),
    };
    let rest = match scene.run.until {
        RunEnd::Frames => "",
        RunEnd::Rest => "; the search for the state of rest comes on top",
    };
    format!("{ms:.1} ms per frame{all}, without the outputs{rest} (from {how})")
}

/// A time with two digits.
fn seconds(s: f64) -> String {
    match s {
        _ if s < 9.95 => format!("{s:.1} s"),
        _ if s < 600.0 => format!("{s:.0} s"),
        _ => format!("{:.0} min", s / 60.0),
    }
}

/// The table of materials with the counts of each row. The sources of the values are in the report.
fn material_lines(materials: &[MaterialRow]) -> Vec<String> {
    if materials.is_empty() {
        return Vec::new();
    }
    let line = |name: &str, [hu, depth, young, bulk, vertices, tets]: [&str; 6]| {
        format!("  {name:18} {hu:>14} {depth:>10} {young:>10} {bulk:>10} {vertices:>10} {tets:>11}")
    };
    let titles = ["HU", "depth, mm", "E, kPa", "K, kPa", "vertices", "tetrahedra"];
    let mut lines = vec!["materials (sources: --json, report.html):".to_owned(), line("name", titles)];
    let range = |range: Option<[f64; 2]>| {
        range.map_or_else(|| "any".to_owned(), |[low, high]| format!("{low} to {high}"))
    };
    for row in materials {
        let moduli = [row.youngs_modulus_pa, row.bulk_modulus_pa].map(|pa| format!("{}", pa / 1e3));
        let counts = [row.vertices, row.tets].map(|count| count.to_string());
        let (hu, depth) = (range(row.hu), range(row.depth_mm));
        lines.push(line(&row.name, [&hu, &depth, &moduli[0], &moduli[1], &counts[0], &counts[1]]));
    }
    lines
}

/// What the scene leaves out: the region and the graded lattice, and the names of all else.
fn left_out(plan: &Plan) -> Vec<String> {
    let is_whole = |line: &&String| WHOLE.iter().any(|topic| line.starts_with(topic));
    let (whole, named): (Vec<&String>, Vec<&String>) = plan.left_out.iter().partition(is_whole);
    let names: Vec<&str> = named.iter().filter_map(|line| Some(line.split_once(':')?.0)).collect();
    let mut lines: Vec<String> = whole.iter().map(|line| format!("left out: {line}")).collect();
    lines.extend((!names.is_empty()).then(|| format!("left out, costs nothing: {}", names.join(", "))));
    lines
}
