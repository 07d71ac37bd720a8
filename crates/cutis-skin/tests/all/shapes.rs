//! Bodies with a known skin, sampled on lattices.

use cutis_mesh::{Lattice, SkinMode, SkinOptions, Split, Tissue, TissueMask, skin};
use cutis_skin::BodySkin;
use cutis_volume::{Affine, Grid, Volume, sample};
use nalgebra::{Matrix3, Point3, Vector3};

/// HU of tissue and of air.
pub const HU: [f64; 2] = [40.0, -1000.0];

/// A body on a lattice with its skin.
pub struct Body {
    pub lattice: Lattice,
    pub hu: Vec<f32>,
    pub vertices: Vec<bool>,
    pub triangles: Vec<[u32; 3]>,
}

impl Body {
    /// The body of all lattice points with at least −449 HU.
    pub fn new(lattice: Lattice, hu: Vec<f32>, mode: SkinMode) -> Self {
        let air: Vec<bool> = hu.iter().map(|&hu| hu < -449.0).collect();
        let tissue = Tissue { air: &air, cut_away: &[], largest_component: true };
        let body = TissueMask::find(&lattice, &tissue).unwrap();
        let found = skin::detect(&lattice, &air, mode, &SkinOptions::default()).unwrap();
        let (triangles, _) = body.skin(&found);
        let vertices = body.vertices().to_vec();
        Self { lattice, hu, vertices, triangles }
    }

    /// A body whose lattice points are tissue where `distance` (mm, negative inside) is not
    /// positive.
    pub fn binary(lattice: Lattice, distance: impl Fn(Point3<f64>) -> f64) -> Self {
        let grid = *lattice.grid();
        let hu_at = |point| if distance(lattice.mm(grid.point(point))) <= 0.0 { HU[0] } else { HU[1] };
        let hu = (0..grid.len()).map(|point| hu_at(point) as f32).collect();
        Self::new(lattice, hu, SkinMode::Boundary)
    }

    /// A body from a CT with `fine` voxels per lattice step, sampled as Cutis samples a CT.
    pub fn from_ct(lattice: Lattice, fine: usize, distance: impl Fn(Point3<f64>) -> f64) -> Self {
        let volume = volume(&even_grid(&lattice), fine, distance);
        let hu = lattice.sample(&volume).unwrap();
        Self::new(lattice, hu, SkinMode::Boundary)
    }

    pub fn skin(&self) -> BodySkin<'_> {
        BodySkin::new(&self.lattice, &self.hu, &self.vertices, &self.triangles).unwrap()
    }

    /// World positions of the corners of a triangle.
    pub fn corners(&self, triangle: &[u32; 3]) -> [Point3<f64>; 3] {
        triangle.map(|point| self.lattice.mm(self.lattice.grid().point(point as usize)))
    }

    /// The middle of a triangle.
    pub fn center(&self, triangle: &[u32; 3]) -> Point3<f64> {
        let [a, b, c] = self.corners(triangle);
        Point3::from((a.coords + b.coords + c.coords) / 3.0)
    }

    /// The unit normal of the facet.
    pub fn facet_normal(&self, triangle: &[u32; 3]) -> Vector3<f64> {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(&(c - a)).normalize()
    }

    /// Number of lattice planes between a triangle and the border of the lattice: across the first
    /// two axes, and across the third.
    pub fn border_distance(&self, triangle: &[u32; 3]) -> [usize; 2] {
        let grid = self.lattice.grid();
        let points = triangle.map(|p| grid.point(p as usize));
        let inset = |axis: usize| {
            points.iter().map(|p| p[axis].min(grid.shape[axis] - 1 - p[axis])).fold(usize::MAX, usize::min)
        };
        [inset(0).min(inset(1)), inset(2)]
    }
}

/// The grid of the even lattice over the extent of a lattice.
fn even_grid(lattice: &Lattice) -> Grid {
    let last = |axis: &Vec<f64>| axis[axis.len() - 1] as usize + 1;
    let shape = lattice.planes().map_or(lattice.grid().shape, |planes| planes.axes().each_ref().map(last));
    Grid { shape, affine: lattice.grid().affine }
}

/// A CT with `fine` voxels per step of a grid. Its voxels have partial volume.
fn volume(grid: &Grid, fine: usize, distance: impl Fn(Point3<f64>) -> f64) -> Volume {
    let shape = grid.shape.map(|n| (n - 1) * fine + 1);
    let mut rows = grid.affine.rows();
    for row in &mut rows[..3] {
        row[..3].iter_mut().for_each(|value| *value /= fine as f64);
    }
    let voxels = Grid { shape, affine: Affine::from_rows(rows).unwrap() };
    let half = voxels.affine.spacing_mm().into_iter().fold(f64::INFINITY, f64::min) / 2.0;
    let hu_at = |point: usize| {
        let share = (0.5 - distance(voxels.mm(voxels.point(point))) / (2.0 * half)).clamp(0.0, 1.0);
        (HU[1] + (HU[0] - HU[1]) * share).round() as i16
    };
    let values = (0..voxels.len()).map(hu_at).collect();
    assert_eq!(
        sample::lattice_grid(&voxels, sample::LatticeSize::Vertices(grid.shape)).unwrap().shape,
        grid.shape
    );
    Volume::new(voxels, values, 1.0, 0.0).unwrap()
}

/// A lattice of `n³` points around the origin whose index steps are the columns of a matrix.
pub fn lattice(n: usize, steps_mm: Matrix3<f64>) -> Lattice {
    let grid = grid(n, steps_mm);
    Lattice::new(grid, Split::Kuhn6).unwrap()
}

/// The grid of [`lattice`].
pub fn grid(n: usize, steps_mm: Matrix3<f64>) -> Grid {
    let origin = -(steps_mm * Vector3::repeat((n - 1) as f64 / 2.0));
    let row = |r: usize| [steps_mm[(r, 0)], steps_mm[(r, 1)], steps_mm[(r, 2)], origin[r]];
    let rows = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
    Grid { shape: [n; 3], affine: Affine::from_rows(rows).unwrap() }
}
