//! The place of the wounds of a body, for the choice of a view.

use cutis_mesh::{Frame, Slit};
use cutis_render::{Focus, Plane};
use nalgebra::{Point3, Vector3};

use crate::body::Body;

/// Size of a close-up, in lengths of the incision.
const CLOSE_UP: f64 = 1.5;

/// The wound that pictures show.
pub(super) struct WoundPlace {
    /// The middle of the wound on the skin, world mm.
    pub(super) middle_mm: [f64; 3],
    /// The place half as deep as the wound below that, world mm.
    pub(super) inside_mm: [f64; 3],
    /// Direction out of the body.
    pub(super) outward: [f64; 3],
    along: Vector3<f64>,
    /// A close-up of the wound for a slice.
    pub(super) slice: Focus,
    /// A close-up from outside.
    pub(super) close_up: Focus,
}

impl WoundPlace {
    /// The place of the first wound of a body: incisions come before excisions. Incisions next to
    /// an excision make a flap, which a close-up shows as a whole. None without a wound.
    pub(super) fn of(body: &Body) -> Option<Self> {
        let frame = &body.mesh.frame;
        let pieces = body.cut.pieces.iter().map(|piece| std::slice::from_ref(piece.axis()));
        let wounds: Vec<&[Slit]> = body.cut.incisions().chain(pieces).collect();
        let slits = wounds.first()?;
        let length: f64 = slits.iter().map(Slit::length).sum();
        let at = middle_segment(slits, length);
        let world = |local: Point3<f64>| <[f64; 3]>::from(frame.origin_mm + local.coords * 1000.0);
        let middle_mm = world(at.middle());
        let slice = Focus { center_mm: middle_mm, size_mm: CLOSE_UP * length * 1000.0 };
        let flap = wounds.len() > 1 && !body.cut.pieces.is_empty();
        Some(Self {
            middle_mm,
            inside_mm: world(at.middle() + at.inward() * (0.5 * at.depth())),
            outward: (-at.inward()).into(),
            along: at.along(),
            slice,
            close_up: if flap { around(&wounds, frame) } else { slice },
        })
    }

    /// The anatomical plane most nearly perpendicular to the wound.
    pub(super) fn plane_across(&self) -> Plane {
        match self.along.iamax() {
            0 => Plane::Sagittal,
            1 => Plane::Coronal,
            _ => Plane::Axial,
        }
    }
}

/// The segment that holds half of the path of an incision.
fn middle_segment(slits: &[Slit], length: f64) -> &Slit {
    let mut half = 0.5 * length;
    let mut at = &slits[0];
    for slit in slits {
        at = slit;
        if half <= slit.length() {
            break;
        }
        half -= slit.length();
    }
    at
}

/// A close-up of several wounds: the middle of the box around their ends, and its diagonal.
fn around(wounds: &[&[Slit]], frame: &Frame) -> Focus {
    let ends = wounds.iter().flat_map(|slits| *slits);
    let ends = ends.flat_map(|slit| [slit.skin_at(0.0), slit.skin_at(slit.length())]);
    let (mut low, mut high) = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
    for end in ends {
        (low, high) = (low.inf(&end), high.sup(&end));
    }
    let middle = frame.origin_mm + nalgebra::center(&low, &high).coords * 1000.0;
    Focus { center_mm: middle.into(), size_mm: CLOSE_UP * (high - low).norm() * 1000.0 }
}

/// Position of a point along the normal of a plane, mm.
pub(super) fn position(plane: Plane, [x, y, z]: [f64; 3]) -> f64 {
    match plane {
        Plane::Sagittal => x,
        Plane::Coronal => y,
        Plane::Axial => z,
    }
}
