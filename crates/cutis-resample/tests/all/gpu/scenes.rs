//! Small bodies in small volumes, each with a special difficulty.

use cutis_resample::Warp;
use cutis_test_kit::Random;
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

use crate::bodies::{Mesh, lattice, noise, oblique};

/// A volume, a mesh with a shell and removed tets, and deformed positions.
pub struct Scene {
    pub name: &'static str,
    pub volume: Volume,
    pub mesh: Mesh,
    pub deformed: Vec<Point3<f32>>,
    pub body_tets: usize,
    pub removed: Vec<[u32; 4]>,
}

impl Scene {
    pub fn new(name: &'static str, volume: Volume, mesh: Mesh) -> Self {
        let (deformed, body_tets) = (mesh.rest.clone(), mesh.tets.len());
        Self { name, volume, mesh, deformed, body_tets, removed: Vec::new() }
    }

    /// Moves each vertex by a map of local meters.
    pub fn moved(mut self, map: impl Fn(Point3<f64>) -> Point3<f64>) -> Self {
        self.deformed = self.mesh.rest.iter().map(|p| map(p.map(f64::from)).map(|c| c as f32)).collect();
        self
    }

    pub fn warp(&self) -> Warp<'_> {
        Warp {
            origin_mm: self.mesh.origin_mm,
            rest: &self.mesh.rest,
            deformed: &self.deformed,
            tets: &self.mesh.tets,
            body_tets: self.body_tets,
            removed: &self.removed,
        }
    }
}

fn wave(p: Point3<f64>) -> Point3<f64> {
    p + Vector3::new(0.002, 0.001, 0.003) * (200.0 * p.y).sin()
}

/// A mesh that leaves the volume on two sides. Some tets are a shell, some are removed.
pub fn wave_with_shell_and_removed() -> Scene {
    let grid = Grid { shape: [23, 19, 17], affine: oblique() };
    let mesh = lattice(&grid, [6, 5, 4], [-2.0, 2.0, 3.0], [18.0, 21.0, 14.0]);
    let mut scene = Scene::new("wave", noise(grid, 8), mesh).moved(wave);
    scene.removed = scene.mesh.tets.drain(100..130).collect();
    scene.body_tets = scene.mesh.tets.len() - 200;
    scene
}

/// Tets that are too large for a single thread, and more than their list has room for. Half of them
/// are folded back over the others.
pub fn large_folded() -> Scene {
    let affine = Affine::from_spacing([1.0; 3], [0.0; 3]).expect("invertible");
    let grid = Grid { shape: [41, 23, 21], affine };
    let mesh = lattice(&grid, [2, 1, 2], [0.5; 3], [40.5, 22.5, 20.5]);
    let fold =
        |p: Point3<f64>| Point3::new(if p.x > 0.021 { -0.0002 } else { p.x }, p.y + 0.0013, p.z - 0.1 * p.y);
    Scene::new("large and folded", noise(grid, 6), mesh).moved(fold)
}

/// Fine tets, half of which do not move.
pub fn half_at_rest() -> Scene {
    let affine = Affine::from_spacing([0.9765625, 0.1 + 0.2, 1.0 / 3.0], [-170.3, 55.1, 1e3 / 7.0])
        .expect("invertible");
    let grid = Grid { shape: [25, 22, 19], affine };
    let mesh = lattice(&grid, [11, 9, 8], [0.0; 3], [24.0, 21.0, 18.0]);
    Scene::new("half at rest", noise(grid, 3), mesh).moved(|p| {
        let lift = (p.x - 0.012).max(0.0);
        Point3::new(p.x + 0.3 * lift, p.y, p.z + 0.2 * lift)
    })
}

/// Padding next to tissue, a negative slope, and a shift that is not a whole number of voxels.
pub fn padded() -> Scene {
    let grid = Grid { shape: [20, 18, 16], affine: oblique() };
    let noise = noise(grid, 5);
    let outside = |index: usize| grid.point(index).iter().sum::<usize>() < 14;
    let voxels =
        noise.voxels().iter().enumerate().map(|(n, &v)| if outside(n) { 3024 } else { -v }).collect();
    let volume = Volume::new(grid, voxels, -1.0, 0.0).expect("valid");
    let mesh = lattice(&grid, [4, 4, 4], [0.0; 3], [19.0, 17.0, 15.0]);
    Scene::new("padded", volume, mesh).moved(|p| p + Vector3::new(0.00031, -0.00017, 0.00042))
}

/// Randomly moved vertices, so that tets are inverted, folded and flat.
///
/// With this seed no center is so near a face that the CPU finds another owner in `f64`.
pub fn random() -> Scene {
    let grid = Grid { shape: [21, 22, 23], affine: oblique() };
    let mesh = lattice(&grid, [5; 3], [1.0; 3], [19.0; 3]);
    let mut random = Random::new(3);
    let mut scene = Scene::new("random", noise(grid, 4), mesh);
    for p in &mut scene.deformed {
        *p += random.vector().cast::<f32>() * 0.009;
    }
    scene.deformed[120] = scene.deformed[121];
    scene
}

/// Some vertices are far away, and some exceed the range in which `f32` can compute.
pub fn far() -> Scene {
    let grid = Grid { shape: [19, 18, 17], affine: oblique() };
    let mesh = lattice(&grid, [4; 3], [1.0; 3], [16.0; 3]);
    let mut scene = Scene::new("far", noise(grid, 9), mesh).moved(|p| p + Vector3::new(0.0004, 0.0, 0.0));
    scene.deformed[3] = Point3::new(1.5, -0.7, 2.0);
    scene.deformed[62] = Point3::new(1e9, -1e9, 3e8);
    scene.deformed[120] = Point3::new(f32::MAX, f32::MIN, f32::MAX);
    scene
}

/// Every vertex is on a voxel's center at rest, and about one rounding away from a center when
/// deformed.
pub fn almost_whole_voxels() -> Scene {
    let grid = Grid { shape: [23, 19, 17], affine: oblique() };
    let [x, y, z] = [0, 1, 2].map(|axis| grid.affine.step_mm(axis) / 1000.0);
    let mesh = lattice(&grid, [11, 9, 8], [0.0; 3], [22.0, 18.0, 16.0]);
    Scene::new("almost whole voxels", noise(grid, 2), mesh)
        .moved(|p| p + x * 3.000048 + y * 2.000032 + z * 1.000016)
}

/// A body that moves to slices that it did not touch at rest, in another slab.
pub fn moved_away() -> Scene {
    let affine = Affine::from_spacing([1.0, 0.8, 1.2], [0.0, -3.0, 9.0]).expect("invertible");
    let grid = Grid { shape: [13, 12, 21], affine };
    let mesh = lattice(&grid, [3; 3], [1.0, 2.0, 1.0], [11.0, 10.0, 5.5]);
    Scene::new("moved away", noise(grid, 11), mesh).moved(|p| Point3::new(p.x, p.y + 0.0003, p.z + 0.0171))
}

/// Scenes for the CPU. [`far`] is not one of them, because the CPU's tolerance grows with the
/// farthest vertex.
pub fn near() -> Vec<Scene> {
    vec![
        wave_with_shell_and_removed(),
        large_folded(),
        half_at_rest(),
        padded(),
        random(),
        almost_whole_voxels(),
        moved_away(),
    ]
}

/// All scenes.
pub fn all() -> Vec<Scene> {
    let mut scenes = near();
    scenes.push(far());
    scenes
}
