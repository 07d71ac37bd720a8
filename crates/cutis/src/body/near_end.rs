//! Finds cuts that lie close to tissue that is held, or to the end of the scan. Both change how far
//! a wound opens.

use cutis_mesh::HalfSpace;
use cutis_volume::Volume;
use nalgebra::{Point3, Vector3, distance};

use crate::scene::{BoxSection, Scene};

/// Distance between the points of a cut from which distances are measured, as a share of its size.
const STEP: f64 = 0.1;

/// How near a cut may come without a note, as a share of its size. In a plate that ends this far
/// from both ends of a slit, the stress at its ends is 19 % larger than in a wide plate (`sec(π a /
/// w)` under the root, with a slit of `2 a` in a plate of `w`: Feddersen, ASTM STP 410, 1966); at
/// its own size it is 7 % larger.
const NEAR: f64 = 0.5;

/// Notes on cuts that are nearer to fixed planes, to fixed boxes or to the end of the scan than
/// half their size. Bone does not count: it holds the wound of a patient too.
pub(crate) fn notes(scene: &Scene, volume: &Volume) -> Vec<String> {
    let incisions = scene.incision.iter().map(|cut| cut.path()).enumerate();
    let excisions = scene.excision.iter().map(|cut| cut.path_mm.clone()).enumerate();
    let cuts = incisions
        .map(|(n, path)| (format!("incision[{n}]"), path))
        .chain(excisions.map(|(n, path)| (format!("excision[{n}]"), path)));
    cuts.filter_map(|(name, path)| note(&name, &path, scene, volume)).collect()
}

fn note(name: &str, path: &[[f64; 3]], scene: &Scene, volume: &Volume) -> Option<String> {
    let path: Vec<Point3<f64>> = path.iter().map(|&point| point.into()).collect();
    let pairs = path.iter().enumerate().flat_map(|(n, p)| path[n + 1..].iter().map(|q| distance(p, q)));
    let size_mm = pairs.fold(0.0, f64::max);
    let points = along(&path, STEP * size_mm);
    let nearest =
        |to: &dyn Fn(Point3<f64>) -> f64| points.iter().map(|&p| to(p)).fold(f64::INFINITY, f64::min);
    let ends = nearest_end(&points, NEAR * size_mm, scene.tissue.air_below_hu, volume);
    let end = ("the end of the scan".to_owned(), ends, "use a scan that goes on there");
    let planes = scene.fixed.planes.iter().enumerate().map(|(n, plane)| {
        (format!("fixed.planes[{n}]"), nearest(&|p| to_plane(p, plane)), "move the plane away")
    });
    let boxes = scene
        .fixed
        .boxes
        .iter()
        .enumerate()
        .map(|(n, b)| (format!("fixed.boxes[{n}]"), nearest(&|p| to_box(p, b)), "make the box smaller"));
    let (what, mm, remedy) =
        planes.chain(boxes).chain([end]).min_by(|(_, a, _), (_, b, _)| a.total_cmp(b))?;
    (mm < NEAR * size_mm).then(|| {
        format!(
            "{name} is {mm:.0} mm from {what}, nearer than half its size of {size_mm:.0} mm, so that its opening is \
             not that of a body that goes on: make the cut shorter, place it farther away, or {remedy}"
        )
    })
}

/// Points of a path at most `step` mm apart.
fn along(path: &[Point3<f64>], step: f64) -> Vec<Point3<f64>> {
    let mut points: Vec<Point3<f64>> = path.first().copied().into_iter().collect();
    for pair in path.windows(2) {
        let count = (distance(&pair[0], &pair[1]) / step).ceil().clamp(1.0, 1.0 / STEP);
        points.extend((1..=count as usize).map(|n| pair[0] + (pair[1] - pair[0]) * (n as f64 / count)));
    }
    points
}

fn to_plane(p: Point3<f64>, plane: &HalfSpace) -> f64 {
    let normal = Vector3::from(plane.normal);
    ((Point3::from(plane.point_mm) - p).dot(&normal) / normal.norm()).max(0.0)
}

fn to_box(p: Point3<f64>, b: &BoxSection) -> f64 {
    let beyond = |axis: usize| (b.min_mm[axis] - p[axis]).max(p[axis] - b.max_mm[axis]).max(0.0);
    Vector3::from_fn(|axis, _| beyond(axis)).norm()
}

/// Distance in mm of the points from tissue in the outermost voxels of the scan. Infinite if there
/// is none within `most` mm.
fn nearest_end(points: &[Point3<f64>], most: f64, air_below_hu: f32, volume: &Volume) -> f64 {
    let grid = volume.grid();
    let mut nearest = f64::INFINITY;
    for axis in 0..3 {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let last = grid.shape[axis] - 1;
        // Distance between planes of voxels, which are not perpendicular to the axis in a sheared
        // grid.
        let normal = grid.affine.step_mm(u).cross(&grid.affine.step_mm(v)).normalize();
        let between = grid.affine.step_mm(axis).dot(&normal).abs();
        for end in [0, last] {
            let to_face = |p: &Point3<f64>| (grid.affine.to_index(*p)[axis] - end as f64).abs() * between;
            let near: Vec<&Point3<f64>> = points.iter().filter(|p| to_face(p) < most.min(nearest)).collect();
            if near.is_empty() {
                continue;
            }
            for (a, b) in (0..grid.shape[u]).flat_map(|a| (0..grid.shape[v]).map(move |b| (a, b))) {
                let mut at = [0; 3];
                (at[axis], at[u], at[v]) = (end, a, b);
                if volume.hu(volume.voxels()[grid.index(at)]) >= air_below_hu {
                    let mm = grid.mm(at);
                    nearest = near.iter().map(|p| distance(&mm, p)).fold(nearest, f64::min);
                }
            }
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cutis_volume::{Affine, Grid};

    use super::*;

    /// A block of tissue from the first to the last slice, with air at the sides.
    fn block() -> Volume {
        let rows = [[0.0, 2.0, 0.0, 0.0], [-2.0, 0.0, 0.0, 98.0], [0.0, 0.0, 2.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let affine = Affine::from_rows(rows);
        let grid = Grid { shape: [50, 50, 51], affine: affine.unwrap() };
        let inside = |n: usize| {
            let mm = grid.mm(grid.point(n));
            (0..2).all(|axis| (20.0..=80.0).contains(&mm[axis]))
        };
        let hu = (0..grid.len()).map(|n| if inside(n) { 40 } else { -1000 }).collect();
        Volume::new(grid, hu, 1.0, 0.0).unwrap()
    }

    fn found(z: [f64; 2], fixed: &str) -> Vec<String> {
        let text = format!(
            "volume = {{ phantom = {{ size = [8, 8, 8] }} }}\nfixed = {fixed}\nincision = [{{ from_mm = \
             [50, 80, {:?}], to_mm = [50, 80, {:?}], depth_mm = 5 }}]",
            z[0], z[1]
        );
        let loaded = Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap();
        notes(&loaded.scene, &block())
    }

    #[test]
    fn a_cut_that_is_nearer_to_the_end_than_half_its_size_has_a_note() {
        // 100 mm high. The sides of the scan are air, 20 mm from the cut.
        assert_eq!(found([16.0, 46.0], "{}"), Vec::<String>::new());
        let near = found([13.0, 43.0], "{}");
        assert!(near[0].starts_with("incision[0] is 13 mm from the end of the scan"), "{near:?}");
        assert!(
            near[0].contains("half its size of 30 mm") && near[0].contains("make the cut shorter"),
            "{near:?}"
        );
    }

    #[test]
    fn fixed_planes_and_boxes_count_and_the_nearest_one_is_named() {
        let plane = |y: f64| {
            let planes = format!("{{ point_mm = [0, {y:?}, 0], normal = [0, -2, 0] }}");
            found([34.0, 64.0], &format!("{{ planes = [{planes}] }}"))
        };
        assert!(plane(70.0)[0].contains("10 mm from fixed.planes[0]"), "{:?}", plane(70.0));
        assert_eq!(plane(60.0), Vec::<String>::new());
        let boxes = "{ boxes = [{ min_mm = [0, 0, 0], max_mm = [40, 90, 90] }] }";
        let near = found([34.0, 64.0], boxes);
        assert!(near[0].contains("10 mm from fixed.boxes[0]"), "{near:?}");
    }
}
