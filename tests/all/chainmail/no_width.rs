//! Cuts of no width in a chain: links are cut, and nothing is removed.

use std::collections::HashMap;

use super::*;
use crate::scenes::{column, frames, run_in};

/// A cut of 100 mm along the belly, next to the handle `ASIDE`. More keys follow.
fn cut(keys: &str) -> String {
    format!("[{{ from_mm = [0, 110, -50], to_mm = [0, 110, 50], depth_mm = 40{keys} }}]")
}

const ALL: (&str, &str) = ("output", "{ volume = true, surface = true, report = true }");
const REPORT: (&str, &str) = ("output", "{ report = true }");

/// A chain of one material with this cut, whose left lip is pulled aside.
fn pulled(keys: &str, set: &[(&str, &str)]) -> LoadedScene {
    let incision = cut(keys);
    chain(&[&[REPORT, ASIDE, UNRELAXED, UNIFORM, ("incision", incision.as_str())], set].concat())
}

/// The real vertex at the place of each virtual one.
fn twins(ended: &Ended) -> Vec<(usize, usize)> {
    let mut first = HashMap::new();
    let mut twins = Vec::new();
    for (vertex, rest) in ended.twin.rest.iter().enumerate() {
        let real = *first.entry([rest.x, rest.y, rest.z].map(f32::to_bits)).or_insert(vertex);
        if real != vertex {
            twins.push((vertex, real));
        }
    }
    twins
}

/// Number of vertices that are not virtual.
fn real(ended: &Ended) -> usize {
    ended.by.len() - twins(ended).len()
}

/// Links of the uncut body across the cut, with the place of their lower end in mm.
fn across(uncut: &Ended) -> Vec<([usize; 2], Vector3<f64>)> {
    let mm = |v: usize| uncut.twin.rest[v].coords.cast::<f64>() * 1000.0;
    let links = uncut.twin.links.iter().filter(|(_, axis)| *axis == 0);
    let crossing = links.filter(|([a, b], _)| mm(*a).x < 0.0 && mm(*b).x > 0.0);
    let near = crossing.filter(|([a, _], _)| mm(*a).z.abs() < 50.0 && mm(*a).y > 60.0);
    near.map(|(ends, _)| (*ends, mm(ends[0]))).collect()
}

fn largest(ended: &Ended, which: impl Fn(f64) -> bool) -> f64 {
    let vertices = ended.twin.rest[..real(ended)].iter().zip(&ended.by);
    vertices.filter(|(rest, _)| which(f64::from(rest.x))).map(|(_, by)| by.norm()).fold(0.0, f64::max)
}

#[test]
fn one_side_moves_and_the_other_stays() {
    let ended = Ended::of(&pulled("", &[]));
    let report = &ended.run.report;
    let chainmail = ended.chainmail();
    assert!(chainmail.cut_links > 20 && chainmail.violated_links == 0, "{chainmail:?}");
    assert_eq!((report.sizes.removed_vertices, largest(&ended, |x| x > 0.0)), (0, 0.0));
    assert!(largest(&ended, |x| x < 0.0) > 11.9);
    let wound = report.wound.as_ref().unwrap();
    assert!(wound.initial_mm.abs() < 1e-6 && wound.initial_mid_mm.abs() < 1e-6, "{wound:?}");
    assert!(wound.mid_mm > 11.0 && wound.mid_mm < 12.5, "{wound:?}");
    // Virtual vertices continue the tissue of the other side of the cut.
    let twins = twins(&ended);
    let follows = |&&(node, vertex): &&(usize, usize)| {
        let mm = ended.twin.rest[vertex].coords * 1000.0;
        mm.z.abs() < 20.0 && mm.y > 85.0 && ended.by[node] != ended.by[vertex]
    };
    let apart: Vec<_> = twins.iter().filter(follows).collect();
    let near = twins.iter().map(|&(n, v)| (ended.twin.rest[v] * 1000.0, ended.by[v], ended.by[n]));
    let near: Vec<_> = near.filter(|(p, ..)| p.z.abs() < 20.0).collect();
    assert!(apart.len() > 4, "{} of {}: {near:?}", apart.len(), twins.len());
    for &(node, vertex) in apart {
        let left = ended.twin.rest[vertex].x < 0.0;
        assert!((ended.by[node].norm() < 1e-9) == left, "{node}: {:?}", ended.by[node]);
    }
    // Control: without the incision the links hold both sides together.
    let whole = Ended::of(&chain(&[ASIDE, UNRELAXED, UNIFORM]));
    assert!(largest(&whole, |x| x > 0.0) > 3.0);
    assert!(report.sizes.vertices > whole.by.len() && real(&ended) == whole.by.len());
}

/// Without a drag the deformed CT is the scan, voxel for voxel. Controls: a drag, and a cut with a
/// width.
#[test]
fn a_cut_at_rest_leaves_every_voxel() {
    let run = |keys: &str, handle: (&str, &str)| {
        let incision = cut(keys);
        Run::of(&chain(&[ALL, handle, ("incision", incision.as_str())]))
    };
    let none = ("handle", "[]");
    for keys in ["", ", at_s = 0.25", ", at_s = 0.125, speed_mm_s = 200.0", ", speed_mm_s = 50.0"] {
        let still = run(keys, none);
        let (chainmail, resample) = (still.report.chainmail.as_ref().unwrap(), &still.report.resample);
        assert!(chainmail.cut_links > 0 && chainmail.moved == 0, "{keys}: {chainmail:?}");
        assert!(still.deformed().voxels() == original().voxels(), "{keys}");
        assert_eq!((resample.as_ref().unwrap().vacated_voxels, still.report.max_displacement_mm), (0, 0.0));
    }
    assert!(run("", ASIDE).deformed().voxels() != original().voxels());
    assert!(run(", width_mm = 9", none).deformed().voxels() != original().voxels());
}

/// Voxels that the wound uncovers become air, and no tissue is lost: the tissue of the sides is
/// only stretched. Control: a cut with a width has less tissue.
#[test]
fn nothing_is_removed() {
    let tissue = |volume: &cutis::volume::Volume| volume.voxels().iter().filter(|hu| **hu > -449).count();
    let share = |keys: &str| {
        let run = Run::of(&pulled(keys, &[ALL]));
        tissue(&run.deformed()) as f64 / tissue(&original()) as f64
    };
    let [whole, removed] = ["", ", width_mm = 9"].map(share);
    assert!((whole - 1.0).abs() < 2e-3 && removed < whole - 2e-3, "{whole} {removed}");
}

/// The links ahead of the blade hold, and those behind it are cut. Virtual vertices ahead of it are
/// with the vertices at their places.
#[test]
fn a_cut_grows_along_its_path() {
    const SPEED: &str = ", at_s = 0.125, speed_mm_s = 200.0";
    let wide = ("handle", "[{ at_mm = [-18, 97, 0], radius_mm = 60, move_mm = [-12, 0, 0], over_s = 0.5 }]");
    let uncut = Ended::of(&chain(&[ASIDE, UNRELAXED, UNIFORM]));
    let links = across(&uncut);
    let growing = pulled(SPEED, &[]);
    let at_once = Ended::of(&pulled("", &[])).chainmail().cut_links;
    let counts = [1, 2, 3, 4, 5, 6].map(|n| Ended::of(&first(n, &growing)).chainmail().cut_links);
    // The frames begin 0, 0, 25, 50, 75 and 100 mm along the path.
    assert!(counts[1] == 0 && counts[5] == at_once && counts[1..].is_sorted_by(|a, b| a < b), "{counts:?}");
    for (count, share) in counts[2..].iter().zip([0.25, 0.5, 0.75, 1.0]) {
        assert!((*count as f64 / at_once as f64 - share).abs() < 0.12, "{counts:?}");
    }
    let half = Ended::of(&first(4, &pulled(SPEED, &[("handle", wide.1.replace("60", "21").as_str())])));
    let extension = |&[a, b]: &[usize; 2]| half.by[b].x - half.by[a].x;
    let (behind, ahead): (Vec<_>, Vec<_>) = links.iter().partition(|(_, mm)| mm.z <= 0.0);
    assert!(ahead.len() > 10 && behind.iter().any(|(ends, _)| extension(ends) > 6.0));
    assert!(ahead.iter().all(|(ends, _)| extension(ends) <= 0.3 * STEPS_MM[0] + EXACT_MM));
    let step = STEPS_MM[2];
    let (mut apart, mut together) = (0, 0);
    for (node, vertex) in twins(&half) {
        let z = f64::from(half.twin.rest[vertex].z) * 1000.0;
        let same = half.by[node] == half.by[vertex];
        // A tet that the blade has begun to pass reaches up to two steps ahead of it.
        assert!(same || z < 2.0 * step, "{z} mm");
        (apart, together) = (apart + usize::from(!same), together + usize::from(same));
    }
    assert!(apart > 10 && together > 10, "{apart} {together}");
    // Control: after the whole cut, vertices ahead of the middle are apart too.
    let whole = Ended::of(&pulled(SPEED, &[wide]));
    let beyond = |(_, vertex): &(usize, usize)| f64::from(whole.twin.rest[*vertex].z) * 1000.0 > 2.0 * step;
    assert!(
        twins(&whole).into_iter().filter(beyond).any(|(node, vertex)| whole.by[node] != whole.by[vertex])
    );
}

/// Until the cut begins, the chain is that of the uncut body, to the bit, and the wound is closed.
/// Control: one frame later.
#[test]
fn nothing_is_torn_before_the_cut() {
    let uncut = Ended::of(&first(3, &chain(&[ASIDE, UNIFORM])));
    let relaxed = ("chainmail.relax_per_frame", "10");
    for keys in [", at_s = 0.375", ", at_s = 0.25, speed_mm_s = 250.0"] {
        let scene = pulled(keys, &[relaxed]);
        let before = Ended::of(&first(3, &scene));
        assert_eq!(before.chainmail().cut_links, 0, "{keys}");
        assert!(before.by[..real(&before)] == uncut.by[..], "{keys}");
        assert!(twins(&before).iter().all(|&(node, vertex)| before.by[node] == before.by[vertex]), "{keys}");
        let run = Ended::of(&scene);
        let gapes = column(&run.run, "gape_0_mid_mm");
        assert!(gapes[..4].iter().all(|mm| mm.abs() < 1e-3) && gapes[6] > 1.0, "{keys}: {gapes:?}");
        assert!(run.by[..real(&run)] != Ended::of(&chain(&[ASIDE, UNIFORM])).by[..], "{keys}");
        let warned =
            run.run.report.warnings.iter().any(|line| line.contains("incision[0] comes 93.8 of 100"));
        assert_eq!(warned, keys.contains("speed"), "{:?}", run.run.report.warnings);
    }
}

/// Links that two cuts cross are cut once, by the earlier one. A bent path and a cut with a width
/// are cut next to it.
#[test]
fn cuts_of_all_kinds_are_made_in_one_body() {
    const ALONG: &str = "{ from_mm = [0, 110, -50], to_mm = [0, 110, 50], depth_mm = 40";
    const BENT: &str = "{ path_mm = [[-40, 107, -40], [0, 110, 2], [45, 107, 40]], depth_mm = 30";
    const WIDE: &str = "{ from_mm = [50, 105, -60], to_mm = [50, 105, -20], depth_mm = 40, width_mm = 9";
    let links = |cuts: &[(&str, f64)], frames| {
        let all: Vec<String> = cuts.iter().map(|(cut, at_s)| format!("{cut}, at_s = {at_s} }}")).collect();
        let incisions = format!("[{}]", all.join(","));
        let scene = chain(&[REPORT, UNRELAXED, UNIFORM, ("incision", incisions.as_str())]);
        Run::of(&first(frames, &scene)).report.chainmail.unwrap().cut_links
    };
    let [along, bent, wide] = [ALONG, BENT, WIDE].map(|cut| links(&[(cut, 0.0)], 1));
    let both = links(&[(ALONG, 0.0), (BENT, 0.0)], 1);
    assert!(along.max(bent) < both && both <= along + bent, "{along} {bent} {both}");
    for (order, expected) in [
        ([(ALONG, 0.0), (BENT, 0.25), (WIDE, 0.125)], [along, along + wide, both + wide]),
        ([(WIDE, 0.25), (BENT, 0.0), (ALONG, 0.125)], [bent, both, both + wide]),
    ] {
        assert_eq!([1, 2, 3].map(|frames| links(&order, frames)), expected, "{order:?}");
    }
}

/// A run that is split while the blade is on its way continues with the same bits. Control: another
/// speed.
#[test]
fn a_run_resumes_in_the_middle_of_a_cut() {
    const SPEED: &str = ", at_s = 0.125, speed_mm_s = 200.0";
    let set = [ALL, ("chainmail.relax_per_frame", "3")];
    let scene = pulled(SPEED, &set);
    let whole = Run::of(&scene);
    for middle in 1..=6 {
        let folder = tempfile::tempdir().unwrap();
        run_in(folder.path(), &first(middle, &scene), false).unwrap();
        let report = run_in(folder.path(), &scene, true).unwrap();
        for file in ["checkpoint.bin", "skin.vtu", "deformed.nii.gz"] {
            assert!(
                std::fs::read(folder.path().join(file)).unwrap() == whole.bytes(file),
                "{middle}: {file}"
            );
        }
        assert_eq!(frames(folder.path()), frames(whole.folder()), "{middle}");
        let cut = |report: &cutis::report::Report| report.chainmail.as_ref().unwrap().cut_links;
        assert_eq!(cut(&report), cut(&whole.report), "{middle}");
    }
    let control = Run::of(&pulled(&SPEED.replace("200", "150"), &set));
    assert!(control.state() != whole.state());
}
