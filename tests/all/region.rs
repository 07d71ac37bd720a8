//! A region of interest or a graded lattice saves work far from the action and changes little near
//! it.

use cutis::volume::{Volume, nifti, phantom::Phantom};
use cutis::{Error, Plan, Scene, Silent};
use nalgebra::Point3;

use crate::scenes::{Run, SMALL, folder, overrides, run_in, scene};

const REGION: &str = "lattice.region";
const GRADING: &str = "lattice.grading";
const FINER: (&str, &str) = ("lattice.spacing_mm", "7.0");

fn growth(run: &Run) -> f64 {
    let wound = run.report.wound.as_ref().unwrap();
    wound.final_mm - wound.initial_mm
}

fn small(set: &[(&str, &str)]) -> Run {
    // The substeps can follow this tension. With higher tension the loss would depend on the
    // lattice.
    let modulus = ("constraints.stc.area_modulus_n_per_m", "5");
    let common = [FINER, modulus, ("run.frames", "20"), ("output", "{ report = true }")];
    Run::of(&scene(SMALL, &[&common, set].concat()))
}

fn plan(set: &[(&str, &str)]) -> Plan {
    cutis::check(&scene(SMALL, set), &Silent).unwrap()
}

fn line<'a>(plan: &'a Plan, topic: &str) -> Option<&'a String> {
    plan.left_out.iter().find(|line| line.starts_with(&format!("{topic}:")))
}

fn bytes(plan: &Plan) -> usize {
    plan.memory.iter().map(|part| part.bytes).sum()
}

fn refusal(set: &[(&str, &str)]) -> (String, String) {
    let loaded = scene(SMALL, set);
    match cutis::check(&loaded, &Silent).unwrap_err() {
        error @ Error::SceneKey { .. } => {
            assert!(error.is_bad_input());
            let text = error.to_string();
            let Error::SceneKey { key, .. } = error else { unreachable!() };
            (key, text)
        }
        other => panic!("{other}"),
    }
}

/// A scene at rest that names no region gets one. The wound opens in it as in the whole body, to
/// the error that the plan states. Control: a region of half the size of the cut.
#[test]
fn a_scene_at_rest_gets_a_region_that_hardly_changes_the_wound() {
    let constraints = "{ distance = {}, volume = {}, membrane = { preset = 'trunk' } }";
    let own = [
        ("scan_is_at_rest", "true"),
        ("materials", "trunk"),
        ("lattice", "{ spacing_mm = 6, split = 'five' }"),
        ("constraints", constraints),
        ("incision", "[{ from_mm = [5, 110, -20], to_mm = [5, 110, 20], depth_mm = 15 }]"),
        ("solver", "{ formulation = 'vbd', substeps = 2, iterations = 4 }"),
        ("run.frames", "90"),
        ("output", "{ report = true }"),
    ];
    let run = |region: Option<&str>| {
        let named = region.map(|region| (REGION, region));
        Run::of(&scene(SMALL, &[&own[..], named.as_slice()].concat())).report
    };
    let [picked, whole, small] = [None, Some("whole"), Some("{ around_mm = 20 }")].map(run);
    let opening = |report: &cutis::report::Report| report.wound.as_ref().unwrap().final_mm;
    let error = |report| opening(report) / opening(&whole) - 1.0;
    assert!(opening(&whole) > 2.0 && picked.sizes.tets * 2 < whole.sizes.tets, "{:?}", picked.sizes);
    assert!(error(&picked) < 0.0 && error(&picked) > -0.04, "{}", error(&picked));
    assert!(error(&small) < -0.1, "{}", error(&small));
    let says =
        |report: &cutis::report::Report| report.left_out.iter().any(|line| line.contains("it was picked"));
    assert!(says(&picked) && !says(&whole) && !says(&small));
    assert!(picked.warnings.iter().all(|line| !line.contains("lattice.region")), "{:?}", picked.warnings);
}

#[test]
fn a_region_costs_only_its_own_vertices() {
    let (whole, part) = (plan(&[]), plan(&[(REGION, "{ around_mm = 30 }")]));
    let (sizes, all) = (&part.sizes, &whole.sizes);
    assert_eq!(
        (sizes.vertices + sizes.frozen_vertices, sizes.tets + sizes.frozen_tets),
        (all.vertices, all.tets)
    );
    assert!(sizes.tets * 2 < all.tets && bytes(&part) * 2 < bytes(&whole), "{sizes:?}");
    assert!(sizes.fixed_vertices > 0 && part.projections * 2 < whole.projections);
    assert_eq!((all.frozen_vertices, all.frozen_tets), (0, 0));
    assert!(line(&whole, "region").is_none() && line(&whole, "grading").is_none());
    // The reported savings are the real ones.
    let said = line(&part, "region").unwrap();
    let words: Vec<&str> = said.split(' ').collect();
    let saved: f64 = words[words.iter().position(|word| *word == "MB").unwrap() - 1].parse().unwrap();
    let right = (bytes(&whole) - bytes(&part)) as f64 / 1e6;
    assert!((saved - right).abs() < 0.06 + 0.02 * right, "{said}: {right}");
    // The skin is that of the whole body. The region adds none.
    assert!(sizes.skin_triangles < all.skin_triangles);

    let graded = plan(&[(GRADING, "{ around_mm = 25 }")]);
    assert!(graded.sizes.tets < all.tets && line(&graded, "grading").is_some());
    let both = plan(&[(GRADING, "{ around_mm = 25 }"), (REGION, "{ around_mm = 60 }")]);
    assert!(
        both.sizes.tets < graded.sizes.tets
            && line(&both, "grading").is_some()
            && line(&both, "region").is_some()
    );
}

/// A region around the whole body changes nothing. The error grows as the region shrinks.
#[test]
fn the_opening_converges_to_that_of_the_whole_body() {
    let whole = small(&[]);
    let all = small(&[(REGION, "{ around_mm = 1000 }")]);
    let frames = |run: &Run| String::from_utf8(run.bytes("frames.csv")).unwrap();
    let gapes = |run: &Run| -> Vec<String> {
        frames(run).lines().map(|line| line.split(',').skip(3).collect::<Vec<_>>().join(",")).collect()
    };
    assert_eq!(gapes(&all), gapes(&whole));
    assert!(all.report.warnings.iter().any(|line| line.contains("leaves nothing out")));
    assert!(all.report.border_displacement_mm.is_none() && whole.report.border_displacement_mm.is_none());
    let parts = ["22", "40", "80"].map(|r| small(&[(REGION, &format!("{{ around_mm = {r} }}"))]));
    let errors = parts.each_ref().map(|part| (growth(part) / growth(&whole) - 1.0).abs());
    assert!(errors[0] > errors[2] && errors[2] < 0.05, "{errors:?}");
    // Tension acts on all of the skin, so tissue moves near the border of the region.
    let at_border = parts.each_ref().map(|part| part.report.border_displacement_mm.unwrap());
    let largest = parts.each_ref().map(|part| part.report.max_displacement_mm);
    assert!(at_border.iter().zip(largest).all(|(&at_border, most)| at_border > 0.0 && at_border <= most));

    let graded = small(&[(GRADING, "{ around_mm = 30 }")]);
    assert!((growth(&graded) / growth(&whole) - 1.0).abs() < 0.1, "{} {}", growth(&graded), growth(&whole));
    assert_ne!(gapes(&graded), gapes(&whole));
}

fn volume_of(set: &[(&str, &str)]) -> Volume {
    let common = [FINER, ("run.frames", "5"), ("output", "{ volume = true }")];
    let run = Run::of(&scene(SMALL, &[&common, set].concat()));
    nifti::read(run.path("deformed.nii.gz")).unwrap().volume
}

/// Beyond the region and the cells at its border every voxel is unchanged.
#[test]
fn frozen_tissue_is_unchanged_bit_for_bit() {
    let original = Phantom::new([64, 64, 48], 1).unwrap().volume().unwrap();
    let (around, step) = (30.0, 7.0);
    let far = |n: usize| {
        let p = original.grid().mm(original.grid().point(n));
        // The incision is 20 mm deep at y = 110.
        let d = |v: f64, low: f64, high: f64| (low - v).max(v - high).max(0.0);
        let s = Point3::new(p.x - 30.0, d(p.y, 70.0, 130.0), d(p.z, -50.0, 50.0));
        s.coords.norm() > around + 2.0 * step * 3f64.sqrt()
    };
    let changed = |volume: &Volume| {
        let pairs = original.voxels().iter().zip(volume.voxels());
        let changed: Vec<usize> = pairs.enumerate().filter(|(_, (a, b))| a != b).map(|(n, _)| n).collect();
        let far = changed.iter().filter(|&&n| far(n)).count();
        (changed.len() - far, far)
    };
    let (near, beyond) = changed(&volume_of(&[(REGION, "{ around_mm = 30 }")]));
    assert!(near > 500 && beyond == 0, "{near} {beyond}");
    // Negative control: without a region these voxels change.
    assert!(changed(&volume_of(&[])).1 > 100);
    // A body at rest is unchanged with a region and with a graded lattice.
    for zone in [REGION, GRADING] {
        let uncut = [("incision", "[]"), (zone, "{ min_mm = [-60, 0, -60], max_mm = [60, 200, 60] }")];
        let still = [("constraints.stc.rest_area_scale", "1.0")];
        assert!(volume_of(&[&uncut[..], &still].concat()).voxels() == original.voxels(), "{zone}");
        assert!(volume_of(&uncut).voxels() != original.voxels(), "{zone}");
    }
}

#[test]
fn outputs_show_the_whole_patient() {
    let triangles = |set: &[(&str, &str)]| {
        let common = [("run.frames", "2"), ("output", "{ surface = true, tissue = true, pictures = true }")];
        let run = Run::of(&scene(SMALL, &[&common, set].concat()));
        let cells = |file: &str| -> usize {
            let text = String::from_utf8_lossy(&run.bytes(file)).into_owned();
            let count = text.split("NumberOfCells=\"").nth(1).unwrap();
            count.split('"').next().unwrap().parse().unwrap()
        };
        assert_eq!(cells("tissue.vtu"), run.report.sizes.tets);
        assert_eq!(run.names(), ["after.png", "before.png", "skin.vtu", "slice.png", "tissue.vtu"]);
        (cells("skin.vtu"), run.report.sizes.skin_triangles)
    };
    let (whole, part) = (triangles(&[]), triangles(&[(REGION, "{ around_mm = 30 }")]));
    assert!(part.0 == whole.0 && part.1 < whole.1, "{whole:?} {part:?}");
}

#[test]
fn invalid_regions_are_refused_by_name() {
    let handle = ("handle", "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 20, 5] }]");
    let elsewhere = "{ min_mm = [-60, -60, -60], max_mm = [-20, 60, 60] }";
    let nothing = "{ min_mm = [500, 500, 500], max_mm = [510, 510, 510] }";
    let near_handle = "{ min_mm = [-40, 20, -100], max_mm = [100, 200, 100] }";
    let uncut = ("incision", "[]");
    /// Overrides, the key that the error names, and a part of its message.
    type Refused<'a> = (&'a [(&'a str, &'a str)], &'a str, &'a str);
    let cases: [Refused<'_>; 8] = [
        (&[(REGION, "{ around_mm = 4 }")], REGION, "incision[0]"),
        (&[(REGION, elsewhere)], REGION, "incision[0]"),
        (&[(REGION, nothing), uncut], REGION, "none of the"),
        (&[(REGION, near_handle), handle], REGION, "handle[0]"),
        (&[(GRADING, elsewhere)], GRADING, "incision[0]"),
        (&[(GRADING, "{ around_mm = 0.1 }")], GRADING, "incision[0]"),
        (&[(GRADING, near_handle), handle, ("lattice.spacing_mm", "4.0"), uncut], GRADING, "handle[0]"),
        (&[(GRADING, nothing), uncut], GRADING, "fine zone"),
    ];
    for (set, key, says) in cases {
        match cutis::check(&scene(SMALL, set), &Silent).unwrap_err() {
            Error::SceneSection { section, source, .. } => {
                assert!(section == key && source.to_string().contains(says), "{set:?}: {source}");
            }
            _ => {
                let (found, text) = refusal(set);
                assert!(found == key && text.contains(says), "{set:?}: {text}");
            }
        }
    }
    // The change that the message suggests is enough.
    let (_, text) = refusal(&[(REGION, "{ around_mm = 4 }")]);
    let enough = text.rsplit(' ').next().unwrap();
    plan(&[(REGION, &format!("{{ around_mm = {enough} }}"))]);

    let parse = |set: &[(&str, &str)]| Scene::load(&folder().join(SMALL), &overrides(set)).unwrap_err();
    let bad: [(&[(&str, &str)], &str); 8] = [
        (&[(REGION, "{}")], REGION),
        (&[(REGION, "{ around_mm = 30, min_mm = [0, 0, 0], max_mm = [1, 1, 1] }")], REGION),
        (&[(REGION, "{ min_mm = [0, 0, 0] }")], REGION),
        (&[(REGION, "{ around_mm = -1 }")], "lattice.region.around_mm"),
        (&[(REGION, "{ around_mm = 30 }"), uncut], "lattice.region.around_mm"),
        (&[(REGION, "{ min_mm = [0, 0, 0], max_mm = [1, -1, 1] }")], "lattice.region.max_mm"),
        (&[(GRADING, "{ around_mm = 30, growth = 2.5 }")], "lattice.grading.growth"),
        (&[(GRADING, "{ around_mm = 30, coarsest = 9 }")], "lattice.grading.coarsest"),
    ];
    for (set, expected) in bad {
        let error = parse(set);
        assert!(matches!(&error, Error::SceneKey { key, .. } if key == expected), "{set:?}: {error}");
    }
}

/// A resumed run in a region equals an uninterrupted one for any number of threads. A checkpoint of
/// another region is refused.
#[test]
fn regions_resume_and_run_on_any_number_of_threads() {
    let loaded = |frames: &str, threads: &str, around: &str| {
        let zone = format!("{{ around_mm = {around} }}");
        let set = [
            (REGION, zone.as_str()),
            (GRADING, "{ around_mm = 25 }"),
            ("run.frames", frames),
            ("solver.threads", threads),
            ("run.checkpoint_every", "3"),
            ("output", "{ surface = true }"),
        ];
        scene(SMALL, &set)
    };
    let [whole, halves, other] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    run_in(whole.path(), &loaded("6", "1", "40"), false).unwrap();
    run_in(halves.path(), &loaded("3", "3", "40"), false).unwrap();
    run_in(halves.path(), &loaded("6", "2", "40"), true).unwrap();
    run_in(other.path(), &loaded("6", "1", "41"), false).unwrap();
    let read = |folder: &tempfile::TempDir| std::fs::read(folder.path().join("skin.vtu")).unwrap();
    assert!(read(&whole) == read(&halves));
    assert!(read(&whole) != read(&other));
    assert!(matches!(run_in(other.path(), &loaded("7", "1", "40"), true), Err(Error::Checkpoint { .. })));
}
