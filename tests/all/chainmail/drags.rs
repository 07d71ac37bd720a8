//! Tissue that handles drag, and tissue that stays where it is.

use std::f64::consts::FRAC_PI_2;

use cutis::report::ChainmailReport;
use cutis::volume::{Affine, Grid, Volume};
use nalgebra::{Matrix4, Rotation3};

use super::*;

const CT: (&str, &str) = ("output", "{ volume = true }");

#[test]
fn a_body_without_a_drag_stays_where_it_is() {
    for backend in ["cpu", "reference"] {
        let ended = Ended::of(&chain(&[CT, ("solver.backend", backend)]));
        // A single sweep finds that nothing has to move.
        let still = ChainmailReport { relax_sweeps: 1, settled: true, ..ChainmailReport::default() };
        assert_eq!(*ended.chainmail(), still);
        assert!(ended.run.positions() == ended.twin.rest && ended.run.report.max_displacement_mm == 0.0);
        let found = ended.run.deformed();
        assert_eq!(found.grid(), original().grid());
        assert!(found.voxels() == original().voxels());
        let [warning] = &ended.run.report.warnings[..] else { panic!("{:?}", ended.run.report.warnings) };
        assert!(warning.contains("there is no handle"), "{warning}");
    }
    let dragged = Run::of(&chain(&[CT, HANDLE])).deformed();
    assert!(dragged.voxels() != original().voxels(), "the control");
}

/// Removed tissue becomes air at any time, as with the other model.
#[test]
fn a_cut_without_a_drag_only_removes_tissue() {
    let other = Run::of(&chain(&[CT, INCISION, ("model", "pbd"), ("run.frames", "0")])).deformed();
    assert!(other.voxels() != original().voxels());
    for at_s in ["0", "0.25"] {
        let ended = Ended::of(&chain(&[CT, INCISION, ("incision.0.at_s", at_s)]));
        assert!(ended.chainmail().cut_links > 0 && ended.chainmail().moved == 0 && ended.moved() == 0);
        assert!(ended.run.deformed().voxels() == other.voxels(), "{at_s}");
    }
}

#[test]
fn a_handle_follows_its_path_at_any_time() {
    let scene = chain(&[HANDLE]);
    let whole = Vector3::new(0.0, 20.0, 5.0);
    // The movement takes four frames.
    for (frames, share) in [(1, 0.25), (2, 0.5), (4, 1.0), (6, 1.0)] {
        let (ended, chainmail) = (Ended::of(&first(frames, &scene)), whole * share);
        let held = &ended.twin.held[0];
        assert!(
            held.len() > 1 && held.iter().all(|&v| (ended.by[v] - chainmail).norm() < EXACT_MM),
            "{frames}"
        );
        assert!((ended.run.report.max_displacement_mm - chainmail.norm()).abs() < EXACT_MM);
        assert!(
            ended.chainmail().moved == ended.moved() && ended.moved() > held.len(),
            "{:?}",
            ended.chainmail()
        );
        assert_eq!(ended.chainmail().violated_links, 0);
        let mut fixed = (0..ended.by.len()).filter(|&v| ended.twin.still[v]);
        assert!(fixed.all(|v| ended.by[v] == Vector3::zeros()), "{frames}");
        assert!(ended.run.report.sizes.fixed_vertices > 100);
    }
}

/// A handle with a time moves nothing before it, and then takes the path of one without. Control:
/// the handle without a time.
#[test]
fn a_handle_with_a_time_waits_for_it() {
    let late = HANDLE.1.replace("over_s", "at_s = 0.2, over_s");
    let at = |frames: u32, handle: &str| Ended::of(&first(frames, &chain(&[("handle", handle), UNRELAXED])));
    // The frame that begins at 0.25 s is the third.
    assert!(at(2, &late).by.iter().all(|by| *by == Vector3::zeros()));
    assert!(at(2, HANDLE.1).by.iter().any(|by| *by != Vector3::zeros()));
    assert!(at(5, &late).by == at(3, HANDLE.1).by);
}

/// A handle grabs tissue where other handles have moved it. Control: it holds it from the start.
#[test]
fn a_handle_with_a_time_grabs_tissue_where_it_is() {
    const FIRST: &str = "{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 30, 0], over_s = 0.25 }";
    let after = |at_s: &str| {
        let second = format!(
            "{{ at_mm = [-12, 100, 0], radius_mm = 13, move_mm = [0, 0, 12], at_s = {at_s}, over_s = 0.25 }}"
        );
        Ended::of(&chain(&[("handle", &format!("[{FIRST}, {second}]")), UNRELAXED]))
    };
    let (start, late) = (after("0"), after("0.25"));
    let held = &late.twin.held[1];
    assert!(held.iter().all(|&v| (start.by[v] - Vector3::new(0.0, 0.0, 12.0)).norm() < EXACT_MM));
    assert!(held.iter().all(|&v| (late.by[v].z - 12.0).abs() < EXACT_MM));
    assert!(
        held.iter().any(|&v| late.by[v].y > 3.0),
        "{:?}",
        held.iter().map(|&v| late.by[v]).collect::<Vec<_>>()
    );
}

/// Two handles move at different speeds. One of them holds tissue that the scene fixes.
#[test]
fn handles_move_independently() {
    let handles = "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 20, 5], over_s = 0.5 },
        { at_mm = [0, -55, 0], radius_mm = 9, move_mm = [1, 2, -1], over_s = 0.25 }]";
    let scene = chain(&[("handle", handles), UNIFORM]);
    for (frames, moved) in
        [(1, [[0.0, 5.0, 1.25], [0.5, 1.0, -0.5]]), (6, [[0.0, 20.0, 5.0], [1.0, 2.0, -1.0]])]
    {
        let ended = Ended::of(&first(frames, &scene));
        for (held, moved) in ended.twin.held.iter().zip(moved) {
            assert!(!held.is_empty());
            assert!(held.iter().all(|&v| (ended.by[v] - Vector3::from(moved)).norm() < EXACT_MM), "{frames}");
        }
        assert_eq!(ended.chainmail().violated_links, 0);
    }
    // The plane of the scene fixes this vertex.
    let fixed = |set: &[(&str, &str)]| Run::of(&chain(set)).report.sizes.fixed_vertices;
    let grabbed = Twin::of(&scene).held[1].len();
    assert_eq!(fixed(&[]) - fixed(&[("handle", handles)]), grabbed);
}

/// The links are the lattice edges along the axes. All stay within their limits, and some reach
/// them.
#[test]
fn links_are_edges_within_their_limits() {
    for relax in ["0", "10"] {
        let ended = Ended::of(&chain(&[HANDLE, UNIFORM, ("chainmail.relax_per_frame", relax)]));
        assert_eq!(ended.run.report.sizes.edges, ended.twin.links.len());
        let excesses: Vec<f64> = ended.excesses(0.7, 1.3, 0.4).collect();
        assert!(excesses.iter().all(|&excess| excess < EXACT_MM), "beyond a limit");
        assert!(excesses.iter().any(|&excess| excess > -2.0 * EXACT_MM), "none is at its limit");
        let energy = ended.strains().map(|(_, strain)| 0.5 * strain.norm_squared()).sum::<f64>();
        let chainmail = ended.chainmail().energy_after;
        assert!((chainmail / energy - 1.0).abs() < 1e-4, "{chainmail} mm², and by the positions {energy}");
    }
}

/// Tissue outside a region stays, and tissue at its border is fixed.
#[test]
fn a_region_is_fixed_at_its_border() {
    let region = ("lattice.region", "{ around_mm = 60 }");
    let ended = Ended::of(&chain(&[HANDLE, region, ("fixed", "{}")]));
    let sizes = &ended.run.report.sizes;
    let still = ended.twin.still.iter().filter(|still| **still).count();
    assert!(sizes.frozen_vertices > 1000 && still > 50 && sizes.fixed_vertices == still, "{sizes:?}");
    assert!(ended.by.iter().zip(&ended.twin.still).all(|(by, still)| !still || *by == Vector3::zeros()));
    assert_eq!(sizes.edges, ended.twin.links.len());
    assert!(ended.chainmail().moved > ended.twin.held[0].len());
}

/// A CT that is rotated and stored along other axes gives the same result in its own frame.
#[test]
fn the_ct_may_have_any_orientation() {
    let turn =
        Rotation3::from_euler_angles(0.0, 0.0, 0.5) * Rotation3::from_euler_angles(0.0, FRAC_PI_2, 0.0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("turned.nii");
    let upright = original();
    let rows = upright.grid().affine.rows();
    let rows = turn.to_homogeneous() * Matrix4::from_fn(|row, column| rows[row][column]);
    let affine = Affine::from_rows(rows.transpose().into()).unwrap();
    let grid = Grid { affine, ..*upright.grid() };
    nifti::write(&path, &Volume::new(grid, upright.voxels().to_vec(), 1.0, 0.0).unwrap()).unwrap();
    let run = |volume: &str, turn: Rotation3<f64>| {
        let [at, by] =
            [[-40.0, 100.0, 0.0], [-7.0, 20.0, 5.0]].map(|v| <[f64; 3]>::from(turn * Vector3::from(v)));
        let handle = format!("[{{ at_mm = {at:?}, radius_mm = 15, move_mm = {by:?}, over_s = 0.5 }}]");
        let fixed = "{ bone_above_hu = 250, end_layers = [\"k\"] }";
        Ended::of(&chain(&[("volume", volume), ("handle", &handle), ("fixed", fixed), UNIFORM, UNRELAXED]))
    };
    let turned = run(&format!("{{ path = {path:?} }}"), turn);
    let upright = run(&CT_FILE, Rotation3::identity());
    assert!(turned.chainmail().moved == upright.chainmail().moved && turned.moved() > 100);
    assert!(turned.by.iter().zip(&upright.by).all(|(a, b)| (a - turn * b).norm() < 2.0 * EXACT_MM));
}

#[test]
fn relaxation_lowers_the_energy_until_it_settles() {
    let chainmail = |relax: &str, frames: u32| {
        let scene = chain(&[HANDLE, ("chainmail.relax_per_frame", relax)]);
        Run::of(&first(frames, &scene)).report.chainmail.unwrap()
    };
    let without = chainmail("0", 6);
    assert_eq!((without.relax_sweeps, without.relax_moves, without.settled), (0, 0, false));
    assert!(without.energy_before == without.energy_after && without.energy_after > 0.0, "{without:?}");
    // The handle moves until the fourth frame. Later frames continue the relaxation.
    let (few, more, all) = (chainmail("1", 4), chainmail("1", 6), chainmail("1", 60));
    assert_eq!([few.relax_sweeps, more.relax_sweeps], [4, 6]);
    assert!(few.energy_before == more.energy_before && few.energy_before == all.energy_before);
    let energies = [few.energy_before, few.energy_after, more.energy_after, all.energy_after];
    assert!(energies.is_sorted_by(|a, b| a > b) && all.energy_after < without.energy_after, "{energies:?}");
    // Tissue that has settled relaxes again after the next drag.
    let at_once = chainmail("1000", 4);
    assert!(at_once.settled && at_once.energy_after < at_once.energy_before, "{at_once:?}");
    assert!(!few.settled && !more.settled && all.settled && all.relax_sweeps < 60, "{all:?}");
}
