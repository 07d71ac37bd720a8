//! Displacement fields and label maps compared with closed forms and with resampling.

use cutis_resample::{Coverage, Displacement, ResampleError, Slab, Warp, resample, resample_labels};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

use crate::bodies::{Mesh, lattice, noise, oblique};

const AIR: i16 = -1024;

fn warp<'a>(mesh: &'a Mesh, deformed: &'a [Point3<f32>]) -> Warp<'a> {
    Warp {
        origin_mm: mesh.origin_mm,
        rest: &mesh.rest,
        deformed,
        tets: &mesh.tets,
        body_tets: mesh.tets.len(),
        removed: &[],
    }
}

/// All slabs of a field behind each other.
fn whole(field: &Displacement<'_>) -> Slab {
    let mut all = Slab::default();
    field
        .for_each(&|_, _| {}, |slab| {
            assert_eq!(slab.first, all.vectors_mm.len());
            all.vectors_mm.extend(&slab.vectors_mm);
            all.coverage.extend(&slab.coverage);
            Ok::<(), ResampleError>(())
        })
        .unwrap();
    all
}

fn grid(shape: [usize; 3]) -> Grid {
    Grid { shape, affine: oblique() }
}

fn in_body(grid: &Grid) -> Mesh {
    lattice(grid, [5, 4, 3], [2.3, 2.7, 1.2], grid.shape.map(|n| n as f64 - 3.4))
}

/// Some smooth motion of up to 4 mm that folds nothing.
fn bent(mesh: &Mesh) -> Vec<Point3<f32>> {
    let bend = |p: &Point3<f32>| {
        let p = p.map(f64::from);
        let by = Vector3::new((90.0 * p.y).sin(), (70.0 * p.z).cos(), (80.0 * p.x).sin()) * 0.004;
        (p + by).map(|c| c as f32)
    };
    mesh.rest.iter().map(bend).collect()
}

#[test]
fn a_body_at_rest_has_no_displacement_and_keeps_its_labels() {
    let grid = grid([23, 19, 17]);
    let mesh = in_body(&grid);
    let warp = warp(&mesh, &mesh.rest);
    for field in [Displacement::to_rest(&grid, &warp), Displacement::from_rest(&grid, &warp)] {
        let all = whole(&field.unwrap());
        assert!(all.vectors_mm.iter().all(|vector| *vector == [0.0; 3]));
        let count = |coverage| all.coverage.iter().filter(|of| **of == coverage).count();
        assert!(count(Coverage::Inside) > 1000 && count(Coverage::Outside) > 1000);
        assert_eq!(count(Coverage::Vacated), 0);
    }
    let labels: Vec<u64> = (0..grid.len() as u64).map(|n| n << 40).collect();
    let (same, report) = resample_labels(&grid, &labels, 0, &warp, &|_, _| {}).unwrap();
    assert_eq!((same, report.moved_voxels, report.vacated_voxels), (labels, 0, 0));
}

#[test]
fn a_body_that_moves_by_whole_voxels_carries_its_labels() {
    let grid = grid([23, 19, 17]);
    let steps = [3_usize, 2, 1];
    let by = (0..3).map(|axis| grid.affine.step_mm(axis) * steps[axis] as f64).sum::<Vector3<f64>>();
    let mesh = lattice(&grid, [5, 7, 3], [0.0; 3], grid.shape.map(|n| n as f64 - 1.0));
    let deformed: Vec<_> =
        mesh.rest.iter().map(|p| (p.map(f64::from) + by / 1000.0).map(|c| c as f32)).collect();
    let warp = warp(&mesh, &deformed);
    let all = whole(&Displacement::to_rest(&grid, &warp).unwrap());
    let labels: Vec<u16> = (0..grid.len() as u16).map(|n| n + 1).collect();
    let (moved, _) = resample_labels(&grid, &labels, 0, &warp, &|_, _| {}).unwrap();
    for index in 0..grid.len() {
        let point = grid.point(index);
        let inside = (0..3).all(|axis| point[axis] >= steps[axis]);
        let expected = if inside { (Coverage::Inside, -by) } else { (Coverage::Vacated, Vector3::zeros()) };
        assert_eq!(all.coverage[index], expected.0, "at {point:?}");
        assert!((Vector3::from(all.vectors_mm[index]).map(f64::from) - expected.1).norm() < 2e-5);
        let from = [0, 1, 2].map(|axis| point[axis].wrapping_sub(steps[axis]));
        assert_eq!(moved[index], if inside { labels[grid.index(from)] } else { 0 }, "at {point:?}");
    }
}

/// The share of voxels where a field leads to another value than resampling the volume.
fn share_apart(volume: &Volume, field: &Slab, deformed: &Volume, sign: f64) -> f64 {
    let grid = volume.grid();
    let wrong = (0..grid.len()).filter(|&index| {
        let vector = Vector3::from(field.vectors_mm[index]).map(f64::from);
        let expected = match field.coverage[index] {
            Coverage::Vacated => f64::from(AIR),
            Coverage::Outside => f64::from(volume.voxels()[index]),
            Coverage::Inside => {
                let place = grid.mm(grid.point(index)) + vector.component_mul(&Vector3::new(sign, 1.0, 1.0));
                f64::from(volume.trilinear(grid.affine.to_index(place)))
            }
        };
        (f64::from(deformed.voxels()[index]) - expected).abs() > 0.6
    });
    wrong.count() as f64 / grid.len() as f64
}

#[test]
fn the_field_leads_to_the_values_that_resampling_takes() {
    let grid = grid([37, 29, 23]);
    let (volume, mesh) = (noise(grid, 5), in_body(&grid));
    let deformed = bent(&mesh);
    let removed: Vec<[u32; 4]> = mesh.tets[40..60].to_vec();
    let kept: Vec<[u32; 4]> = [&mesh.tets[..40], &mesh.tets[60..]].concat();
    let warp = Warp { tets: &kept, body_tets: kept.len(), removed: &removed, ..warp(&mesh, &deformed) };
    let (resampled, report) = resample(&volume, &warp, &|_, _| {}).unwrap();
    let field = Displacement::to_rest(&grid, &warp).unwrap();
    let all = whole(&field);
    let count = |coverage| all.coverage.iter().filter(|of| **of == coverage).count();
    let inside = all.coverage.iter().zip(&all.vectors_mm).filter(|(of, _)| **of == Coverage::Inside);
    assert_eq!(inside.filter(|(_, vector)| **vector != [0.0; 3]).count(), report.moved_voxels);
    assert_eq!(count(Coverage::Vacated), report.vacated_voxels);
    assert!(report.vacated_voxels > 200 && report.moved_voxels > 3000, "{report:?}");
    assert_eq!(share_apart(&volume, &all, &resampled, 1.0), 0.0);
    let control = share_apart(&volume, &all, &resampled, -1.0);
    assert!(control > 0.3, "a flipped axis: {control}");
    let one_by_one: Vec<Slab> = (0..field.slabs()).map(|number| field.slab(number)).collect();
    assert!(all.vectors_mm.iter().eq(one_by_one.iter().flat_map(|slab| &slab.vectors_mm)));
}

/// Where a tet moves inside another one, the one with the lower index owns the points, also if it
/// has not moved.
#[test]
fn of_several_tets_the_first_one_counts() {
    let grid = Grid { shape: [9, 9, 9], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
    let corners = [[0.0; 3], [0.008, 0.0, 0.0], [0.0, 0.008, 0.0], [0.0, 0.0, 0.008]].map(Point3::from);
    let aside = corners.map(|p: Point3<f32>| Point3::new(p.x + 0.1, p.y, p.z));
    let (rest, deformed) = ([corners, aside].concat(), [corners, corners].concat());
    for (tets, expected) in [([[0, 1, 2, 3], [4, 5, 6, 7]], 0.0), ([[4, 5, 6, 7], [0, 1, 2, 3]], 100.0)] {
        let origin_mm = Point3::origin();
        let warp =
            Warp { origin_mm, rest: &rest, deformed: &deformed, tets: &tets, body_tets: 2, removed: &[] };
        let all = whole(&Displacement::to_rest(&grid, &warp).unwrap());
        let held = |index: &usize| grid.point(*index).iter().sum::<usize>() <= 8;
        for index in (0..grid.len()).filter(held) {
            assert!((all.vectors_mm[index][0] - expected).abs() < 1e-4, "{:?}", all.vectors_mm[index]);
        }
    }
}

#[test]
fn the_field_from_rest_moves_vertices_as_the_mesh_does() {
    let grid = grid([25, 21, 19]);
    let mesh = lattice(&grid, [6, 5, 4], [3.0, 3.0, 3.0], [21.0, 18.0, 15.0]);
    let deformed = bent(&mesh);
    let (removed, kept) = mesh.tets.split_at(30);
    let warp = Warp { tets: kept, body_tets: kept.len(), removed, ..warp(&mesh, &deformed) };
    let all = whole(&Displacement::from_rest(&grid, &warp).unwrap());
    let (mut checked, mut cut) = (0, 0);
    for (rest, deformed) in mesh.rest.iter().zip(&deformed) {
        let mm = mesh.origin_mm + rest.coords.map(f64::from) * 1000.0;
        let place = grid.affine.to_index(mm);
        let index = grid.index([0, 1, 2].map(|axis| place[axis].round() as usize));
        if all.coverage[index] == Coverage::Vacated {
            cut += 1;
            assert_eq!(all.vectors_mm[index], [0.0; 3]);
            continue;
        }
        let expected = (deformed - rest).map(f64::from) * 1000.0;
        let found = Vector3::from(all.vectors_mm[index]).map(f64::from);
        assert!((found - expected).norm() < 1e-4, "{found} is not {expected}");
        assert!((found + expected).norm() > 1e-3, "the control: the other direction");
        checked += 1;
    }
    assert!(checked > 150 && cut > 0, "{checked} {cut}");
}

#[test]
fn wrong_input_is_refused() {
    let grid = grid([9, 9, 9]);
    let mesh = lattice(&grid, [2, 2, 2], [1.0; 3], [7.0; 3]);
    let mut deformed = mesh.rest.clone();
    let few = resample_labels(&grid, &[1_u8; 728], 0, &warp(&mesh, &deformed), &|_, _| {});
    assert!(matches!(few, Err(ResampleError::Volume(_))), "{few:?}");
    deformed[3].y = f32::NAN;
    let refused = Displacement::to_rest(&grid, &warp(&mesh, &deformed)).err();
    assert!(matches!(refused, Some(ResampleError::NotFinite { vertex: 3, .. })), "{refused:?}");
    let empty = Grid { shape: [9, 0, 9], ..grid };
    assert!(Displacement::to_rest(&empty, &warp(&mesh, &mesh.rest)).is_err());
    // A body that has burst: its huge tets are clipped to the grid.
    deformed.iter_mut().for_each(|p| *p *= 1e30);
    deformed[3].y = 1e30;
    let burst = whole(&Displacement::to_rest(&grid, &warp(&mesh, &deformed)).unwrap());
    assert!(burst.vectors_mm.iter().flatten().all(|c| c.is_finite()));
}
