//! The bits of all fields do not depend on the number of threads.

use cutis_skin::{Directions, SkinField, SkinMoves, Strokes, depth_mm};
use nalgebra::{Matrix3, Vector3};

use crate::shapes::{Body, lattice};

#[test]
fn fields_do_not_depend_on_the_number_of_threads() {
    let lattice = lattice(61, Matrix3::new(1.0, 0.1, 0.0, 0.0, 1.3, 0.0, 0.2, 0.0, 1.0));
    let wave = |p: Vector3<f64>| (p.x / 7.0).sin() + (p.y / 5.0).cos() + (p.z / 9.0).sin();
    let body = Body::binary(lattice, |p| p.coords.norm() + 3.0 * wave(p.coords) - 24.0);
    let around = |n: usize| (n as f64 * 10f64.to_radians()).sin_cos();
    let ring: Vec<[f64; 3]> = (0..=36).map(around).map(|(s, c)| [24.0 * c, 24.0 * s, 2.0]).collect();
    let strokes = Strokes::from_points("ring", &[ring]).unwrap().with_reach_mm(15.0).unwrap();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let fields = [Directions::Around([0.0, 0.1, 1.0]), Directions::Strokes(strokes.clone())]
                .map(|directions| SkinField::new(&body.skin(), &directions).unwrap());
            let bits = fields.map(|field| {
                let vectors = field.normals.iter().chain(&field.directions).flat_map(|v| v.iter().copied());
                let numbers = vectors.chain(field.weights.iter().copied()).chain([field.coverage]);
                numbers.map(f64::to_bits).collect::<Vec<u64>>()
            });
            let depths: Vec<u32> =
                depth_mm(&body.skin(), 9.0).unwrap().into_iter().map(f32::to_bits).collect();
            let moves = SkinMoves::of(&body.skin()).mm;
            let moves: Vec<u64> = moves.iter().flatten().map(|c| c.to_bits()).collect();
            (bits, depths, moves)
        })
    };
    let one = run(1);
    // Enough for several portions of a sum.
    assert!(body.triangles.len() > 15_000, "{}", body.triangles.len());
    for threads in [2, 3, 8] {
        assert!(run(threads) == one, "{threads} threads");
    }
}
