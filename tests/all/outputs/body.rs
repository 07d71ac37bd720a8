//! A body with landmarks at known millimeters, cut twice and dragged by one handle. One run of it
//! serves many tests.
//!
//! All positions are RAS+ millimeters: +x is the patient's right, +y anterior, +z superior. No two
//! sides of the body are alike, so that a mirrored or displaced output cannot pass.
//!
//! | landmark | place |
//! |---|---|
//! | body, 40 HU | x −90 to 58, y −48 to 40, z −90 to 70 |
//! | notch, air | x above 30 and z above 54 |
//! | marker on the right, 150 HU | center (44, 6, 20), inside the handle |
//! | marker on the left, 150 HU | center (−24, 6, 20) |
//! | first incision | along z at x = 20, on the anterior side, center z = 20 |
//! | second incision | oblique, on the left half of the anterior side |
//! | handle | moves the right edge of the body by [`MOVE_MM`] |

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

use cutis::{RunOptions, Scene, Silent};
use serde_json::Value;

use super::nifti::Nifti;

/// Lowest and highest corner of the body.
pub const BODY_MM: [[f64; 3]; 2] = [[-90.0, -48.0, -90.0], [58.0, 40.0, 70.0]];
/// Start of the notch at the upper right edge: x and z.
pub const NOTCH_MM: [f64; 2] = [30.0, 54.0];
/// Centers of the markers, the patient's right one first.
pub const MARKERS_MM: [[f64; 3]; 2] = [[44.0, 6.0, 20.0], [-24.0, 6.0, 20.0]];
/// Half the size of a marker.
pub const MARKER_HALF_MM: f64 = 10.0;
/// HU of body and markers; the rest is air, −1000 HU.
pub const HU: [i16; 2] = [40, 150];
/// Movement of the handle: to the right, to anterior, to inferior.
pub const MOVE_MM: [f64; 3] = [10.0, 6.0, -4.0];
/// Center of the handle, and its radius.
pub const HANDLE_MM: ([f64; 3], f64) = ([46.0, 6.0, 20.0], 20.0);
/// Number of frames and duration of each.
pub const FRAMES: usize = 12;
pub const DT_S: f64 = 0.02;
/// Voxel size.
pub const VOXEL_MM: f64 = 4.0;
/// Lattice spacing of the scene. The lattice rounds it to a slightly smaller value.
pub const STEP_MM: f64 = 8.0;

const SCENE: &str = r#"
scan_is_at_rest = false
[constraints]
distance = { youngs_modulus_pa = 5.0e3 }
volume = { bulk_modulus_pa = 5.0e4 }
stc = { area_modulus_n_per_m = 100.0, rest_area_scale = 0.8 }
[fixed]
planes = [{ point_mm = [0.0, -30.0, 0.0], normal = [0.0, -1.0, 0.0] }]
[[incision]]
from_mm = [20.0, 40.0, -20.0]
to_mm = [20.0, 40.0, 60.0]
depth_mm = 15.0
width_mm = 8.0
[[incision]]
from_mm = [-70.0, 40.0, -60.0]
to_mm = [-45.0, 40.0, 30.0]
depth_mm = 15.0
width_mm = 8.0
[[handle]]
at_mm = [46.0, 6.0, 20.0]
radius_mm = 20.0
move_mm = [10.0, 6.0, -4.0]
over_s = 0.1
[volume]
path = "ct.nii.gz"
[lattice]
spacing_mm = 8.0
[solver]
backend = "cpu"
formulation = "xpbd"
dt_s = 0.02
substeps = 5
[run]
frames = 12
[output]
volume = true
surface = true
tissue = true
pictures = true
report = true
"#;

/// HU of the body at a place.
pub fn hu_at(place: [f64; 3]) -> i16 {
    let [low, high] = BODY_MM;
    let inside = (0..3).all(|axis| place[axis] > low[axis] && place[axis] < high[axis]);
    if !inside || (place[0] > NOTCH_MM[0] && place[2] > NOTCH_MM[1]) {
        return -1000;
    }
    let in_marker =
        |center: &[f64; 3]| (0..3).all(|axis| (place[axis] - center[axis]).abs() < MARKER_HALF_MM);
    HU[usize::from(MARKERS_MM.iter().any(in_marker))]
}

/// The CT of the body. The file stores left and posterior first, as scanners do.
pub fn ct() -> Nifti {
    let mut ct = Nifti {
        shape: [48, 32, 50],
        rows: [[-VOXEL_MM, 0.0, 0.0, 88.0], [0.0, -VOXEL_MM, 0.0, 58.0], [0.0, 0.0, VOXEL_MM, -108.0]],
        voxels: Vec::new(),
        scaling: [1.0, 0.0],
        codes: [0, 1],
    };
    ct.voxels = (0..48 * 32 * 50).map(|voxel| hu_at(ct.at(voxel))).collect();
    ct
}

/// The results of a finished run.
pub struct Finished {
    /// `report.json`, if the scene asks for it.
    pub report: Value,
    /// Contents of the files by name.
    pub files: BTreeMap<String, Vec<u8>>,
}

impl Finished {
    /// A text file.
    pub fn text(&self, name: &str) -> &str {
        std::str::from_utf8(&self.files[name]).unwrap()
    }

    /// A number of the report, such as `/wound/final_mm`.
    pub fn number(&self, pointer: &str) -> f64 {
        let found = self.report.pointer(pointer).and_then(Value::as_f64);
        found.unwrap_or_else(|| panic!("no number {pointer} in {:#}", self.report))
    }
}

/// Runs the body with overrides of its scene.
pub fn run(set: &[(&str, &str)]) -> Finished {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ct.nii.gz"), ct().to_bytes()).unwrap();
    let overrides = crate::scenes::overrides(set);
    let loaded = Scene::parse(SCENE, Path::new("body.toml"), folder.path(), &overrides).unwrap();
    let out = folder.path().join("run");
    cutis::run(&loaded, &RunOptions { out: out.clone(), resume: false }, &Silent).unwrap();
    let read = |entry: std::io::Result<std::fs::DirEntry>| {
        let path = entry.unwrap().path();
        (path.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(&path).unwrap())
    };
    let files: BTreeMap<_, _> = std::fs::read_dir(out).unwrap().map(read).collect();
    let report = files.get("report.json").map_or(Value::Null, |json| serde_json::from_slice(json).unwrap());
    Finished { report, files }
}

/// The body after its run with all outputs. Tests share it.
pub fn finished() -> &'static Finished {
    static FINISHED: LazyLock<Finished> = LazyLock::new(|| run(&[]));
    &FINISHED
}
