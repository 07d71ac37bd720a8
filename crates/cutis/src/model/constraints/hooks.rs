//! Handles that grab tissue while the body moves: when they do, and where the tissue is then.

use cutis_solver::{Clock, Handle, Settings, System};
use nalgebra::{Point3, Vector3};

use crate::model::first_frame;
use crate::scene::HandleSection;

/// The handle of a section, which begins to move at `at_s`.
pub(super) fn handle(section: &HandleSection, grabbed: &[u32], at_s: f64) -> Handle {
    let move_m = (Vector3::from(section.displacement_mm()) / 1000.0).into();
    Handle { vertices: grabbed.to_vec(), move_m, at_s, over_s: section.over_s }
}

/// Places the vertices of all handles of a system where they are at a time in s.
pub(super) fn place(system: &System<f32>, time_s: f64, positions: &mut [Point3<f32>]) {
    for handle in system.handles() {
        let path = handle.path(time_s) + system.origin().coords;
        for (&vertex, start) in handle.vertices().iter().zip(handle.start()) {
            positions[vertex as usize] = start + path;
        }
    }
}

/// The handles of a scene that do not hold tissue from the start, in the order of the scene.
pub(crate) struct Hooks {
    hooks: Vec<Hook>,
}

/// One handle.
struct Hook {
    /// Number of the handle in the scene.
    number: usize,
    /// The first frame in which it holds tissue.
    frame: u64,
    handle: Handle,
    /// Positions at which it grabbed its vertices; none before.
    start: Option<Vec<Point3<f32>>>,
}

impl Hooks {
    /// The hooks among the handles of a scene; none if there are none. `grabbed` has the vertices
    /// of each handle.
    pub(super) fn new(sections: &[HandleSection], grabbed: &[Vec<u32>], settings: &Settings) -> Option<Self> {
        let hook = |(number, (section, grabbed)): (usize, (&HandleSection, &Vec<u32>))| {
            let frame = first_frame(section.at_s, settings.dt_s);
            let at_s = Clock { frame, substep: 0 }.time_s(settings);
            (frame > 0).then(|| Hook { number, frame, handle: handle(section, grabbed, at_s), start: None })
        };
        let hooks: Vec<Hook> = sections.iter().zip(grabbed).enumerate().filter_map(hook).collect();
        (!hooks.is_empty()).then_some(Self { hooks })
    }

    /// Whether a handle of the scene is a hook that holds nothing yet.
    pub(super) fn waits(&self, number: usize) -> bool {
        self.hooks.iter().any(|hook| hook.number == number && hook.start.is_none())
    }

    /// Vertices of the hooks that begin to hold tissue in a frame.
    pub(super) fn vertices(&self, frame: u64) -> Vec<u32> {
        let due = self.hooks.iter().filter(|hook| hook.start.is_none() && hook.frame <= frame);
        due.flat_map(|hook| &hook.handle.vertices).copied().collect()
    }

    /// Lets these hooks grab their vertices, which are at `positions`. Returns the handles.
    pub(super) fn grab(&mut self, frame: u64, mut positions: &[Point3<f32>]) -> Vec<Handle> {
        let mut handles = Vec::new();
        for hook in self.hooks.iter_mut().filter(|hook| hook.start.is_none() && hook.frame <= frame) {
            let (own, others) = positions.split_at(hook.handle.vertices.len());
            (hook.start, positions) = (Some(own.to_vec()), others);
            handles.push(hook.handle.clone());
        }
        handles
    }

    /// The handles of all hooks.
    pub(super) fn into_handles(self) -> Vec<Handle> {
        self.hooks.into_iter().map(|hook| hook.handle).collect()
    }

    /// Positions at which the hooks grabbed their vertices, for a checkpoint.
    pub(super) fn starts(&self) -> impl Iterator<Item = u32> + '_ {
        self.hooks.iter().flat_map(|hook| {
            let start = |n: usize| hook.start.as_ref().map_or(Point3::from([f32::NAN; 3]), |start| start[n]);
            (0..hook.handle.vertices.len()).flat_map(move |n| <[f32; 3]>::from(start(n)).map(f32::to_bits))
        })
    }

    /// Places the vertices that hooks hold where the hooks grabbed them, from the words of a
    /// checkpoint.
    pub(super) fn place(&self, starts: &[u32], positions: &mut [Point3<f32>]) {
        let vertices = self.hooks.iter().flat_map(|hook| &hook.handle.vertices);
        for (&vertex, start) in vertices.zip(starts.chunks_exact(3)) {
            let start = [start[0], start[1], start[2]].map(f32::from_bits);
            if start.iter().all(|value| value.is_finite()) {
                positions[vertex as usize] = start.into();
            }
        }
    }
}
