//! The pictures of a run: the skin before and after, and a slice across the wound.

use cutis_mesh::Slit;
use cutis_render::{Contour, Focus, Plane, Side, SliceView, View, side_by_side, skin_depth, slice};
use cutis_volume::Volume;
use nalgebra::{Point3, Vector3};

use crate::Error;
use crate::backend::Stages;
use crate::output::Outcome;
use crate::output::html::Figure;
use crate::scene::Scene;

/// Pixels along each side of the skin pictures.
const PIXELS: usize = 900;
/// A close-up shows this many lengths of the incision.
const CLOSE_UP: f64 = 1.5;
/// Deeper than this, tissue has the same color, mm.
const DEEPEST_MM: f64 = 20.0;

/// Contours: at rest, deformed.
const COLORS: [[u8; 3]; 2] = [[90, 160, 255], [255, 170, 60]];

/// Depth below the skin at rest, by which wounds are colored.
pub(crate) fn depth(volume: &Volume, scene: &Scene) -> Result<Volume, Error> {
    let finest = volume.grid().affine.spacing_mm().into_iter().fold(f64::INFINITY, f64::min);
    Ok(skin_depth(volume, scene.tissue.air_below_hu, finest, DEEPEST_MM)?)
}

/// Draws a run: its CT (with the depth volume) cut but not yet deformed, and deformed.
pub(crate) fn draw(
    outcome: &Outcome<'_>,
    stages: &mut Stages,
    before: (&Volume, &Volume),
    after: (&Volume, &Volume),
) -> Result<Vec<Figure>, Error> {
    let body = outcome.body;
    let wound = body.cut.slits.first().map(|slit| Wound::of(slit, &body.mesh.frame));
    let mut skin = |(volume, depth): (&Volume, &Volume)| {
        let view = View {
            width: PIXELS,
            height: PIXELS,
            focus: wound.as_ref().map(|w| Focus { center_mm: w.middle_mm, size_mm: CLOSE_UP * w.length_mm }),
            depth: Some(depth),
            threshold_hu: outcome.loaded.scene.tissue.air_below_hu,
            ..View::new(wound.as_ref().map_or(Side::Anterior, |w| Side::From(w.outward)))
        };
        stages.raymarch(volume, &view)
    };
    let (at_rest, triangles) = body.whole_skin(&body.mesh.positions);
    let (deformed, _) = body.whole_skin(outcome.deformed);
    let rest = Contour {
        origin_mm: body.mesh.frame.origin_mm,
        positions: &at_rest,
        triangles: &triangles,
        color: COLORS[0],
    };
    let deformed = Contour { positions: &deformed, color: COLORS[1], ..rest };
    let (plane, middle_mm) = match &wound {
        Some(wound) => (wound.plane_across(), wound.middle_mm),
        None => (Plane::Axial, body.mesh.frame.origin_mm.into()),
    };
    let cross = |volume: &Volume, contours: &[Contour<'_>]| {
        let view = SliceView {
            contours,
            focus: wound.as_ref().map(|w| Focus { center_mm: w.middle_mm, size_mm: CLOSE_UP * w.length_mm }),
            long_side: Some(PIXELS),
            ..SliceView::new(plane, position(plane, middle_mm))
        };
        Ok::<_, Error>(slice(volume, &view)?)
    };
    let before_slice = cross(before.0, &[rest])?;
    let after_slice = cross(after.0, &[rest, deformed])?;
    let slices = side_by_side(&[(&before_slice, "before"), (&after_slice, "after")])?;
    Ok(vec![
        Figure { caption: "Before: cut, not yet moved", wide: false, png: skin(before)?.to_png()? },
        Figure { caption: "After", wide: false, png: skin(after)?.to_png()? },
        Figure {
            caption: "Slice across the middle, with the skin of the model at rest (blue) and deformed (orange)",
            wide: true,
            png: slices.to_png()?,
        },
    ])
}

/// Where to look.
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

    /// The patient plane that cuts the slit most squarely.
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
