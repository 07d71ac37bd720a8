//! What the report tells about what is done to the body: a timeline, and the forces of handles.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::scene::{IncisionSection, Scene, WoundRef};

/// Something that is done to the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepReport {
    /// The section of the scene, such as `incision[0]`.
    pub section: String,
    /// Time at which it begins, s.
    pub at_s: f64,
    /// Time at which it ends, s.
    pub until_s: f64,
    /// What is done, with sizes.
    pub what: String,
}

impl StepReport {
    /// All that is done to a body, in the order of time.
    pub(crate) fn all(scene: &Scene, body: &Body) -> Vec<Self> {
        let mut steps = Vec::new();
        steps.extend(incisions(scene, body));
        steps.extend(excisions(scene, body));
        steps.extend(underminings(scene));
        steps.extend(sutures(scene, body));
        steps.extend(handles(scene, body));
        steps.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        steps
    }

    /// One line.
    pub fn summary(&self) -> String {
        let Self { section, at_s, until_s, what } = self;
        let time = if until_s > at_s { format!("{at_s} to {until_s:.3} s") } else { format!("{at_s} s") };
        format!("{time}: {section}: {what}")
    }
}

fn step(section: String, [at_s, until_s]: [f64; 2], what: String) -> StepReport {
    StepReport { section, at_s, until_s, what }
}

fn named(name: Option<&str>) -> String {
    name.map(|name| format!("{name:?}, ")).unwrap_or_default()
}

fn wound_name(wound: &WoundRef) -> String {
    match wound {
        WoundRef::Number(number) => format!("wound {number}"),
        WoundRef::Name(name) => format!("{name:?}"),
    }
}

fn incisions<'a>(scene: &'a Scene, body: &'a Body) -> impl Iterator<Item = StepReport> + 'a {
    let of = |(n, (section, slits)): (usize, (&IncisionSection, &[cutis_mesh::Slit]))| {
        let IncisionSection { depth_mm, width_mm, at_s, speed_mm_s, .. } = *section;
        let length = slits.iter().map(cutis_mesh::Slit::length).sum::<f64>() * 1000.0;
        let until = at_s + speed_mm_s.map_or(0.0, |speed| length / speed);
        let width = width_mm.map(|width| format!(", {width} mm wide")).unwrap_or_default();
        let name = named(section.name.as_deref());
        let what = format!("incise, {name}{length:.1} mm long, {depth_mm} mm deep{width}");
        step(format!("incision[{n}]"), [at_s, until], what)
    };
    scene.incision.iter().zip(body.cut.incisions()).enumerate().map(of)
}

fn underminings(scene: &Scene) -> impl Iterator<Item = StepReport> + '_ {
    scene.undermining.iter().enumerate().map(|(n, section)| {
        let until = section.at_s + section.speed_mm_s.map_or(0.0, |speed| section.distance_mm / speed);
        let what = format!(
            "undermine {}, {} mm around it, {} mm deep{}",
            wound_name(&section.wound),
            section.distance_mm,
            section.depth_mm,
            if section.adheres { ", adheres" } else { "" }
        );
        step(format!("undermining[{n}]"), [section.at_s, until], what)
    })
}

fn excisions<'a>(scene: &'a Scene, body: &'a Body) -> impl Iterator<Item = StepReport> + 'a {
    scene.excision.iter().zip(&body.cut.pieces).enumerate().map(|(n, (section, piece))| {
        let length = piece.axis().length() * 1000.0;
        let width = body.cut.gapes.get(scene.incision.len() + n);
        let width = width.map(|gape| gape.measure(&body.mesh.positions).mid_mm).unwrap_or_default();
        let name = named(section.name.as_deref());
        let what = format!("excise, {name}{length:.1} × {width:.1} mm, {} mm deep", section.depth_mm);
        step(format!("excision[{n}]"), [section.at_s; 2], what)
    })
}

fn sutures<'a>(scene: &'a Scene, body: &'a Body) -> impl Iterator<Item = StepReport> + 'a {
    scene.suture.iter().zip(&body.stitches).enumerate().map(|(n, (section, stitches))| {
        let wound = wound_name(&section.wound);
        let release = section.release_s.map(|at| format!(", released at {at} s")).unwrap_or_default();
        let what = format!("suture {wound} with {} stitches{release}", stitches.len());
        step(format!("suture[{n}]"), [section.at_s, section.at_s + section.tighten_s], what)
    })
}

fn handles<'a>(scene: &'a Scene, body: &'a Body) -> impl Iterator<Item = StepReport> + 'a {
    scene.handle.iter().zip(&body.grabbed).enumerate().map(|(n, (section, grabbed))| {
        let distance = section.displacement_mm().iter().map(|mm| mm * mm).sum::<f64>().sqrt();
        let what = format!("move {} vertices by {distance:.1} mm", grabbed.len());
        step(format!("handle[{n}]"), [section.at_s, section.at_s + section.over_s], what)
    })
}

/// A handle after the last frame. In PBD there are no forces, and the list of handles is empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HandleReport {
    /// Number of vertices that it holds.
    pub vertices: usize,
    /// Size of the force with which it holds them against the body, N.
    pub force_n: f64,
}

impl HandleReport {
    /// One line.
    pub fn summary(&self) -> String {
        format!("handle: {:.2} N hold {} vertices", self.force_n, self.vertices)
    }
}
