//! The pictures of a run: the skin before and after, a slice across the wound, and the lines of
//! tension on the skin.

use std::path::PathBuf;

use cutis_mesh::Slit;
use cutis_render::{
    Contour, Image, LineField, Plane, Rgb, Side, SkinPaths, SliceView, View, bare_sides, draw_annotations,
    draw_lines, draw_paths, side_by_side, skin_depth, slice,
};
use cutis_volume::Volume;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::DeformedBody;
use super::html::Figure;
use super::skin_lines::SkinLines;
use super::slices::{self, SlicePair};
use super::small_picture::smaller;
use super::warp::BodyWarp;
use super::wound_place::{WoundPlace, position};
use crate::backend::Stages;
use crate::body::{Body, Membrane};
use crate::run::files::RunFolder;
use crate::scene::Scene;
use crate::{Error, Progress};

/// Pixels along each side of the skin pictures.
const PIXELS: usize = 900;
/// Depth below which all tissue has the same color, mm.
const DEEPEST_MM: f64 = 20.0;
/// Voxels around the walls of wounds for which the depth is known.
const MARGIN: f64 = 4.0;

/// Colors of the contours at rest and deformed.
const COLORS: [Rgb; 2] = [[90, 160, 255], [255, 170, 60]];
/// Color of the lines of tension.
const LINES: Rgb = [20, 50, 120];
/// Color of the path of a cut that is closed.
const PATH: Rgb = [40, 20, 30];
/// Gray of slices at the low end of their window. The edge between skin and air then appears where
/// the CT is halfway between them, and the walls of cuts appear as smooth as they are.
pub(super) const EDGE_GRAY: f32 = 0.4;

/// Parts into which the path of a segment of a cut is divided.
const PATH_PARTS: u32 = 64;
/// Caption of the slices.
const SLICE: &str = "Slice across the middle, with the skin of the model at rest (blue) and deformed (orange). It \
                     lies up to half a lattice step below the skin of the CT. A voxel that is partly air is dark \
                     gray: the edge of the skin is where the CT is halfway between tissue and air";

/// What was drawn.
pub(super) struct Pictures {
    /// The pictures of the run folder.
    pub(super) figures: Vec<Figure>,
    /// Slices for the report; none without it.
    pub(super) slices: Vec<SlicePair>,
}

/// Draws a run: the skin before and after, a slice before and after, and the lines of tension of a
/// membrane. Before, the CT has the cuts from the start. `after` is the deformed CT.
///
/// # Errors
/// The errors of the resampler and the renderer.
pub(super) fn draw(
    deformed: &DeformedBody<'_>,
    warp: &BodyWarp,
    after: &Volume,
    stages: &mut Stages,
    progress: &dyn Progress,
) -> Result<Pictures, Error> {
    let before = warp.cut_at_rest(deformed.ct, stages, progress)?;
    let volumes = BeforeAfter { before: &before, after, place: WoundPlace::of(deformed.body) };
    let (slices, skins) = rayon::join(
        || draw_slices(deformed, &volumes),
        || draw_skins(deformed, &volumes, warp, stages, progress),
    );
    let ((across, slices), mut drawn) = (slices?, skins?);
    drawn.insert(2, (RunFolder::slice, SLICE, true, across));
    let figures = drawn.par_iter().map(figure).collect::<Result<_, _>>()?;
    Ok(Pictures { figures, slices })
}

/// What the pictures show.
struct BeforeAfter<'a> {
    before: &'a Volume,
    after: &'a Volume,
    /// The wound. None if the scene cuts nothing.
    place: Option<WoundPlace>,
}

/// Draws the slice across the wound before and after, and the slices for the report.
fn draw_slices(
    deformed: &DeformedBody<'_>,
    shown: &BeforeAfter<'_>,
) -> Result<(Image, Vec<SlicePair>), Error> {
    let (body, place) = (deformed.body, shown.place.as_ref());
    let (start, end) = (body.skin_at_start(), body.whole_skin(deformed.positions));
    let skins = [(&start.0[..], &start.1[..]), (&end.0[..], &end.1[..])];
    let contour = |n: usize| {
        let (positions, triangles) = skins[n];
        Contour { origin_mm: body.mesh.frame.origin_mm, positions, triangles, color: COLORS[n] }
    };
    let (plane, middle_mm) = match place {
        Some(place) => (place.plane_across(), place.middle_mm),
        None => (Plane::Axial, body.mesh.frame.origin_mm.into()),
    };
    let across = |volume: &Volume, contours: &[Contour<'_>]| {
        let view = SliceView {
            contours,
            focus: place.map(|place| place.slice),
            edge_gray: EDGE_GRAY,
            long_side: Some(PIXELS),
            ..SliceView::new(plane, position(plane, middle_mm))
        };
        slice(volume, &view)
    };
    let before = across(shown.before, &[contour(0)])?;
    let after = across(shown.after, &[contour(0), contour(1)])?;
    let both = side_by_side(&[(&before, "before"), (&after, "after")])?;
    let of_planes = match deformed.scene.output.report {
        true => slices::pairs([shown.before, shown.after], skins, COLORS, &body.mesh.frame, place)?,
        false => Vec::new(),
    };
    Ok((both, of_planes))
}

/// Draws the skin before and after, and the lines of tension of a membrane.
fn draw_skins(
    deformed: &DeformedBody<'_>,
    shown: &BeforeAfter<'_>,
    warp: &BodyWarp,
    stages: &mut Stages,
    progress: &dyn Progress,
) -> Result<Vec<Drawn>, Error> {
    let DeformedBody { body, ct, scene, .. } = *deformed;
    let (before, place) = (shown.before, shown.place.as_ref());
    let air_below_hu = scene.tissue.air_below_hu;
    let depth = warp.walls_mm().map(|walls_mm| depths(ct, air_below_hu, walls_mm, warp, stages, progress));
    let (depth_before, depth_after) = depth.transpose()?.unzip();
    let view = View {
        width: PIXELS,
        height: PIXELS,
        focus: place.map(|place| place.close_up),
        depth: depth_before.as_ref(),
        threshold_hu: air_below_hu,
        ..View::new(place.map_or(Side::Anterior, |place| Side::From(place.outward)))
    };
    // The picture of the lines has the same skin. It is drawn without letters, which the lines
    // would cross.
    let skin = stages.raymarch(before, &View { annotate: false, ..view })?;
    let mut skin_before = skin.clone();
    let closed = closed_cuts(body);
    let caption_before = match closed.is_empty() {
        true => "Before the first frame",
        false => "Before the first frame. The line is the path of the cut, which is still closed",
    };
    if !closed.is_empty() {
        let label = if closed.len() == 1 { "path of the cut" } else { "paths of the cuts" };
        draw_paths(&mut skin_before, before, &view, &SkinPaths { paths_mm: &closed, color: PATH, label })?;
    }
    draw_annotations(&mut skin_before, before, &view)?;
    let skin_after = stages.raymarch(shown.after, &View { depth: depth_after.as_ref(), ..view })?;
    let mut drawn: Vec<Drawn> = vec![
        (RunFolder::before, caption_before, false, skin_before),
        (RunFolder::after, "After", false, skin_after),
    ];
    if body.membrane.as_ref().is_some_and(Membrane::has_lines) {
        let mut picture = skin;
        add_lines(&mut picture, body, scene, before, &view)?;
        let caption = "Lines of tension in the scan: the skin is tightest along them. They are faint where the \
                       direction counts little";
        drawn.push((RunFolder::tension, caption, false, picture));
    }
    Ok(drawn)
}

/// The paths of the incisions without a width, which cannot be seen before they open, world mm.
fn closed_cuts(body: &Body) -> Vec<Vec<Point3<f64>>> {
    let frame = &body.mesh.frame;
    let world = |local: Point3<f64>| frame.origin_mm + local.coords * 1000.0;
    let points = |slit: &Slit| {
        let at = |n: u32| world(slit.skin_at(slit.length() * f64::from(n) / f64::from(PATH_PARTS)));
        (0..=PATH_PARTS).map(at).collect::<Vec<_>>()
    };
    let closed = body.cut.incisions().filter(|slits| slits.iter().all(Slit::removes_nothing));
    closed.map(|slits| slits.iter().flat_map(points).collect()).collect()
}

/// The path of a picture in the run folder, its caption, whether it is wide, and the picture.
type Drawn = (fn(&RunFolder) -> PathBuf, &'static str, bool, Image);

/// A picture of the run folder and of the report.
fn figure((path, caption, wide, image): &Drawn) -> Result<Figure, Error> {
    let png = image.to_png()?;
    Ok(Figure { path: *path, caption, wide: *wide, small: smaller(image, &png)?, png })
}

/// Draws the lines of tension of a membrane on a picture of the body at rest.
fn add_lines(
    picture: &mut Image,
    body: &Body,
    scene: &Scene,
    volume: &Volume,
    view: &View<'_>,
) -> Result<(), Error> {
    let (positions, triangles) = body.whole_skin(&body.mesh.positions);
    let Some(lines) = SkinLines::of(body, scene) else { return Ok(()) };
    let field = LineField {
        origin_mm: body.mesh.frame.origin_mm,
        positions: &positions,
        triangles: &triangles,
        directions: &lines.directions,
        weights: &lines.weights,
        color: LINES,
        label: "lines of tension",
    };
    Ok(draw_lines(picture, volume, view, &field)?)
}

/// Depth below the skin at rest, mm, which colors the wound: at rest and deformed, around the walls
/// of wounds.
fn depths(
    ct: &Volume,
    air_below_hu: f32,
    [low, high]: [Point3<f64>; 2],
    warp: &BodyWarp,
    stages: &mut Stages,
    progress: &dyn Progress,
) -> Result<(Volume, Volume), Error> {
    let spacing = ct.grid().affine.spacing_mm();
    let finest = spacing.into_iter().fold(f64::INFINITY, f64::min);
    let margin = Vector3::repeat(MARGIN * spacing.into_iter().fold(0.0, f64::max));
    let within = Some([low - margin, high + margin]);
    let at_rest = skin_depth(ct, air_below_hu, finest, DEEPEST_MM, within)?;
    let deformed = warp.apply_to_centers(&at_rest, stages, progress)?.0;
    Ok((at_rest, bare_sides(deformed, ct.grid())?))
}
