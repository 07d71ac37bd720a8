//! End-to-end tests of scenes with `model = "chainmail"`.

mod backends;
mod cuts;
mod drags;
mod materials;
mod model;
mod no_width;
mod random;
mod refused;
mod resume;
mod torn;

use std::path::Path;
use std::sync::LazyLock;

use cutis::report::ChainmailReport;
use cutis::scene::{DistanceSection, ModelChoice};
use cutis::volume::nifti;
use cutis::{LoadedScene, SceneSystem};
use nalgebra::{Point3, Vector3};

use crate::identity::original;
use crate::scenes::{self, Run, SMALL};

/// Lattice steps, mm.
const STEPS_MM: [f64; 3] = [63.0 * 6.25 / 33.0, 63.0 * 6.25 / 33.0, 47.0 * 6.25 / 24.0];
/// Lattice points per axis.
const POINTS: [usize; 3] = [34, 34, 25];
/// Accuracy of a position, mm. Coordinates are rounded to 2⁻¹⁶ steps and to single precision.
const EXACT_MM: f64 = 2e-4;

/// A handle that pulls the belly up for half a second.
const HANDLE: (&str, &str) =
    ("handle", "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 20, 5], over_s = 0.5 }]");
/// An incision along the belly, and a handle that pulls its left lip away.
const INCISION: (&str, &str) =
    ("incision", "[{ from_mm = [0, 110, -50], to_mm = [0, 110, 50], depth_mm = 40, width_mm = 9 }]");
const ASIDE: (&str, &str) =
    ("handle", "[{ at_mm = [-18, 97, 0], radius_mm = 22, move_mm = [-12, 0, 0], over_s = 0.5 }]");
/// Fat, firmer tissue and rigid bone. The expected values need these materials; the preset may
/// change.
const TISSUE: &str = "[{ from_hu = -1024, shortest = 0.5, longest = 1.6, shear = 0.6, k_steps = 0.02 }, \
                      { from_hu = -30, shortest = 0.7, longest = 1.3, shear = 0.4, k_steps = 0.02 }, \
                      { from_hu = 250, shortest = 1, longest = 1, shear = 0 }]";
const UNIFORM: (&str, &str) = (
    "chainmail.materials",
    "[{ from_hu = -1024, shortest = 0.7, longest = 1.3, shear = 0.4, k_steps = 0.02 }]",
);
const UNRELAXED: (&str, &str) = ("chainmail.relax_per_frame", "0");

/// The CT of the small phantom as a file, made once. Reading it takes a tenth of the time of making
/// it.
static CT_FILE: LazyLock<String> = LazyLock::new(|| {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("small-phantom.nii");
    nifti::write(&path, &original()).unwrap();
    format!("{{ path = {path:?} }}")
});

/// The small phantom as a chain on a coarse lattice, without incision or handle, for six frames of
/// an eighth of a second.
fn chain(set: &[(&str, &str)]) -> LoadedScene {
    bare(&[&[("chainmail.materials", TISSUE)], set].concat())
}

/// The same scene without a `chainmail` section.
fn bare(set: &[(&str, &str)]) -> LoadedScene {
    let common = [
        ("model", "chainmail"),
        ("volume", CT_FILE.as_str()),
        ("constraints", "{}"),
        ("incision", "[]"),
        ("lattice.spacing_mm", "12"),
        ("solver", "{ dt_s = 0.125, backend = \"cpu\" }"),
        ("run", "{ frames = 6, checkpoint_every = 6 }"),
        ("output", "{}"),
    ];
    scenes::scene(SMALL, &[&common, set].concat())
}

/// A scene with this number of frames.
fn first(frames: u32, loaded: &LoadedScene) -> LoadedScene {
    let mut less = loaded.clone();
    less.scene.run.frames = frames;
    less.scene.run.checkpoint_every = frames;
    less
}

/// The system of the same scene with the other model. It has the same vertices and handles, and the
/// chain's links among its edges.
struct Twin {
    rest: Vec<Point3<f32>>,
    /// Edges along the axes: both ends, the lower one first, and the axis.
    links: Vec<([usize; 2], usize)>,
    /// The vertices of each handle.
    held: Vec<Vec<usize>>,
    /// Vertices that are fixed or removed and in no handle.
    still: Vec<bool>,
}

impl Twin {
    fn of(loaded: &LoadedScene) -> Self {
        let mut other = loaded.clone();
        other.scene.model = ModelChoice::Pbd;
        other.scene.constraints.distance =
            Some(DistanceSection { youngs_modulus_pa: Some(1e4), stiffness: 1.0 });
        let SceneSystem { system, .. } = cutis::build_system(&other).unwrap();
        let rest = system.positions();
        let along = |edge: &[u32]| {
            let [a, b] = [edge[0] as usize, edge[1] as usize];
            let differ: Vec<usize> = (0..3).filter(|&axis| rest[a][axis] != rest[b][axis]).collect();
            let [axis] = differ[..] else { return None };
            Some((if rest[a][axis] < rest[b][axis] { [a, b] } else { [b, a] }, axis))
        };
        let links = system.kinds()[0].indices().chunks_exact(2).filter_map(along).collect();
        let vertices = |n: &u32| *n as usize;
        let held: Vec<Vec<usize>> =
            system.handles().iter().map(|handle| handle.vertices().iter().map(vertices).collect()).collect();
        let mut still: Vec<bool> = system.vertices().iter().map(|v| v.inverse_mass() == 0.0).collect();
        held.iter().flatten().for_each(|&v| still[v] = false);
        Self { rest, links, held, still }
    }
}

/// A finished run with a checkpoint.
struct Ended {
    run: Run,
    twin: Twin,
    /// Displacement of each vertex, mm.
    by: Vec<Vector3<f64>>,
}

impl Ended {
    fn of(loaded: &LoadedScene) -> Self {
        let (run, twin) = (Run::of(loaded), Twin::of(loaded));
        let places = run.positions();
        assert_eq!(places.len(), twin.rest.len());
        let moved = |(now, rest): (&Point3<f32>, &Point3<f32>)| (now.cast() - rest.cast::<f64>()) * 1000.0;
        let by = places.iter().zip(&twin.rest).map(moved).collect();
        Self { run, twin, by }
    }

    fn chainmail(&self) -> &ChainmailReport {
        self.run.report.chainmail.as_ref().unwrap()
    }

    /// Vertices that have moved.
    fn moved(&self) -> usize {
        self.by.iter().filter(|by| **by != Vector3::zeros()).count()
    }

    /// For each link its axis, and the change of the vector between its ends, mm.
    fn strains(&self) -> impl Iterator<Item = (usize, Vector3<f64>)> {
        self.twin.links.iter().map(|&([a, b], axis)| (axis, self.by[b] - self.by[a]))
    }

    /// Largest excess of each link over its limits in any coordinate, mm.
    fn excesses(&self, shortest: f64, longest: f64, shear: f64) -> impl Iterator<Item = f64> {
        self.strains().map(move |(axis, strain)| {
            let of = |coordinate: usize| {
                let (low, high) =
                    if coordinate == axis { (shortest - 1.0, longest - 1.0) } else { (-shear, shear) };
                // Shear is relative to the rest length of the link.
                let step = STEPS_MM[axis];
                (low * step - strain[coordinate]).max(strain[coordinate] - high * step)
            };
            (0..3).map(of).fold(f64::NEG_INFINITY, f64::max)
        })
    }
}
