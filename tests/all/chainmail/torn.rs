//! Handles that move farther than the links allow.

use nalgebra::Point3;

use super::*;

const FAR: (&str, &str) =
    ("handle", "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 150, 0], over_s = 0.5 }]");

/// Place and amount, in mm, from the warning about tissue that cannot follow.
fn warned(warnings: &[String]) -> Option<(usize, Point3<f64>, f64, bool)> {
    let mut all = warnings.iter().filter(|line| line.contains("beyond their limits"));
    let line = all.next()?;
    assert!(all.next().is_none() && line.contains("chainmail.materials") && line.contains("mm"), "{line}");
    let between = |from: &str, to: &str| line.split_once(from).unwrap().1.split_once(to).unwrap().0;
    let place: Vec<f64> = between("the vertex at [", "]").split(", ").map(|c| c.parse().unwrap()).collect();
    let links = line.split(' ').next().unwrap().parse().unwrap();
    let excess = between("by up to ", " mm").parse().unwrap();
    Some((links, Point3::from_slice(&place), excess, line.contains("is fixed")))
}

/// The handle still arrives. The run reports the number of links beyond their limits and the final
/// excess.
#[test]
fn tissue_that_cannot_follow_is_reported_with_place_and_amount() {
    for relax in ["0", "10"] {
        let set = [FAR, UNIFORM, ("chainmail.relax_per_frame", relax)];
        let ended = Ended::of(&chain(&set));
        let report = &ended.run.report;
        assert_eq!(report.frames.count, 6);
        let held = &ended.twin.held[0];
        assert!(held.iter().all(|&v| (ended.by[v] - Vector3::new(0.0, 150.0, 0.0)).norm() < EXACT_MM));
        let excesses: Vec<f64> = ended.excesses(0.7, 1.3, 0.4).filter(|&mm| mm > EXACT_MM).collect();
        let most = excesses.iter().copied().fold(0.0, f64::max);
        assert!(most > 1.0 && ended.chainmail().violated_links == excesses.len(), "{most}");
        let (links, place, excess, fixed) = warned(&report.warnings).unwrap();
        assert!(links == excesses.len() && (excess - most).abs() < 0.0051, "{excess} {most}");
        let near = |v: &usize| (ended.twin.rest[*v].cast::<f64>() * 1000.0 - place).norm() < 0.2;
        let vertex = (0..ended.by.len()).find(near).unwrap();
        assert!(if fixed { ended.twin.still[vertex] } else { held.contains(&vertex) }, "{place}");
    }
    let near = Run::of(&chain(&[HANDLE, UNIFORM]));
    assert!(
        near.report.chainmail.as_ref().unwrap().violated_links == 0
            && warned(&near.report.warnings).is_none()
    );
}

/// Two rigid ends are pulled apart. One is fixed, and a later frame brings the other back.
#[test]
fn rigid_and_fixed_tissue_does_not_follow() {
    let rigid = "[{ from_hu = -1024, shortest = 1, longest = 1, shear = 0 }]";
    let ended = Ended::of(&chain(&[HANDLE, ("chainmail.materials", rigid)]));
    let fixed = (0..ended.by.len()).filter(|&v| ended.twin.still[v]);
    assert!(fixed.clone().count() > 100 && fixed.into_iter().all(|v| ended.by[v] == Vector3::zeros()));
    let (links, _, excess, _) = warned(&ended.run.report.warnings).unwrap();
    assert!(links > 0 && excess > 1.0 && ended.chainmail().violated_links == links);
    // Without fixed tissue the whole body follows as one piece.
    let free = Ended::of(&chain(&[HANDLE, ("chainmail.materials", rigid), ("fixed", "{}")]));
    assert_eq!((free.chainmail().moved, free.chainmail().violated_links), (free.by.len(), 0));
    assert_eq!((free.chainmail().energy_after, free.chainmail().relax_moves), (0.0, 0));
    assert!(free.by.iter().all(|by| (by - Vector3::new(0.0, 20.0, 5.0)).norm() < EXACT_MM));
}
