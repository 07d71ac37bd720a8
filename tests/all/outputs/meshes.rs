//! `skin.vtu` and `tissue.vtu`: frame, signs, units, arrays and orientation, compared with the
//! landmarks of the body.

use super::body::{BODY_MM, Finished, HANDLE_MM, MARKERS_MM, MOVE_MM, STEP_MM, finished, hu_at};
use super::vtu::Vtu;

fn mesh(run: &Finished, name: &str) -> Vtu {
    let mesh = Vtu::of_bytes(&run.files[name]);
    assert_eq!(mesh.space, "LPS", "{name}");
    mesh
}

/// From LPS to RAS: the first two coordinates change their sign.
fn ras([x, y, z]: [f64; 3]) -> [f64; 3] {
    [-x, -y, z]
}

/// Positions before and after, RAS mm.
fn states(mesh: &Vtu) -> Vec<[[f64; 3]; 2]> {
    let moved = mesh.vectors("displacement_mm");
    let both = |(now, by): (&[f64; 3], &[f64; 3])| {
        let (now, by) = (ras(*now), ras(*by));
        [std::array::from_fn(|axis| now[axis] - by[axis]), now]
    };
    mesh.points.iter().zip(&moved).map(both).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn points_minus_displacements_are_the_body_at_rest() {
    for name in ["skin.vtu", "tissue.vtu"] {
        let states = states(&mesh(finished(), name));
        assert!(states.len() > 500, "{name}");
        for axis in 0..3 {
            let rest = states.iter().map(|[rest, _]| rest[axis]);
            let (low, high) = rest.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
            let [from, to] = BODY_MM.map(|corner| corner[axis]);
            assert!((0.0..STEP_MM).contains(&(low - from)), "{name}, axis {axis}: from {low}");
            assert!((0.0..STEP_MM).contains(&(to - high)), "{name}, axis {axis}: to {high}");
        }
        for [rest, _] in &states {
            assert!(hu_at(*rest) > -1000, "{name}: {rest:?} is in air");
        }
    }
}

#[test]
fn displacements_follow_the_handle_and_fixed_vertices_stay() {
    let (center, radius) = HANDLE_MM;
    for name in ["skin.vtu", "tissue.vtu"] {
        let (mut dragged, mut still) = (0, 0);
        for [rest, now] in states(&mesh(finished(), name)) {
            let moved: [f64; 3] = std::array::from_fn(|axis| now[axis] - rest[axis]);
            if distance(rest, center) < radius - 0.1 {
                assert!(distance(moved, MOVE_MM) < 0.01, "{name}: {moved:?} at {rest:?}");
                dragged += 1;
            }
            if rest[1] < -30.1 {
                assert!(distance(moved, [0.0; 3]) < 1e-4, "{name}: {moved:?} at {rest:?}");
                still += 1;
            }
        }
        assert!(dragged >= 10 && still > 100, "{name}: {dragged} and {still}");
    }
}

/// A vertex has the HU of the CT where the CT is constant within one lattice step.
#[test]
fn vertices_have_the_hu_of_their_place_at_rest() {
    for name in ["skin.vtu", "tissue.vtu"] {
        let mesh = mesh(finished(), name);
        let (mut plain, mut dense) = (0, [0, 0]);
        for ([rest, _], hu) in states(&mesh).iter().zip(mesh.scalars("hu")) {
            let near = (0..125).map(|n| {
                let shift = [n % 5, n / 5 % 5, n / 25].map(|step| f64::from(step - 2) * 4.0);
                hu_at(std::array::from_fn(|axis| rest[axis] + shift[axis]))
            });
            let (low, high) = near.fold((i16::MAX, i16::MIN), |(low, high), hu| (low.min(hu), high.max(hu)));
            assert!((f64::from(low)..=f64::from(high)).contains(hu), "{name}: {hu} at {rest:?}");
            plain += usize::from(low == high);
            if *hu > 120.0 {
                let marker = MARKERS_MM.iter().position(|center| distance(*center, *rest) < 18.0);
                dense[marker.unwrap_or_else(|| panic!("{name}: {hu} at {rest:?}"))] += 1;
            }
        }
        let inside = name == "tissue.vtu";
        assert_eq!([dense[0] > 0, dense[1] > 0, plain > 500], [inside; 3], "{name}: {dense:?}, {plain}");
    }
}

/// Each tetrahedron has a positive volume, and all together have the volume of the body. Skin
/// triangles face outwards.
#[test]
fn cells_are_oriented_and_fill_the_body() {
    let volume = |corners: &[[f64; 3]]| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|n| nalgebra::Vector3::from(corners[n]));
        (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
    };
    // The lattice covers at least the body less one step along each axis.
    let size = |less: f64| (0..3).map(|axis| BODY_MM[1][axis] - BODY_MM[0][axis] - less).product::<f64>();
    let plausible = size(2.0 * STEP_MM) * 0.97..size(0.0);

    let tissue = mesh(finished(), "tissue.vtu");
    let rest: Vec<[f64; 3]> = states(&tissue).iter().map(|[rest, _]| *rest).collect();
    let volumes: Vec<f64> =
        tissue.cells.iter().map(|cell| volume(&[0, 1, 2, 3].map(|n| rest[cell[n]]))).collect();
    assert!(tissue.corners == 4 && volumes.iter().all(|volume| *volume > 0.0));
    let filled: f64 = volumes.iter().sum();
    assert!(plausible.contains(&filled), "{filled} mm³ in {plausible:?}");

    let skin = mesh(finished(), "skin.vtu");
    let rest: Vec<[f64; 3]> = states(&skin).iter().map(|[rest, _]| *rest).collect();
    let inside = [-20.0, 0.0, 0.0];
    let cone = |cell: &Vec<usize>| volume(&[inside, rest[cell[0]], rest[cell[1]], rest[cell[2]]]);
    let enclosed: f64 = skin.cells.iter().map(cone).sum();
    assert!(skin.corners == 3 && plausible.contains(&enclosed), "{enclosed} mm³ in {plausible:?}");
}

#[test]
fn counts_and_the_largest_displacement_match_the_report() {
    let run = finished();
    let [skin, tissue] = ["skin.vtu", "tissue.vtu"].map(|name| mesh(run, name));
    assert_eq!(run.number("/sizes/skin_triangles"), skin.cells.len() as f64);
    assert_eq!(run.number("/sizes/tets"), tissue.cells.len() as f64);
    let used = run.number("/sizes/vertices") - run.number("/sizes/removed_vertices");
    assert!(tissue.points.len() as f64 <= used && tissue.points.len() as f64 > 0.98 * used);
    let largest = states(&tissue).iter().map(|[rest, now]| distance(*rest, *now)).fold(0.0, f64::max);
    let reported = run.number("/max_displacement_mm");
    assert!((reported - largest).abs() < 1e-3, "{reported} mm, and {largest} mm in tissue.vtu");
    assert!(largest > distance(MOVE_MM, [0.0; 3]) - 0.01);
}

/// Opening of the first wound in its middle, measured on the points of `skin.vtu`: the skin
/// vertices next to it on either side, on the anterior face.
#[test]
fn the_reported_opening_matches_the_skin() {
    let run = finished();
    let states = states(&mesh(run, "skin.vtu"));
    let front = states.iter().map(|[rest, _]| rest[1]).fold(f64::MIN, f64::max);
    let lip = |is_right: bool| {
        let side = |rest: &[f64; 3]| {
            (rest[0] > 20.0) == is_right && rest[1] > front - 0.1 && (rest[2] - 20.0).abs() < STEP_MM
        };
        let near: Vec<_> = states.iter().filter(|[rest, _]| side(rest)).collect();
        let least = near.iter().map(|[rest, _]| (rest[0] - 20.0).abs()).fold(f64::MAX, f64::min);
        let lip: Vec<_> = near.iter().filter(|[rest, _]| (rest[0] - 20.0).abs() < least + 0.1).collect();
        [0, 1].map(|state| lip.iter().map(|states| states[state][0]).sum::<f64>() / lip.len() as f64)
    };
    let (left, right) = (lip(false), lip(true));
    let [initial, last] = [0, 1].map(|state| right[state] - left[state]);
    let [reported_initial, reported_last] =
        [run.number("/wound/initial_mid_mm"), run.number("/wound/mid_mm")];
    assert!((reported_initial - initial).abs() < 0.05, "{reported_initial} mm, not {initial}");
    assert!((reported_last - last).abs() < 0.5, "{reported_last} mm, not {last}");
    assert!(last > initial + 1.0, "the wound opens: {initial} to {last} mm");
}
