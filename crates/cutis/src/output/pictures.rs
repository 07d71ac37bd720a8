//! The pictures of a run: the skin before and after, and a slice across the wound.

use cutis_mesh::Slit;
use cutis_render::{Contour, Focus, Plane, Side, SliceView, View, side_by_side, skin_depth, slice};
use cutis_volume::Volume;
use nalgebra::{Point3, Vector3};

use super::DeformedBody;
use super::html::Figure;
use super::warp::BodyWarp;
use crate::backend::Stages;
use crate::{Error, Progress};

/// Pixels along each side of the skin pictures.
const PIXELS: usize = 900;
/// Size of a close-up, in lengths of the incision.
const CLOSE_UP: f64 = 1.5;
/// Depth below which all tissue has the same color, mm.
const DEEPEST_MM: f64 = 20.0;

/// Colors of the contours at rest and deformed.
const COLORS: [[u8; 3]; 2] = [[90, 160, 255], [255, 170, 60]];

/// Draws a run: the skin before and after, and a slice before and after. Before, the CT is cut but
/// has not moved. `after` is the deformed CT.
///
/// # Errors
/// The errors of the resampler and the renderer.
pub(super) fn draw(
    deformed: &DeformedBody<'_>,
    warp: &BodyWarp<'_>,
    after: &Volume,
    stages: &mut Stages,
    progress: &dyn Progress,
) -> Result<Vec<Figure>, Error> {
    let DeformedBody { body, ct, air_below_hu, .. } = *deformed;
    let before = warp.cut_at_rest(ct, stages, progress)?;
    let depth = depth(ct, air_below_hu)?;
    let depth_after = warp.apply(&depth, stages, progress)?.0;

    let wound = body.cut.slits.first().map(|slit| Wound::of(slit, &body.mesh.frame));
    let focus = wound.as_ref().map(|w| Focus { center_mm: w.middle_mm, size_mm: CLOSE_UP * w.length_mm });
    let [at_rest, now] = [&body.mesh.positions, deformed.positions].map(|p| body.whole_skin(p).0);
    let (_, triangles) = body.whole_skin(&[]);
    let rest = Contour {
        origin_mm: body.mesh.frame.origin_mm,
        positions: &at_rest,
        triangles: &triangles,
        color: COLORS[0],
    };
    let moved = Contour { positions: &now, color: COLORS[1], ..rest };
    let (plane, middle_mm) = match &wound {
        Some(wound) => (wound.plane_across(), wound.middle_mm),
        None => (Plane::Axial, body.mesh.frame.origin_mm.into()),
    };
    let cross = |volume: &Volume, contours: &[Contour<'_>]| {
        let view = SliceView {
            contours,
            focus,
            long_side: Some(PIXELS),
            ..SliceView::new(plane, position(plane, middle_mm))
        };
        Ok::<_, Error>(slice(volume, &view)?)
    };
    let before_slice = cross(&before, &[rest])?;
    let after_slice = cross(after, &[rest, moved])?;
    let slices = side_by_side(&[(&before_slice, "before"), (&after_slice, "after")])?;

    let mut skin = |volume: &Volume, depth: &Volume| {
        let view = View {
            width: PIXELS,
            height: PIXELS,
            focus,
            depth: Some(depth),
            threshold_hu: air_below_hu,
            ..View::new(wound.as_ref().map_or(Side::Anterior, |w| Side::From(w.outward)))
        };
        stages.raymarch(volume, &view)
    };
    Ok(vec![
        Figure { caption: "Before: cut, not yet moved", wide: false, png: skin(&before, &depth)?.to_png()? },
        Figure { caption: "After", wide: false, png: skin(after, &depth_after)?.to_png()? },
        Figure {
            caption: "Slice across the middle, with the skin of the model at rest (blue) and deformed (orange)",
            wide: true,
            png: slices.to_png()?,
        },
    ])
}

/// Depth below the skin at rest, mm, which colors the wound.
fn depth(ct: &Volume, air_below_hu: f32) -> Result<Volume, Error> {
    let finest = ct.grid().affine.spacing_mm().into_iter().fold(f64::INFINITY, f64::min);
    Ok(skin_depth(ct, air_below_hu, finest, DEEPEST_MM)?)
}

/// The place of a wound, for the choice of a view.
struct Wound {
    middle_mm: [f64; 3],
    length_mm: f64,
    along: Vector3<f64>,
    outward: [f64; 3],
}

impl Wound {
    fn of(slit: &Slit, frame: &cutis_mesh::Frame) -> Self {
        let middle: Point3<f64> = frame.origin_mm + slit.middle().coords * 1000.0;
        Self {
            middle_mm: middle.into(),
            length_mm: slit.length() * 1000.0,
            along: slit.along(),
            outward: (-slit.inward()).into(),
        }
    }

    /// The anatomical plane most nearly perpendicular to the slit.
    fn plane_across(&self) -> Plane {
        match self.along.iamax() {
            0 => Plane::Sagittal,
            1 => Plane::Coronal,
            _ => Plane::Axial,
        }
    }
}

/// Position of a point along the normal of a plane, mm.
fn position(plane: Plane, [x, y, z]: [f64; 3]) -> f64 {
    match plane {
        Plane::Sagittal => x,
        Plane::Coronal => y,
        Plane::Axial => z,
    }
}
