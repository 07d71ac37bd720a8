//! Searches for the state of rest, step by step.

use std::fs::File;
use std::io::{BufWriter, Read, Seek, Write};
use std::time::Instant;

use anyhow::Context;
use cutis::rest::{Body, Options, Search};
use cutis::{Override, Scene, SceneSystem};
use nalgebra::Point3;
use serde::Serialize;

use crate::kit::{Checks, Failure, Table, number, optional, percent, scene};
use crate::main_job::volume;

/// Error at which a body counts as at rest.
pub const AT_REST: f64 = 0.01;
/// Stated error at which a search of the demo ends. Its result is the reference for all steps.
const EXACT: f64 = 1e-6;
/// Stated error at which the other searches end.
const FINE: f64 = 1e-3;
/// Lattice spacings of the whole demo without a region, mm.
const SPACINGS_MM: [f64; 6] = [7.0, 5.0, 4.0, 3.0, 2.4, 1.28];

/// Tensions of the skin, N/m, and its modulus over its tension.
const TENSIONS_N_PER_M: [f64; 3] = [5.0, 30.0, 150.0];
const MODULUS_OVER_TENSION: f64 = 10.0;
/// Young's modulus of the one tissue, Pa, and its bulk moduli over this.
const YOUNG_PA: f64 = 5e3;
const BULK_OVER_YOUNG: [f64; 3] = [1.0, 10.0, 100.0];

/// A search, as far as a table needs it.
#[derive(Clone, Debug, Serialize)]
pub struct Found {
    name: String,
    /// Vertices that can move, and all constraints.
    free: usize,
    constraints: usize,
    /// Time to prepare the constraints, s.
    pub prepared_s: f64,
    pub steps: Vec<StepOf>,
    /// Largest memory of the process since the body was built, 10⁹ bytes.
    peak_gb: Option<f64>,
    complexity: f64,
}

/// The search after a step.
#[derive(Clone, Debug, Serialize)]
pub struct StepOf {
    /// Time from the start, s, and all cycles until now.
    pub s: f64,
    cycles: usize,
    /// Error that the search states. Infinite before it is known.
    stated: f64,
    /// Distance from the end of the search.
    pub error: f64,
}

/// A search with its system and the state of rest.
pub struct Demo {
    pub system: SceneSystem,
    pub rest: Vec<Point3<f64>>,
    pub found: Found,
}

impl Found {
    /// The first step with a stated error of at most `error`.
    fn at(&self, error: f64) -> Option<&StepOf> {
        self.steps.iter().find(|step| step.stated <= error)
    }

    /// The first step from which on the true error is at most [`AT_REST`].
    pub fn within(&self) -> Option<&StepOf> {
        let farther = self.steps.iter().rposition(|step| step.error > AT_REST);
        self.steps.get(farther.map_or(0, |step| step + 1))
    }

    pub fn is_abdomen(&self) -> bool {
        self.name.starts_with("abdomen")
    }
}

/// A scene with some keys set. The largest memory counts from here on.
fn built(name: &str, set: &[String]) -> Result<SceneSystem, Failure> {
    // Resets the peak (Linux, `proc_pid_clear_refs`). Elsewhere no peak is known.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let overrides: Vec<Override> = set
        .iter()
        .map(|text| {
            let (key, value) = text.split_once('=').context("no value")?;
            Ok(Override { key: key.to_owned(), value: value.to_owned() })
        })
        .collect::<Result<_, Failure>>()?;
    Ok(cutis::build_system(&Scene::load(&scene(name), &overrides)?)?)
}

/// The demo, with the distance from rest after each step.
pub fn demo() -> Result<Demo, Failure> {
    let system = built("demo", &[])?;
    let start = Instant::now();
    let body = Body::of(&system.system, system.settings.gravity_m_s2)?;
    let prepared_s = start.elapsed().as_secs_f64();
    let (found, rest) = follow("demo".into(), &system, &body, prepared_s, EXACT)?;
    Ok(Demo { system, rest, found })
}

/// The demo, and the abdomen in its region and whole.
pub fn bodies(demo: Found, most: usize) -> Result<Vec<Found>, Failure> {
    let mut found = vec![demo];
    for region in [None, Some("lattice.region=whole")] {
        let Some(mut set) = volume(Some("abdomen_ts_122x101x112.nii.gz")) else { break };
        set.extend(region.map(str::to_owned));
        let name = if region.is_some() { "abdomen, whole" } else { "abdomen" };
        found.extend(one(name, "abdomen-incision", &set, most)?);
    }
    Ok(found)
}

/// The whole demo on lattices from coarse to fine.
pub fn sizes(most: usize) -> Result<Vec<Found>, Failure> {
    let mut found = Vec::new();
    for spacing in SPACINGS_MM {
        let set = [format!("lattice.spacing_mm={spacing:?}"), "lattice.region=whole".to_owned()];
        found.extend(one(&format!("{spacing} mm"), "demo", &set, most)?);
    }
    Ok(found)
}

/// The demo with one tissue, from soft to nearly incompressible, under skin from slack to tight.
/// Also the usual tissues with bone a thousand times as stiff as fat.
pub fn stiffnesses(most: usize) -> Result<Vec<Found>, Failure> {
    let mut found = Vec::new();
    let region = "lattice.region={ around_mm = 105 }".to_owned();
    for tension in TENSIONS_N_PER_M {
        for ratio in BULK_OVER_YOUNG {
            let modulus = MODULUS_OVER_TENSION * tension;
            let skin = format!(
                "constraints.membrane={{ tension_along_n_per_m = {tension:?}, tension_across_n_per_m = {tension:?}, \
                 modulus_along_n_per_m = {modulus:?}, modulus_across_n_per_m = {modulus:?} }}"
            );
            let bulk = ratio * YOUNG_PA;
            let tissue = format!(
                "materials=[{{ name = 'tissue', youngs_modulus_pa = {YOUNG_PA:?}, bulk_modulus_pa = {bulk:?} }}]"
            );
            let name = format!("skin {tension} N/m, K/E {ratio}");
            found.extend(one(&name, "demo", &[skin, tissue, region.clone()], most)?);
        }
    }
    let contrast = "materials=[{ name = 'bone', hu = [150, 5000], youngs_modulus_pa = 2e6, bulk_modulus_pa = 1e7 }, \
                    { name = 'fat', hu = [-2000, -20], youngs_modulus_pa = 2e3, bulk_modulus_pa = 2e4 }, \
                    { name = 'muscle', youngs_modulus_pa = 1e4, bulk_modulus_pa = 1e5 }]";
    let free = "fixed.bone_above_hu=4000.0".to_owned();
    found.extend(one("bone and fat 1000:1, bone free", "demo", &[contrast.to_owned(), free, region], most)?);
    Ok(found)
}

/// The most cycles to 1 % over the least.
pub fn spread(found: &[Found]) -> String {
    let cycles = found.iter().filter_map(|found| found.at(AT_REST)).map(|step| step.cycles as f64);
    let (least, most) = cycles.fold((f64::INFINITY, 0.0_f64), |(low, high), n| (low.min(n), high.max(n)));
    format!("The most cycles to 1 % are {:.2} times the least.\n", most / least)
}

/// A search until the stated error is small. `None` if the body has too many vertices.
fn one(name: &str, scene: &str, set: &[String], most: usize) -> Result<Option<Found>, Failure> {
    let system = built(scene, set)?;
    let start = Instant::now();
    let body = Body::of(&system.system, system.settings.gravity_m_s2)?;
    let prepared_s = start.elapsed().as_secs_f64();
    if body.free_count() > most {
        return Ok(None);
    }
    let (found, _) = follow(name.into(), &system, &body, prepared_s, FINE)?;
    Ok(Some(found))
}

/// Makes steps until the search states this error. Returns the positions at rest as well.
fn follow(
    name: String,
    system: &SceneSystem,
    body: &Body,
    prepared_s: f64,
    error: f64,
) -> Result<(Found, Vec<Point3<f64>>), Failure> {
    let start = Instant::now();
    let mut search = Search::new(body, &Options { error, ..Options::default() })?;
    let mut s = start.elapsed().as_secs_f64();
    let mut cycles = 0;
    let mut steps = Vec::new();
    let mut track = Track(tempfile::tempfile()?);
    while !search.is_at_rest() {
        let start = Instant::now();
        cycles += search.step().with_context(|| name.clone())?.cycles;
        s += start.elapsed().as_secs_f64();
        track.push(&search.positions())?;
        steps.push(StepOf { s, cycles, stated: search.error(), error: f64::NAN });
    }
    let (rest, peak_gb) = (search.positions(), peak_gb());
    let start = system.system.to_f64().positions();
    track.0.rewind()?;
    for step in &mut steps {
        step.error = distance(&track.next(rest.len())?, &rest, &start);
    }
    let constraints = system.system.kinds().iter().map(|kind| kind.len()).sum();
    let (free, complexity) = (body.free_count(), search.rest().complexity);
    Ok((Found { name, free, constraints, prepared_s, steps, peak_gb, complexity }, rest))
}

/// Placements of a body in a file, so that they do not count as memory of the search.
struct Track(File);

impl Track {
    fn push(&mut self, x: &[Point3<f64>]) -> Result<(), Failure> {
        let mut file = BufWriter::new(&mut self.0);
        for x in x {
            file.write_all(bytemuck::bytes_of::<[f64; 3]>(&(*x).into()))?;
        }
        Ok(file.flush()?)
    }

    /// Reads the next placement of so many vertices.
    fn next(&mut self, count: usize) -> Result<Vec<Point3<f64>>, Failure> {
        let mut numbers = vec![[0.0; 3]; count];
        self.0.read_exact(bytemuck::cast_slice_mut(&mut numbers))?;
        Ok(numbers.into_iter().map(Point3::from).collect())
    }
}

/// Largest memory of this process since it was reset, in 10⁹ bytes. `None` if the system does not
/// tell.
fn peak_gb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? * 1024.0 / 1e9)
}

/// The distance from rest over the displacement from the start, both as roots of mean squares.
pub fn distance(x: &[Point3<f64>], rest: &[Point3<f64>], start: &[Point3<f64>]) -> f64 {
    let square = |a: &[Point3<f64>]| a.iter().zip(rest).map(|(a, b)| (a - b).norm_squared()).sum::<f64>();
    (square(x) / square(start)).sqrt()
}

/// Checks that the stated errors hold where the true ones are known.
pub fn check(all: &[&[Found]], checks: &mut Checks) {
    for found in all.iter().copied().flatten() {
        let (name, error) = (&found.name, found.at(AT_REST).map_or(f64::INFINITY, |step| step.error));
        let what = format!("{name}: {} from rest where 1 % is stated", percent(error));
        checks.add(what, error <= AT_REST);
        let line = format!("{name}: the first step is farther away");
        checks.control(line, found.steps.first().is_some_and(|step| step.stated > AT_REST));
    }
}

/// How much the number of cycles to 1 % grows from the coarsest lattice on.
pub fn growth(sizes: &[Found]) -> String {
    let cycles = |found: &Found| found.at(AT_REST).map_or(f64::NAN, |step| step.cycles as f64);
    let most = sizes.iter().map(cycles).fold(0.0, f64::max);
    format!("The cycles to 1 % grow {:.2} times.\n", most / sizes.first().map_or(f64::NAN, cycles))
}

/// A row per body.
pub fn table(found: &[Found]) -> Table {
    let mut table = Table::new([
        "body",
        "vertices that move",
        "constraints",
        "prepared, s",
        "within 1 %: s",
        "1 % stated: s",
        "steps",
        "cycles",
        "true error",
        "0.1 % stated: s",
        "cycles",
        "largest memory, GB",
    ]);
    for found in found {
        let count = |error: f64| found.steps.iter().take_while(|step| step.stated > error).count() + 1;
        let [rough, fine] = [AT_REST, FINE].map(|error| found.at(error));
        let seconds = |step: Option<&StepOf>| optional(step, |step| number(found.prepared_s + step.s));
        let cycles = |step: Option<&StepOf>| optional(step, |step| step.cycles.to_string());
        table.add([
            found.name.clone(),
            found.free.to_string(),
            found.constraints.to_string(),
            number(found.prepared_s),
            seconds(found.within()),
            seconds(rough),
            count(AT_REST).to_string(),
            cycles(rough),
            optional(rough, |step| percent(step.error)),
            seconds(fine),
            cycles(fine),
            optional(found.peak_gb, |gb| format!("{gb:.2}")),
        ]);
    }
    table
}
