//! A bar of two layers in series. Both carry the same force `N`, so layer `i` is strained by
//! `N/(E_i·A)`, and the bar grows by the sum of what its layers grow.

use std::path::Path;

use cutis::Scene;
use cutis::volume::{Affine, Grid, Volume, nifti};
use cutis_newton::{Options, Problem};
use nalgebra::Point3;

/// Vertices across and along the bar, and the step between them. The coordinates have no rounding.
const ACROSS: usize = 3;
const ALONG: usize = 61;
const STEP_M: f64 = 1.0 / 256.0;
/// First layer of vertices of the second material. The materials meet half a step before it.
const SECOND: usize = 31;
/// Strain of the whole bar, small enough for springs to be linear.
const STRAIN: f64 = 1e-3;

/// The state of a bar that is pulled by its fixed ends.
struct Bar {
    /// Height of each layer of vertices, m.
    heights: Vec<f64>,
    /// Force on the upper end, N.
    force: f64,
}

impl Bar {
    /// The equilibrium of a bar whose two materials have these Young's moduli.
    fn pulled(moduli_pa: [f64; 2]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let hu = |voxel: usize| if voxel / (ACROSS * ACROSS) < SECOND { 10 } else { 20 };
        let grid = Grid {
            shape: [ACROSS, ACROSS, ALONG],
            affine: Affine::from_spacing([1e3 * STEP_M; 3], [0.0; 3]).unwrap(),
        };
        let voxels = (0..grid.len()).map(hu).collect();
        nifti::write(folder.path().join("bar.nii"), &Volume::new(grid, voxels, 1.0, 0.0).unwrap()).unwrap();
        let row = |hu: [i32; 2], modulus: f64| {
            format!(
                "{{ name = \"layer\", hu = {hu:?}, youngs_modulus_pa = {modulus:?}, bulk_modulus_pa = {:?} }}",
                10.0 * modulus
            )
        };
        let text = format!(
            "materials = [{}, {}]\n[volume]\npath = \"bar.nii\"\n[constraints]\ndistance = {{}}\n\
             volume = {{}}\n[fixed]\nend_layers = [\"k\"]",
            row([0, 15], moduli_pa[0]),
            row([15, 30], moduli_pa[1])
        );
        let loaded = Scene::parse(&text, Path::new("bar.toml"), folder.path(), &[]).unwrap();
        Self::equilibrium(&cutis::build_system(&loaded).unwrap().system)
    }

    fn equilibrium(system: &cutis::solver::System<f32>) -> Self {
        let problem = Problem::of(system, [0.0; 3]).unwrap();
        let stretched: Vec<Point3<f64>> =
            problem.positions().iter().map(|x| Point3::new(x.x, x.y, x.z * (1.0 + STRAIN))).collect();
        let options = Options::default();
        let rest = problem.equilibrium(&stretched, &options).unwrap().positions;
        let forces = problem.forces(&rest);
        let layer = |k: usize| k * ACROSS * ACROSS..(k + 1) * ACROSS * ACROSS;
        let mean = |k: usize| rest[layer(k)].iter().map(|x| x.z).sum::<f64>() / (ACROSS * ACROSS) as f64;
        Self {
            heights: (0..ALONG).map(mean).collect(),
            force: -forces[layer(ALONG - 1)].iter().map(|force| force.z).sum::<f64>(),
        }
    }

    /// Strain between two layers of vertices.
    fn strain(&self, from: usize, to: usize) -> f64 {
        (self.heights[to] - self.heights[from]) / ((to - from) as f64 * STEP_M) - 1.0
    }
}

/// Relative errors of a bar against the closed form: of the ratio of the strains, of the stress in
/// each layer, and of the extension.
fn errors(bar: &Bar, moduli_pa: [f64; 2]) -> [f64; 4] {
    // Away from the ends and from the other layer the stress is uniform.
    let strains = [bar.strain(8, SECOND - 9), bar.strain(SECOND + 8, ALONG - 9)];
    let stress = bar.force / (STEP_M * (ACROSS - 1) as f64).powi(2);
    let [first, second] = moduli_pa.map(|modulus| stress / modulus);
    let lengths = [SECOND as f64 - 0.5, (ALONG - 1 - SECOND) as f64 + 0.5].map(|steps| steps * STEP_M);
    let extension = first * lengths[0] + second * lengths[1];
    let found = STRAIN * STEP_M * (ALONG - 1) as f64;
    [
        strains[0] / strains[1] / (moduli_pa[1] / moduli_pa[0]) - 1.0,
        strains[0] / first - 1.0,
        strains[1] / second - 1.0,
        found / extension - 1.0,
    ]
    .map(f64::abs)
}

#[test]
fn two_layers_in_series_grow_by_the_sum_of_both() {
    for moduli in [[4e3, 4e3], [4e3, 1.6e4], [3e3, 3e5]] {
        let bar = Bar::pulled(moduli);
        let found = errors(&bar, moduli);
        let [ratio, first, second, extension] = found;
        assert!(ratio < 5e-3, "{moduli:?}: {found:?}");
        // The lattice has Young's modulus along its axes within 2 %.
        assert!(first < 0.02 && second < 0.02 && extension < 0.03, "{moduli:?}: {found:?}");
        // Controls: another modulus, and the layers exchanged.
        assert!(errors(&bar, [1.1 * moduli[0], moduli[1]]).iter().any(|error| *error > 0.05));
        let [a, b] = moduli;
        assert!(a == b || errors(&bar, [b, a])[0] > 0.5);
    }
}
