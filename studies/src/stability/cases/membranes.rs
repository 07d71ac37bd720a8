//! Membranes of skin strips, at rest and shrinking: materials, shapes, time and forces.

use cutis_solver::Handle;
use cutis_test_kit::Random;
use nalgebra::{Point3, Vector3};

use super::UNDAMPED;
use crate::stability::body::{Body, Law};
use crate::stability::case::{Case, End, Run};
use crate::stability::membrane::Membrane;

const COLUMNS: i64 = 4;
const TRUNK: Membrane = Membrane::TRUNK;
const STIFFENING: Membrane = Membrane { stiffening: 1e6, ..TRUNK };
/// Reasons of known failures.
const STIFFENING_BY_DESCENT: &str =
    "A step of descent from slack skin uses the curvature of slack skin, and overshoots";
const SLACK_BY_DESCENT: &str = "the loads push compressed skin too far in a step of descent";
/// The shapes whose loads push stiff skin too far.
const JUMPS: [&str; 6] = [
    WEAK,
    "one triangle compressed to a tenth, tension 0.1",
    "collapsed to a point",
    "collapsed to a point within 1e-6",
    "compressed to a tenth",
    "compressed to seven tenths, compression 1",
];
const SUM_OF_STRIPS: &str = "the twelve strips of a vertex move it one after the other";
const SUM_OF_SLACK_STRIPS: &str = "the slack strips of a vertex push it one after the other";
/// A shape whose loads are weak and whose strips are slack.
const WEAK: &str = "compressed to a tenth, tension 0.01, no springs";
/// The stiffnesses of membranes that shrink.
const SHRINKING: [Law; 3] = [Law::SOFT, Law::RIGID, Law::DESCENT];

pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (laws, at_rest) in [(&Law::ALL[..], true), (&SHRINKING, false)] {
        for &law in laws {
            let sheets = Sheets { law, at_rest };
            sheets.materials(&mut cases);
            sheets.shapes(&mut cases);
            sheets.time(&mut cases);
        }
    }
    Law::ALL.iter().for_each(|&law| unmoved(&mut cases, law));
    cases
}

/// Sheets of one law that are at rest, or that shrink with a fixed border.
#[derive(Clone, Copy)]
struct Sheets {
    law: Law,
    at_rest: bool,
}

impl Sheets {
    fn sheet(self, membrane: Membrane) -> Body {
        let body = Membrane { at_rest: self.at_rest, ..membrane }.sheet(COLUMNS, self.law);
        match self.law {
            _ if self.at_rest => body,
            // Rigid springs and rigid strips cannot both have their length.
            Law::RIGID => Body { edges: Vec::new(), ..body },
            _ => with_fixed_border(body),
        }
    }

    fn case(self, name: &str, body: Body, end: End) -> Case {
        let does = if self.at_rest { "at rest" } else { "shrinking" };
        let case = Case::new(format!("strips {does}, {name}, {}", self.law.name()), body, end);
        // Rest takes longer than the return to the rest shape.
        let samples = if end == End::Rests { 360 } else { 120 };
        Case { run: Run { samples, ..case.run }, ..case }
    }

    /// The end of a sheet that starts near its rest shape.
    fn end(self) -> End {
        if self.at_rest || self.law == Law::RIGID { End::Recovers(0.02) } else { End::Rests }
    }

    fn materials(self, cases: &mut Vec<Case>) {
        let moving = |membrane| {
            let mut random = Random::new(2);
            let mut body = placed(self.sheet(membrane), |x| {
                Point3::new(1.15 * x.x, 0.9 * x.y, x.z) + random.vector() * 0.1
            });
            let free = body.inverse_masses.iter().map(|w| *w > 0.0);
            let free = body.velocities.iter_mut().zip(free).filter(|(_, free)| *free);
            free.for_each(|(v, _)| *v = random.vector());
            body
        };
        for (name, membrane) in [
            ("tension 0.25", TRUNK),
            ("tension 0.999", Membrane { tension: 0.999, ..TRUNK }),
            ("no tension", Membrane { tension: 0.0, ..TRUNK }),
            ("1e3 times as stiff as its springs", Membrane { contrast: 1e3, ..TRUNK }),
            ("compression 1", Membrane { compression: 1.0, ..TRUNK }),
            ("stiffening 100", Membrane { stiffening: 100.0, ..TRUNK }),
            ("stiffening 1e6", STIFFENING),
        ] {
            // Nothing brings a sheet without tension back into its plane.
            let end = if membrane.tension > 0.0 { self.end() } else { End::Bounded };
            let case = self.case(name, moving(membrane), end);
            let resolved = membrane.contrast <= TRUNK.contrast && membrane.stiffening == 0.0;
            let case = if resolved { case } else { case.unresolved() };
            let overshoots = membrane == STIFFENING && self.law.is_implicit();
            let case = Case { quick: !overshoots && membrane != TRUNK, ..case };
            cases.push(if overshoots { case.known_failure(STIFFENING_BY_DESCENT) } else { case });
        }
        cases.push(self.case("undamped", moving(TRUNK), End::Bounded).run(UNDAMPED));
        for (name, stiffening) in [("stiffening 1", 1.0), ("stiffening 1e6", 1e6)] {
            let sheet = self.sheet(Membrane { stiffening, ..TRUNK });
            let held = with_fixed_border(sheet).placed(|x| x * 10.0);
            let case = self.case(&format!("{name}, held a hundredfold"), held, End::Rests).unresolved();
            let too_much = stiffening == 1e6 && self.law == Law::SOFT;
            cases.push(if too_much { case.known_failure(SUM_OF_STRIPS) } else { case.quick() });
        }
    }

    fn shapes(self, cases: &mut Vec<Case>) {
        let mut add = |name: &str, body, end| {
            let case = self.case(name, body, end);
            // Every substep is sampled, so that the effect of a single one shows.
            let samples = 4 * case.run.samples;
            let case = Case { run: Run { substeps: 1, samples, ..case.run }, ..case };
            let why = match self.law {
                Law::STIFF_DESCENT if self.at_rest && JUMPS.contains(&name) => Some(SLACK_BY_DESCENT),
                Law::RIGID | Law::PBD if name == WEAK => Some(SUM_OF_SLACK_STRIPS),
                _ => None,
            };
            cases.push(why.map_or(case.clone().quick(), |why| case.known_failure(why)));
        };
        let sheet = || self.sheet(TRUNK);
        // Strips without springs resist no compression.
        let compressed = if self.law == Law::RIGID && !self.at_rest { End::Bounded } else { self.end() };
        // Descent starts from the loads, and a border from its springs.
        let collapsed = if self.at_rest && !self.law.is_implicit() { End::Named } else { End::Bounded };
        let mut flat = sheet();
        flat.rest.iter_mut().for_each(|x| x.z = 0.0);
        add("collapsed to a point", placed(flat.clone(), |_| Point3::origin()), collapsed);
        add("collapsed to a line", placed(flat, |x| Point3::new(x.x, 0.0, 0.0)), End::Bounded);
        let mut random = Random::new(4);
        let within = placed(sheet(), |_| Point3::origin() + random.vector() * 1e-6);
        add("collapsed to a point within 1e-6", within, End::Bounded);
        for (name, to, compression) in [
            ("compressed to four fifths", 0.8, 0.0),
            ("compressed to a tenth", 0.1, 0.0),
            ("compressed to seven tenths, compression 1", 0.7, 1.0),
            ("compressed to a tenth, compression 1", 0.1, 1.0),
        ] {
            let body = self.sheet(Membrane { compression, ..TRUNK });
            add(name, placed(body, |x| Point3::new(to * x.x, to * x.y, x.z)), compressed);
        }
        if self.at_rest {
            let slack = |tension| {
                let sheet = Body { edges: Vec::new(), ..self.sheet(Membrane { tension, ..TRUNK }) };
                placed(sheet, |x| Point3::new(0.1 * x.x, 0.1 * x.y, x.z))
            };
            let (weak, sheet) = (slack(0.01), slack(0.1));
            let triangle = Body { triangles: sheet.triangles[..1].to_vec(), ..sheet };
            add("one triangle compressed to a tenth, tension 0.1", triangle, End::Bounded);
            add(WEAK, weak, End::Bounded);
        }
        let mut body = sheet();
        let middle = body.start.len() / 2;
        body.start[middle] += Vector3::new(1.6, 0.3, 0.2);
        add("triangles inverted", body, self.end());
        add("turned over", placed(sheet(), |x| Point3::new(x.x, -x.y, -x.z)), End::Bounded);
        let mut random = Random::new(6);
        add("random scramble", placed(sheet(), |_| Point3::origin() + random.vector() * 2.0), End::Bounded);
        let mut body = sheet();
        body.rest.iter_mut().for_each(|x| *x = Point3::new(0.01 * x.x, x.y, 0.01 * x.z));
        let mut random = Random::new(7);
        let part = Vector3::new(0.001, 0.1, 0.001);
        add("slivers", placed(body, |x| x + part.component_mul(&random.vector())), End::Bounded);
    }

    fn time(self, cases: &mut Vec<Case>) {
        let mut random = Random::new(3);
        let body = placed(self.sheet(TRUNK), |x| x + random.vector() * 0.1);
        let run = Run { h: 1.0, samples: 50, ..Run::default() };
        cases.push(self.case("substeps of 1e0 s", body, self.end()).run(run).unresolved().quick());
        let mut body = self.sheet(TRUNK);
        let corner = if self.at_rest { body.rest.len() - 1 } else { body.rest.len() / 2 };
        body.handles.push(Handle {
            vertices: vec![corner as u32],
            move_m: [20.0, 15.0, 10.0],
            at_s: 0.0,
            over_s: 0.0,
        });
        cases.push(self.case("a vertex torn off by five body sizes at once", body, End::Bounded).quick());
        let mut random = Random::new(8);
        let mut body = placed(self.sheet(TRUNK), |x| x + random.vector() * 0.1);
        for w in body.inverse_masses.iter_mut().filter(|w| **w > 0.0) {
            *w = 10f64.powf(3.0 * random.between(-1.0, 1.0));
        }
        cases.push(self.case("random masses 1e-3 to 1e3", body, End::Bounded));
    }
}

/// Sheets at rest in their rest shape: no bit changes, under any tension.
fn unmoved(cases: &mut Vec<Case>, law: Law) {
    let sheets = Sheets { law, at_rest: true };
    for (name, membrane) in [
        ("not deformed", TRUNK),
        ("not deformed, tension 0.999, stiffening 1e6", Membrane { tension: 0.999, ..STIFFENING }),
    ] {
        cases.push(sheets.case(name, sheets.sheet(membrane), End::Unmoved).quick());
    }
    let mut body = sheets.sheet(TRUNK);
    body.offset = Vector3::new(2e4, -1e4, 3e4);
    cases.push(sheets.case("1e4 body sizes from the origin", body, End::Unmoved).quick());
}

/// Fixes the outermost columns and rows.
fn with_fixed_border(mut body: Body) -> Body {
    let most = body.rest.iter().map(|x| x.y).fold(0.0, f64::max);
    let is_border = |x: &Point3<f64>| x.x.abs() > COLUMNS as f64 / 2.0 - 0.6 || x.y.abs() > most - 0.1;
    body.inverse_masses.iter_mut().zip(&body.rest).filter(|(_, x)| is_border(x)).for_each(|(w, _)| *w = 0.0);
    body
}

/// Sets the start positions of the vertices that can move: `place` of each rest position.
fn placed(mut body: Body, mut place: impl FnMut(Point3<f64>) -> Point3<f64>) -> Body {
    body.start = body.rest.clone();
    for (x, _) in body.start.iter_mut().zip(&body.inverse_masses).filter(|(_, w)| **w > 0.0) {
        *x = place(*x);
    }
    body
}
