//! Invalid input is refused, and the error names it.

use cutis_resample::{ResampleError, Warp, resample};
use cutis_volume::Grid;
use nalgebra::Point3;

use crate::bodies::{lattice, noise, oblique};

#[test]
fn invalid_warps_are_refused() {
    let grid = Grid { shape: [8, 8, 8], affine: oblique() };
    let volume = noise(grid, 1);
    let mesh = lattice(&grid, [2, 2, 2], [0.0; 3], [7.0; 3]);
    let good = Warp {
        origin_mm: mesh.origin_mm,
        rest: &mesh.rest,
        deformed: &mesh.rest,
        tets: &mesh.tets,
        body_tets: mesh.tets.len(),
        removed: &[],
    };
    let error = |warp: &Warp<'_>| resample(&volume, warp, &|_, _| {}).err();
    assert!(error(&good).is_none(), "control");

    let mut broken = mesh.rest.clone();
    broken[5].y = f32::NAN;
    let found = error(&Warp { deformed: &broken, ..good }).unwrap();
    assert!(matches!(found, ResampleError::NotFinite { which: "deformed", vertex: 5, .. }));
    assert!(found.to_string().contains("vertex 5"), "{found}");
    broken[5].y = f32::INFINITY;
    let found = error(&Warp { rest: &broken, ..good }).unwrap();
    assert!(matches!(found, ResampleError::NotFinite { which: "rest", vertex: 5, .. }));
    let found = error(&Warp { origin_mm: Point3::new(0.0, f64::NAN, 0.0), ..good }).unwrap();
    assert!(matches!(found, ResampleError::NotFinite { which: "origin", .. }));

    let found = error(&Warp { removed: &[[0, 1, 2, 3], [0, 1, 2, 27]], ..good }).unwrap();
    assert!(matches!(found, ResampleError::VertexOutOfRange { which: "removed", tet: 1, vertices: 27, .. }));
    let found = error(&Warp { tets: &[[0, 1, 2, u32::MAX]], body_tets: 1, ..good }).unwrap();
    assert!(matches!(found, ResampleError::VertexOutOfRange { which: "tets", tet: 0, .. }));
    let found = error(&Warp { body_tets: 1000, ..good }).unwrap();
    assert!(matches!(found, ResampleError::BodyTets { body_tets: 1000, tets: 48 }));
    let found = error(&Warp { deformed: &mesh.rest[1..], ..good }).unwrap();
    assert!(matches!(found, ResampleError::VertexCount { rest: 27, deformed: 26 }));
}

#[test]
fn huge_but_finite_positions_are_accepted() {
    let grid = Grid { shape: [8, 8, 8], affine: oblique() };
    let volume = noise(grid, 1);
    let mesh = lattice(&grid, [2, 2, 2], [0.0; 3], [7.0; 3]);
    let mut far = mesh.rest.clone();
    far[13] = Point3::new(f32::MAX, f32::MIN, f32::MAX);
    far[0] = Point3::new(1e30, 1e-30, -1e30);
    let warp = Warp {
        origin_mm: mesh.origin_mm,
        rest: &mesh.rest,
        deformed: &far,
        tets: &mesh.tets,
        body_tets: mesh.tets.len(),
        removed: &[],
    };
    assert!(resample(&volume, &warp, &|_, _| {}).is_ok());
}
