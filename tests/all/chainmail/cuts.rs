//! Incisions of a chain at the start of a run and later.

use std::collections::HashSet;

use super::*;
use crate::scenes::column;

const REPORT: (&str, &str) = ("output", "{ report = true }");

/// Number of links that the incisions of a scene cut.
fn lost(loaded: &LoadedScene) -> Vec<([usize; 2], usize)> {
    let mut whole = loaded.clone();
    whole.scene.incision.clear();
    let left: HashSet<_> = Twin::of(loaded).links.into_iter().collect();
    Twin::of(&whole).links.into_iter().filter(|link| !left.contains(link)).collect()
}

/// Largest extension of a link across the cut, mm.
fn widest(ended: &Ended, lost: &[([usize; 2], usize)]) -> f64 {
    let across = lost.iter().filter(|(_, axis)| *axis == 0);
    across.map(|&([a, b], _)| ended.by[b].x - ended.by[a].x).fold(0.0, f64::max)
}

#[test]
fn a_cut_lets_one_side_move_and_the_other_stay() {
    let cut = chain(&[REPORT, INCISION, ASIDE, UNRELAXED, UNIFORM]);
    let (lost, ended) = (lost(&cut), Ended::of(&cut));
    assert_eq!(ended.chainmail().cut_links, lost.len());
    let wound = ended.run.report.wound.as_ref().unwrap();
    assert!(wound.mid_mm - wound.initial_mid_mm > 8.0, "{wound:?}");
    assert!(widest(&ended, &lost) > 11.9 && ended.chainmail().violated_links == 0);
    let right = |ended: &Ended| {
        let beyond = ended.twin.rest.iter().zip(&ended.by).filter(|(rest, _)| rest.x > 0.0);
        beyond.map(|(_, by)| by.norm()).fold(0.0, f64::max)
    };
    assert_eq!(right(&ended), 0.0);
    // Negative control: without the incision the links hold both sides together.
    let whole = Ended::of(&chain(&[ASIDE, UNRELAXED, UNIFORM]));
    assert_eq!(whole.chainmail().cut_links, 0);
    assert!(right(&whole) > 3.0 && widest(&whole, &lost) < 0.3 * STEPS_MM[0] + EXACT_MM);
}

/// A handle does not grab tissue that an incision removed.
#[test]
fn a_handle_in_a_cut_grabs_the_remaining_tissue() {
    let at = Vector3::new(0.0, 100.0, 0.0);
    let handle = format!("[{{ at_mm = {:?}, radius_mm = 20, move_mm = [0, 9, 0] }}]", <[f64; 3]>::from(at));
    let ended = Ended::of(&chain(&[INCISION, ("incision.0.width_mm", "13"), ("handle", &handle)]));
    let near = |v: &usize| (ended.twin.rest[*v].coords.cast::<f64>() * 1000.0 - at).norm() < 20.0;
    let taken: Vec<usize> = (0..ended.by.len()).filter(|&v| ended.twin.still[v]).filter(near).collect();
    assert!(taken.len() > 2 && !ended.twin.held[0].is_empty(), "{}", taken.len());
    assert!(taken.iter().all(|&v| ended.by[v] == Vector3::zeros()));
    assert!(ended.twin.held[0].iter().all(|&v| ended.by[v].y > 6.0));
}

#[test]
fn an_incision_acts_from_its_time_on() {
    let common = [REPORT, INCISION, ASIDE, UNRELAXED, UNIFORM];
    let at = |at_s| chain(&[&common[..], &[("incision.0.at_s", at_s)]].concat());
    let (early, late) = (Ended::of(&at("0")), Ended::of(&at("0.375")));
    assert_eq!(early.chainmail().cut_links, late.chainmail().cut_links);
    assert!(early.chainmail().cut_links > 0 && early.by != late.by);
    // The handle moves by 3 mm in each of four frames. The links hold until the cut, which comes
    // before the last frame.
    let growth = |ended: &Ended| -> Vec<f64> {
        column(&ended.run, "gape_0_mid_mm").windows(2).map(|pair| pair[1] - pair[0]).collect()
    };
    let (early, late) = (growth(&early), growth(&late));
    assert!(early[..4].iter().all(|mm| *mm > 2.9), "{early:?}");
    assert!(late[2] < 0.01 && late[3] > 2.9, "{late:?}");
    // Before the cut the run equals the run without an incision.
    let before = Ended::of(&first(3, &at("0.375")));
    let whole = Ended::of(&first(3, &chain(&[ASIDE, UNRELAXED, UNIFORM])));
    assert!(before.chainmail().cut_links == 0 && before.by == whole.by);
    let cut = Ended::of(&first(4, &at("0.375")));
    assert!(cut.chainmail().cut_links > 0);
}

/// Two incisions of different lengths with a handle next to each. The cuts come in either order.
#[test]
fn each_incision_cuts_its_own_links_at_its_own_time() {
    const LEFT: &str = "{ from_mm = [-50, 105, -50], to_mm = [-50, 105, 50], depth_mm = 40, width_mm = 9";
    const RIGHT: &str = "{ from_mm = [50, 105, -25], to_mm = [50, 105, 25], depth_mm = 40, width_mm = 9";
    let handles = "[{ at_mm = [-68, 90, 0], radius_mm = 22, move_mm = [-12, 0, 0], over_s = 0.5 },
        { at_mm = [68, 90, 0], radius_mm = 22, move_mm = [12, 0, 0], over_s = 0.5 }]";
    let scene = |incisions: &[(&str, f64)]| {
        let all: Vec<String> =
            incisions.iter().map(|(cut, at_s)| format!("{cut}, at_s = {at_s} }}")).collect();
        chain(&[
            REPORT,
            UNRELAXED,
            UNIFORM,
            ("handle", handles),
            ("incision", &format!("[{}]", all.join(","))),
        ])
    };
    let alone = |cut: &str| lost(&scene(&[(cut, 0.0)])).len();
    let [left, right] = [LEFT, RIGHT].map(alone);
    assert!(left > 10 && right > 10 && left != right, "{left} {right}");
    for (times, counts) in [
        ([0.0, 0.0], [left + right, left + right, left + right]),
        ([0.0, 0.375], [left, left, left + right]),
        ([0.375, 0.0], [right, right, left + right]),
        ([0.375, 0.125], [0, right, left + right]),
    ] {
        for swapped in [false, true] {
            let mut incisions = [(LEFT, times[0]), (RIGHT, times[1])];
            if swapped {
                incisions.reverse();
            }
            let scene = scene(&incisions);
            let cut = |frames| Run::of(&first(frames, &scene)).report.chainmail.unwrap().cut_links;
            assert_eq!([1, 3, 4].map(cut), counts, "{times:?} {swapped}");
            // The links hold each wound together until its cut, and not after it.
            let run = Run::of(&scene);
            for (wound, (_, at_s)) in incisions.iter().enumerate() {
                let (gapes, frame) = (column(&run, &format!("gape_{wound}_mid_mm")), (at_s / 0.125) as usize);
                assert!(gapes[frame] - gapes[0] < 0.3 * STEPS_MM[0] + 0.01, "{times:?} {swapped} {gapes:?}");
                assert!(gapes[frame + 1] - gapes[frame] > 2.9, "{times:?} {swapped} {gapes:?}");
            }
        }
    }
}

/// Before the later cut the run equals the run with the earlier incision alone. Shared links and
/// the order in the scene do not matter.
#[test]
fn overlapping_incisions_cut_at_their_own_times() {
    const SHALLOW: &str = "{ from_mm = [0, 110, -50], to_mm = [0, 110, 50], depth_mm = 20, width_mm = 9";
    const DEEP: &str = "{ from_mm = [0, 110, -50], to_mm = [0, 110, 50], depth_mm = 40, width_mm = 9";
    const ACROSS: &str = "{ from_mm = [-45, 110, 0], to_mm = [45, 110, 0], depth_mm = 30, width_mm = 9";
    const WIDE: &str = "{ from_mm = [-35, 107, -50], to_mm = [-35, 107, 50], depth_mm = 30, width_mm = 50";
    let scene = |incisions: &[(&str, f64)]| {
        let all: Vec<String> =
            incisions.iter().map(|(cut, at_s)| format!("{cut}, at_s = {at_s} }}")).collect();
        chain(&[REPORT, UNRELAXED, UNIFORM, ("incision", &format!("[{}]", all.join(",")))])
    };
    let without = |cuts: &[&str]| lost(&scene(&cuts.iter().map(|cut| (*cut, 0.0)).collect::<Vec<_>>())).len();
    for [a, b] in [[SHALLOW, DEEP], [DEEP, DEEP], [DEEP, ACROSS], [DEEP, WIDE]] {
        let both = without(&[a, b]);
        for [early, late] in [[a, b], [b, a]] {
            let first_alone = without(&[early]);
            assert!(first_alone > 10 && both >= first_alone);
            let cut = |scene: &LoadedScene, frames| {
                Run::of(&first(frames, scene)).report.chainmail.unwrap().cut_links
            };
            for incisions in [[(early, 0.125), (late, 0.25)], [(late, 0.25), (early, 0.125)]] {
                let counts = [1, 2, 3].map(|frames| cut(&scene(&incisions), frames));
                assert_eq!(counts, [0, first_alone, both], "{incisions:?}");
            }
        }
    }
}

/// There is no contact, so the lips can pass through each other.
#[test]
fn lips_that_pass_through_each_other_are_reported() {
    let over = "[{ at_mm = [-18, 97, 0], radius_mm = 22, move_mm = [40, 0, 0], over_s = 0.5 }]";
    let chainmail = |handle| Ended::of(&chain(&[REPORT, INCISION, ("handle", handle), UNIFORM])).run.report;
    let crossed = |report: &cutis::report::Report| {
        report.warnings.iter().any(|line| line.contains("incision[0] have passed through each other"))
    };
    let (through, apart) = (chainmail(over), chainmail(ASIDE.1));
    assert!(crossed(&through) && through.wound.as_ref().unwrap().mid_mm < 0.0, "{:?}", through.wound);
    assert!(!crossed(&apart), "{:?}", apart.warnings);
}

#[test]
fn a_cut_after_the_last_drag_does_not_change_the_energy_before_it() {
    let chainmail = |cut: &[(&str, &str)]| {
        let common = [ASIDE, ("chainmail.relax_per_frame", "3")];
        Ended::of(&chain(&[&common[..], cut].concat())).chainmail().clone()
    };
    let (whole, cut) = (chainmail(&[]), chainmail(&[INCISION, ("incision.0.at_s", "0.625")]));
    assert!(cut.cut_links > 0 && whole.energy_before > 0.0, "{cut:?}");
    assert_eq!((cut.energy_before, cut.energy_after == whole.energy_after), (whole.energy_before, false));
}
