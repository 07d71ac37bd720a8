//! `cutis inspect`, `skin`, `check` and single slices, compared with the body and with the
//! phantom's anatomy.

use cutis::mesh::{SkinMode, Split};
use cutis::render::{Plane, SliceView, slice};
use cutis::volume::{phantom::Phantom, sample::LatticeSize};
use cutis::{Silent, SkinRequest};

use super::body::{BODY_MM, HU, VOXEL_MM, ct, finished};
use super::image::Picture;
use super::nifti::Nifti;
use super::vtu::Vtu;

fn with_file<T>(volume: &Nifti, look: impl FnOnce(&std::path::Path) -> T) -> T {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ct.nii.gz");
    std::fs::write(&path, volume.to_bytes()).unwrap();
    look(&path)
}

#[test]
fn an_inspection_describes_the_file() {
    let scaled = Nifti { scaling: [2.0, 10.0], ..ct() };
    let found = with_file(&scaled, |path| {
        serde_json::to_value(cutis::inspect(path, &Default::default()).unwrap()).unwrap()
    });
    assert_eq!(found["shape"], serde_json::json!([48, 32, 50]));
    assert_eq!(found["orientation"], "LPS");
    assert_eq!(found["dtype"], "int16");
    assert_eq!(found["spacing_mm"], serde_json::json!([VOXEL_MM, VOXEL_MM, VOXEL_MM]));
    for (row, expected) in scaled.rows.iter().enumerate() {
        assert_eq!(found["affine"][row], serde_json::json!(expected), "row {row}");
    }
    let hu = |n| scaled.hu(n);
    let sum: f64 = (0..scaled.voxels.len()).map(hu).sum();
    assert_eq!(found["hu_sum"].as_f64(), Some(sum));
    let ends = [found["hu_min"].as_f64(), found["hu_max"].as_f64()];
    assert_eq!(ends, [Some(-1990.0), Some(2.0 * f64::from(HU[1]) + 10.0)]);
    assert_eq!(found["nan_count"], 0);
}

/// The skin file of the body has the right frame and position, and as many triangles as the report
/// says.
#[test]
fn the_skin_of_a_file_lies_on_the_body() {
    let request = SkinRequest {
        read: Default::default(),
        lattice: LatticeSize::Native,
        split: Split::Kuhn6,
        mode: SkinMode::Exterior,
        offset_hu: 0.0,
    };
    let (report, bytes) = with_file(&ct(), |path| {
        let out = path.with_file_name("skin.vtu");
        let report = cutis::find_skin(path, &request, Some(&out), &Silent).unwrap();
        (report, std::fs::read(&out).unwrap())
    });
    let mesh = Vtu::of_bytes(&bytes);
    assert_eq!((mesh.space.as_str(), mesh.cells.len()), ("LPS", report.triangles));
    for (axis, sign) in [-1.0, -1.0, 1.0].into_iter().enumerate() {
        let along: Vec<f64> = mesh.points.iter().map(|point| sign * point[axis]).collect();
        let low = along.iter().copied().fold(f64::MAX, f64::min);
        let high = along.iter().copied().fold(f64::MIN, f64::max);
        let [from, to] = BODY_MM.map(|corner| corner[axis]);
        assert!((0.0..=VOXEL_MM).contains(&(low - from)), "axis {axis}: from {low}");
        assert!((0.0..=VOXEL_MM).contains(&(to - high)), "axis {axis}: to {high}");
    }
    assert_eq!((report.vertices, report.tets), (48 * 32 * 50, 6 * 47 * 31 * 49));
    assert_eq!(report.air_vertex_histogram.iter().sum::<usize>(), report.tets);
    assert_eq!((report.components, report.euler_characteristic, report.open_edges), (1, 2, 0));
    assert_eq!((report.coverage, report.enclosed_share), (1.0, 0.0));
}

/// The counts of a plan equal those that the run of the same scene reports.
#[test]
fn a_plan_has_the_counts_of_the_run() {
    let run = finished();
    let scene: cutis::Scene = serde_json::from_value(run.report["scene"].clone()).unwrap();
    let plan = with_file(&ct(), |path| {
        let mut scene = scene;
        scene.volume.path = Some(path.into());
        let text = toml_of(&scene);
        let loaded = cutis::Scene::parse(&text, "body.toml".as_ref(), "".as_ref(), &[]).unwrap();
        serde_json::to_value(cutis::check(&loaded, &Silent).unwrap()).unwrap()
    });
    for key in ["sizes", "colors", "memory", "device_memory", "left_out"] {
        assert_eq!(plan[key], run.report[key], "{key}");
    }
    assert_eq!(plan["volume_bytes"], 2 * 48 * 32 * 50);
    let sizes = ["edges", "tets", "skin_triangles"].map(|key| run.number(&format!("/sizes/{key}")));
    // Substeps of one iteration each, all constraints in each.
    let projections = 12.0 * 5.0 * sizes.iter().sum::<f64>();
    assert_eq!(plan["projections"].as_f64(), Some(projections));
}

fn toml_of(scene: &cutis::Scene) -> String {
    toml::to_string(scene).unwrap()
}

/// The spine is posterior, the lungs are superior, and the liver is on the patient's right: the
/// orientation letters must agree.
#[test]
fn slices_of_the_phantom_have_the_letters_of_its_anatomy() {
    let volume = Phantom::new([64, 64, 48], 1).unwrap().volume().unwrap();
    let draw = |plane| {
        let view = SliceView { long_side: Some(1200), ..SliceView::new(plane, 0.0) };
        Picture::of_bytes(&slice(&volume, &view).unwrap().to_png().unwrap())
    };
    // Mean position of bone, from 0 at the left or top to 1 at the right or bottom.
    let bone = |picture: &Picture, axis: usize| {
        let size = [picture.width, picture.height];
        // Without the letters at the edges and the scale bar.
        let inner = |at: &[usize; 2]| (0..2).all(|n| at[n] > size[n] / 12 && at[n] < 11 * size[n] / 12);
        let pixels: Vec<_> = picture.find(|pixel| pixel == [255; 3]).into_iter().filter(inner).collect();
        assert!(pixels.len() > 500, "{} pixels of bone", pixels.len());
        pixels.iter().map(|at| at[axis] as f64).sum::<f64>() / (pixels.len() * size[axis]) as f64
    };
    let share = |picture: &Picture, parts: [[f64; 2]; 2], accepts: &dyn Fn(u8) -> bool| {
        let [columns, rows] = [(parts[0], picture.width), (parts[1], picture.height)]
            .map(|([from, to], size)| (from * size as f64) as usize..(to * size as f64) as usize);
        let part = picture.part(columns, rows);
        part.find(|[gray, _, _]| accepts(gray)).len() as f64 / (part.width * part.height) as f64
    };
    let axial = draw(Plane::Axial);
    assert_eq!(axial.letters(), ['R', 'L', 'A', 'P']);
    assert!(bone(&axial, 1) > 0.55, "the spine is posterior: {}", bone(&axial, 1));
    let sagittal = draw(Plane::Sagittal);
    assert_eq!(sagittal.letters(), ['A', 'P', 'S', 'I']);
    assert!(bone(&sagittal, 0) > 0.6, "the spine is posterior: {}", bone(&sagittal, 0));

    let coronal = draw(Plane::Coronal);
    assert_eq!(coronal.letters(), ['R', 'L', 'S', 'I']);
    let air = |rows| share(&coronal, [[0.22, 0.42], rows], &|gray| gray < 20);
    let (top, bottom) = (air([0.02, 0.14]), air([0.84, 0.98]));
    assert!(top > bottom + 0.3, "lungs are superior: {top} at the top, {bottom} at the bottom");
    let liver = |columns| share(&coronal, [columns, [0.2, 0.45]], &|gray| (120..180).contains(&gray));
    let (left, right) = (liver([0.2, 0.45]), liver([0.55, 0.8]));
    assert!(left > right + 0.2, "the liver is on the right: {left} and {right}");
}
