//! How far from the wound the skin of scans moves, with the scan at rest and without, and how the
//! opening depends on the direction of the tension.

use anyhow::{Context, ensure};
use cutis::scene::IncisionSection;
use cutis::solver::Solver;
use cutis::solver_cpu::SolverCpu;
use cutis::{Override, Scene, SceneSystem};
use cutis_constraints::{Constraint, SkinStrip, SkinStripAtRest};
use nalgebra::{Point3, Vector3};

use crate::kit::{Checks, Failure, Row, Table, percent, scene};
use crate::main_job::{SCENES, volume};

/// The scene that also runs without the load. The others have several times as many vertices.
const CONTROL: &str = "demo";
/// Scenes whose incision is parallel to the z axis.
const ALONG_Z: [&str; 3] = ["demo", "abdomen-incision", "thigh-incision"];
/// Distances from the incision, in mm.
const DISTANCES: [f64; 4] = [20.0, 40.0, 60.0, 120.0];
/// Index of 60 mm in [`DISTANCES`].
const FAR: usize = 2;
/// A vertex that is displaced farther than this has moved, mm.
const MOVED_MM: f64 = 0.05;
/// Tension along the lines and across them, N/m.
const TENSIONS: [f64; 2] = [3.0, 1.0];
/// Largest relative change of the opening over the last ten frames.
const MOST_CHANGE: f64 = 0.02;
/// Largest relative difference of a ratio of openings from that of the tensions.
const MOST_OFF: f64 = 0.1;
/// Frames over which the opening must not change.
const LAST_FRAMES: usize = 10;

/// The tables of the page and the checks.
pub(super) struct Scans {
    pub(super) reaches: Table,
    pub(super) directions: Table,
    pub(super) checks: Checks,
}

impl Scans {
    /// Runs all scenes whose scan is present.
    ///
    /// # Errors
    /// A scene is refused, or a scan is missing and `all` is true.
    pub(super) fn measure(all: bool) -> Result<Self, Failure> {
        let mut checks = Checks::default();
        let (mut reaches, mut directions) = (Vec::new(), Vec::new());
        for (name, scan) in SCENES {
            let Some(set) = volume(scan) else {
                ensure!(!all, "{name}: the page needs all scans (set CUTIS_TEST_DATA)");
                continue;
            };
            let held = Reach::of(name, &set, true)?;
            held.settled(&mut checks);
            if name == CONTROL {
                let free = Reach::of(name, &set, false)?;
                let [at_rest, not] = [&held, &free].map(|reach| percent(reach.moved));
                let what =
                    format!("{name}, not at rest: {not} of the skin beyond 60 mm moves, at rest {at_rest}");
                checks.control(what, free.moved > held.moved);
                reaches.push(free);
            }
            reaches.push(held);
            if ALONG_Z.contains(&name) {
                let directed = Directed::of(name, &set)?;
                let ratio = directed.ratio();
                let off = ratio * TENSIONS[1] / TENSIONS[0] - 1.0;
                checks.add(format!("{name}: the openings have the ratio {ratio:.2}"), off.abs() <= MOST_OFF);
                directions.push(directed);
            }
        }
        Ok(Self { reaches: Table::of(&reaches), directions: Table::of(&directions), checks })
    }
}

/// A scene after its last frame.
struct Moved {
    before: Vec<Point3<f64>>,
    after: Vec<Point3<f64>>,
    /// Vertices of the skin, each once.
    skin: Vec<u32>,
    incision: IncisionSection,
    /// Growth of the mean opening, mm.
    growth_mm: f64,
    /// Relative change of the opening over the last frames.
    change: f64,
}

impl Moved {
    /// Runs a scene of `fixtures/scenes` with changes `KEY=VALUE`. Positions are in mm.
    fn of(name: &str, set: &[String]) -> Result<Self, Failure> {
        let changes = set.iter().filter_map(|change| change.split_once('='));
        let changes = changes.map(|(key, value)| Override { key: key.into(), value: value.into() });
        let loaded = Scene::load(&scene(name), &changes.collect::<Vec<_>>())?;
        let SceneSystem { system, settings, gapes, frame } = cutis::build_system(&loaded)?;
        let strips = [SkinStripAtRest::NAME, SkinStrip::NAME];
        let strips = system.kinds().iter().find(|kind| strips.contains(&kind.name()));
        let mut skin = strips.with_context(|| format!("{name} has no membrane"))?.indices().to_vec();
        skin.sort_unstable();
        skin.dedup();
        let gape = gapes.first().with_context(|| format!("{name} has no incision"))?;
        let before = system.positions();
        let mut solver = SolverCpu::new(system, settings, None)?;
        solver.step(loaded.scene.run.frames as usize - LAST_FRAMES)?;
        let late = gape.measure(&solver.positions()?).mean_mm;
        solver.step(LAST_FRAMES)?;
        let after = solver.positions()?;
        let [first, last] = [&before, &after].map(|x| gape.measure(x).mean_mm);
        let [before, after] =
            [before, after].map(|x| x.into_iter().map(|x| frame.to_mm(x)).collect::<Vec<_>>());
        let incision = loaded.scene.incision[0].clone();
        eprintln!("{name} {set:?}: {first:.3} mm, {late:.3} mm, {last:.3} mm");
        Ok(Self { before, after, skin, incision, growth_mm: last - first, change: (last - late) / last })
    }
}

/// Displacements of the skin in a scene.
struct Reach {
    scene: &'static str,
    at_rest: bool,
    /// Growth of the mean opening, mm.
    growth_mm: f64,
    /// Relative change of the opening over the last frames.
    change: f64,
    /// Largest displacement of a vertex of the skin that is farther from the incision than each of
    /// [`DISTANCES`], mm.
    beyond_mm: [f64; 4],
    /// Share of the vertices beyond 60 mm that have moved.
    moved: f64,
}

impl Reach {
    /// Runs a scene of `fixtures/scenes`.
    ///
    /// # Errors
    /// The scene is refused, or has no membrane or no incision.
    fn of(name: &'static str, set: &[String], at_rest: bool) -> Result<Self, Failure> {
        let set = [set, &[format!("scan_is_at_rest={at_rest}"), "lattice.region=whole".to_owned()]].concat();
        let Moved { before, after, skin, incision, growth_mm, change } = Moved::of(name, &set)?;
        let path: Vec<Point3<f64>> = incision.path().into_iter().map(Point3::from).collect();
        let from_path = |position: Point3<f64>| {
            let segments = path.windows(2).map(|ends| to_segment(position, ends[0], ends[1] - ends[0]));
            segments.fold(f64::INFINITY, f64::min)
        };
        let mut beyond_mm = [0.0_f64; 4];
        let (mut far, mut moved) = (0, 0);
        for v in skin.into_iter().map(|v| v as usize) {
            let distance = from_path(before[v]);
            let displacement = (after[v] - before[v]).norm();
            for (beyond, _) in beyond_mm.iter_mut().zip(DISTANCES).filter(|(_, least)| distance > *least) {
                *beyond = beyond.max(displacement);
            }
            if distance > DISTANCES[FAR] {
                far += 1;
                moved += usize::from(displacement > MOVED_MM);
            }
        }
        let moved = moved as f64 / far as f64;
        Ok(Self { scene: name, at_rest, growth_mm, change, beyond_mm, moved })
    }

    /// The wound must have come to rest.
    fn settled(&self, checks: &mut Checks) {
        let Self { scene, change, .. } = self;
        let what = format!("{scene}: the opening changes by {} at the end", percent(*change));
        checks.add(what, change.abs() < MOST_CHANGE);
    }
}

/// Growth of the opening with the lines of tension across the incision and along it.
struct Directed {
    scene: &'static str,
    growth_mm: [f64; 2],
}

impl Directed {
    /// Runs a scene whose incision is parallel to the z axis, with lines around this axis and along
    /// it. Both directions have the same modulus.
    ///
    /// # Errors
    /// The scene is refused, or has no incision.
    fn of(name: &'static str, set: &[String]) -> Result<Self, Failure> {
        let growth = |lines: &str| -> Result<f64, Failure> {
            let [along, across] = TENSIONS;
            let membrane = format!(
                "constraints.membrane={{ tension_along_n_per_m = {along:?}, tension_across_n_per_m = \
                 {across:?}, modulus_along_n_per_m = 50.0, modulus_across_n_per_m = 50.0, directions = {{ \
                 {lines} = [0, 0, 1] }} }}"
            );
            let region = "lattice.region={ around_mm = 60 }".to_owned();
            Ok(Moved::of(name, &[set, &[membrane, region]].concat())?.growth_mm)
        };
        Ok(Self { scene: name, growth_mm: [growth("around")?, growth("along")?] })
    }

    /// Opening across the lines over opening along them.
    fn ratio(&self) -> f64 {
        self.growth_mm[0] / self.growth_mm[1]
    }
}

/// Distance of a place from a segment.
fn to_segment(place: Point3<f64>, from: Point3<f64>, along: Vector3<f64>) -> f64 {
    let share = (place - from).dot(&along) / along.norm_squared();
    (place - from - along * share.clamp(0.0, 1.0)).norm()
}

impl Row for Reach {
    const COLUMNS: &'static [&'static str] = &[
        "scene",
        "scan at rest",
        "growth of the opening",
        "beyond 20 mm",
        "beyond 40 mm",
        "beyond 60 mm",
        "beyond 120 mm",
        "moved, beyond 60 mm",
    ];

    fn cells(&self) -> Vec<String> {
        let at_rest = if self.at_rest { "yes" } else { "no" };
        let head = [self.scene.into(), at_rest.into(), format!("{:.2} mm", self.growth_mm)];
        let beyond = self.beyond_mm.map(|mm| format!("{mm:.3} mm"));
        head.into_iter().chain(beyond).chain([percent(self.moved)]).collect()
    }
}

impl Row for Directed {
    const COLUMNS: &'static [&'static str] =
        &["scene", "lines across the cut", "lines along the cut", "ratio"];

    fn cells(&self) -> Vec<String> {
        let [across, along] = self.growth_mm.map(|mm| format!("{mm:.3} mm"));
        vec![self.scene.into(), across, along, format!("{:.2}", self.ratio())]
    }
}
