//! The view in `report.html`: the surface that it holds, read from the bytes, is that of
//! `skin.vtu`, and its states have the values of `frames.csv`.

use base64::Engine;
use serde_json::Value;

use super::body::{FRAMES, Finished, finished, run};
use super::frames::column;
use crate::scenes::{Run, SMALL, run_in, scene};

/// The view of a page.
struct View {
    data: Value,
    /// World mm, RAS+.
    rest: Vec<[f64; 3]>,
    triangles: Vec<[usize; 3]>,
    on_skin: Vec<bool>,
    /// Displacements in mm in each state but the first.
    moved: Vec<Vec<[f64; 3]>>,
}

/// The text of an element with an id.
fn element<'a>(html: &'a str, id: &str) -> Option<&'a str> {
    html.split(&format!("id=\"{id}\">")).nth(1)?.split("</script>").next()
}

impl View {
    fn of(html: &str) -> Option<Self> {
        let data: Value = serde_json::from_str(element(html, "data")?).unwrap();
        let bytes = base64::engine::general_purpose::STANDARD.decode(element(html, "surface")?).unwrap();
        let about = &data["surface"];
        let number = |key: &str| about[key].as_u64().unwrap() as usize;
        let (points, moving, triangles) = (number("points"), number("moving"), number("triangles"));
        let mut rest_of_bytes = bytes.as_slice();
        let mut block = |length: usize| {
            let (own, others) = rest_of_bytes.split_at(length.next_multiple_of(4));
            rest_of_bytes = others;
            &own[..length]
        };
        let words = |block: &[u8]| -> Vec<u16> {
            block.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
        };
        let corners = words(block(6 * triangles));
        let places = words(block(6 * points));
        let tissue = block(4 * points);
        let step = about["step_mm"].as_f64().unwrap();
        let moved_step = about["moved_step_mm"].as_f64().unwrap();
        let low = [0, 1, 2].map(|axis| about["low_mm"][axis].as_f64().unwrap());
        let place = |at: &[u16]| [0, 1, 2].map(|axis| low[axis] + step * f64::from(at[axis]));
        let state = |block: &[u8]| -> Vec<[f64; 3]> {
            let mut moved: Vec<[f64; 3]> = words(block)
                .chunks_exact(3)
                .map(|at| [at[0], at[1], at[2]].map(|c| f64::from(c.cast_signed()) * moved_step))
                .collect();
            moved.resize(points, [0.0; 3]);
            moved
        };
        let view = Self {
            rest: places.chunks_exact(3).map(place).collect(),
            triangles: corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]].map(usize::from)).collect(),
            on_skin: tissue.chunks_exact(4).map(|color| color[3] == 255).collect(),
            moved: (1..number("states")).map(|_| state(block(6 * moving))).collect(),
            data,
        };
        assert!(rest_of_bytes.is_empty(), "{} bytes too many", rest_of_bytes.len());
        Some(view)
    }

    fn states(&self) -> &Vec<Value> {
        self.data["states"].as_array().unwrap()
    }
}

fn view(run: &Finished) -> View {
    View::of(run.text("report.html")).unwrap()
}

/// Each point on the skin of the view lies in the scan and at the end where the skin file has one,
/// and the other way round. Control: the state before the last frame is elsewhere.
#[test]
fn the_surface_is_that_of_the_skin_file() {
    let view = view(finished());
    let mesh = super::vtu::Vtu::of_bytes(&finished().files["skin.vtu"]);
    let displacement = mesh.vectors("displacement_mm");
    assert!(view.rest.len() > 1000 && view.states().len() == FRAMES + 1);
    let tolerance = 1.01 * (0.5 * view.data["surface"]["step_mm"].as_f64().unwrap() + 1e-3);
    let mut used = vec![false; mesh.points.len()];
    mesh.cells.iter().flatten().for_each(|&v| used[v] = true);
    // The file has LPS.
    let ras = |[x, y, z]: [f64; 3]| [-x, -y, z];
    let of_file: Vec<([f64; 3], [f64; 3])> = (0..mesh.points.len())
        .filter(|&n| used[n])
        .map(|n| {
            let (at, by) = (ras(mesh.points[n]), ras(displacement[n]));
            ([0, 1, 2].map(|axis| at[axis] - by[axis]), at)
        })
        .collect();
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|axis| (a[axis] - b[axis]).abs() < tolerance);
    let unlike = |state: &[[f64; 3]]| {
        let skin: Vec<([f64; 3], [f64; 3])> = (0..view.rest.len())
            .filter(|&n| view.on_skin[n])
            .map(|n| (view.rest[n], [0, 1, 2].map(|axis| view.rest[n][axis] + state[n][axis])))
            .collect();
        let missing = |these: &[([f64; 3], [f64; 3])], those: &[([f64; 3], [f64; 3])]| {
            let found =
                |one: &&([f64; 3], [f64; 3])| those.iter().any(|o| near(o.0, one.0) && near(o.1, one.1));
            these.len() - these.iter().filter(found).count()
        };
        missing(&skin, &of_file) + missing(&of_file, &skin)
    };
    assert_eq!(unlike(&view.moved[FRAMES - 1]), 0);
    assert!(unlike(&view.moved[FRAMES / 2]) > 100);
}

/// The walls of the wounds close the holes that the incisions leave in the skin. Where a triangle
/// of the skin stayed that has lost its tetrahedron, some edges are open. Controls: the skin
/// without walls has many more, and a body without cuts has no walls.
#[test]
fn wounds_have_walls() {
    let view = view(finished());
    let in_wounds = view.on_skin.iter().filter(|on_skin| !**on_skin).count();
    assert!(in_wounds > 50, "{in_wounds} points");
    let uncut =
        run(&[("incision", "[]"), ("run.frames", "1"), ("output", "{ surface = true, report = true }")]);
    let uncut = self::view(&uncut);
    assert!(uncut.on_skin.iter().all(|on_skin| *on_skin) && !uncut.triangles.is_empty());
    // Edges by the places of their ends, because a lip is an edge of the skin and of a wall.
    let open = |view: &View, with_walls: bool| {
        let place = |v: usize| view.rest[v].map(|c| (c * 100.0).round() as i64);
        let mut edges = std::collections::BTreeMap::new();
        let on_skin = |corners: &&[usize; 3]| with_walls || corners.iter().all(|&v| view.on_skin[v]);
        for [a, b, c] in view.triangles.iter().filter(on_skin) {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let (from, to) = (place(*from), place(*to));
                let sign = if from < to { 1 } else { -1 };
                *edges.entry((from.min(to), from.max(to))).or_insert(0) += sign;
            }
        }
        edges.values().filter(|count| **count != 0).count()
    };
    let [without, with] = [false, true].map(|with_walls| open(&view, with_walls));
    assert!(without > 50 && with <= without / 5, "{with} open edges, {without} without walls");
    assert_eq!(open(&uncut, true), 0);
}

/// States have the times and openings of `frames.csv`.
#[test]
fn states_have_the_values_of_their_frames() {
    let view = view(finished());
    let names: Vec<&str> =
        view.data["quantities"].as_array().unwrap().iter().map(|q| q["name"].as_str().unwrap()).collect();
    assert_eq!(names[..3], ["wound 1 mean", "wound 1 in the middle", "wound 2 mean"]);
    let column = |name: &str| column(finished(), name);
    let (times, openings) = (column("time_s"), column("gape_1_mean_mm"));
    for (frame, state) in view.states().iter().enumerate() {
        assert_eq!(state["frame"].as_u64(), Some(frame as u64));
        assert!((state["time_s"].as_f64().unwrap() - times[frame]).abs() < 1e-9);
        assert!((state["values"][2].as_f64().unwrap() - openings[frame]).abs() < 1e-4);
    }
    let length = |by: &[f64; 3]| by.iter().map(|c| c * c).sum::<f64>().sqrt();
    let of_surface = view.moved[FRAMES - 1].iter().map(length).fold(0.0, f64::max);
    let of_body = finished().number("/max_displacement_mm");
    assert!(of_surface <= of_body + 1e-2 && of_surface > 0.5 * of_body, "{of_surface} of {of_body} mm");
    let most = view.moved.iter().flatten().map(length).fold(0.0, f64::max);
    assert!((most - view.data["surface"]["most_mm"].as_f64().unwrap()).abs() < 1e-2, "{most} mm");
}

#[test]
fn settled_runs_have_the_scan_and_each_state_of_rest() {
    let handle =
        "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 20, 5], over_s = 0.1, at_s = 0.5 }]";
    let run = Run::of(&scene(
        SMALL,
        &[
            ("run", "{ frames = 0, until = 'rest', error = 0.05 }"),
            ("lattice.spacing_mm", "14.0"),
            ("handle", handle),
            ("output", "{ report = true }"),
        ],
    ));
    let view = View::of(&String::from_utf8(run.bytes("report.html")).unwrap()).unwrap();
    let names: Vec<&str> = view.states().iter().map(|state| state["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["in the scan", "at rest", "at rest after handle[0]"]);
    assert!(view.moved[0] != view.moved[1]);
    let stops = &run.report.stops;
    assert!((view.states()[2]["values"][0].as_f64().unwrap() - stops[1].mean_mm[0]).abs() < 1e-9);
}

/// A page without a skin has no view, and one without pictures has no slices.
#[test]
fn a_page_shows_only_what_there_is() {
    let bare = [
        ("constraints", "{ distance = { youngs_modulus_pa = 5e3 } }"),
        ("incision", "[]"),
        ("run.frames", "1"),
        ("output", "{ report = true }"),
    ];
    let html = String::from_utf8(Run::of(&scene(SMALL, &bare)).bytes("report.html")).unwrap();
    assert!(View::of(&html).is_none() && !html.contains("id=\"canvas\"") && !html.contains("The CT before"));
    let html = finished().text("report.html");
    assert!(html.contains("id=\"canvas\"") && html.matches("class=\"compare\"").count() == 3);
}

/// A resumed run has the states after the checkpoint, and the page says that others are missing.
#[test]
fn a_resumed_run_says_which_states_are_missing() {
    let folder = tempfile::tempdir().unwrap();
    let with = |frames: &str| {
        let keys = [("run.frames", frames), ("run.checkpoint_every", "3"), ("output", "{ report = true }")];
        scene(SMALL, &keys)
    };
    let html = || std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    let frames = |html: &str| -> Vec<u64> {
        View::of(html).unwrap().states().iter().map(|state| state["frame"].as_u64().unwrap()).collect()
    };
    run_in(folder.path(), &with("3"), false).unwrap();
    assert_eq!(frames(&html()), [0, 1, 2, 3]);
    assert!(!html().contains("resumed from a checkpoint"));
    run_in(folder.path(), &with("5"), true).unwrap();
    assert_eq!(frames(&html()), [0, 4, 5]);
    assert!(html().contains("no state between the scan and frame 3"));
    // Nothing is left to compute, and the last state is there.
    run_in(folder.path(), &with("5"), false).unwrap();
    run_in(folder.path(), &with("5"), true).unwrap();
    assert_eq!(frames(&html()), [0, 5]);
}

/// Names of a user have no meaning in the page.
#[test]
fn hostile_names_have_no_meaning() {
    let hostile = "</script><script>alert(1)</script><!--\"'&<img src=x onerror=alert(2)>";
    let name = serde_json::to_string(hostile).unwrap();
    let incision = format!(
        "[{{ from_mm = [30.0, 110.0, -50.0], to_mm = [30.0, 110.0, 50.0], depth_mm = 20.0, width_mm = 7.0, \
         name = {name} }}]"
    );
    let keys = [("incision", incision.as_str()), ("run.frames", "1"), ("output", "{ report = true }")];
    let folder = tempfile::tempdir().unwrap();
    let loaded = scene(SMALL, &keys);
    assert_eq!(loaded.scene.incision[0].name.as_deref(), Some(hostile));
    // The name of the scene's file is the title of the page.
    let file = folder.path().join("<b>'\"&.toml");
    std::fs::write(&file, toml::to_string(&loaded.scene).unwrap()).unwrap();
    let loaded = cutis::Scene::load(&file, &[]).unwrap();
    run_in(&folder.path().join("run"), &loaded, false).unwrap();
    let html = std::fs::read_to_string(folder.path().join("run/report.html")).unwrap();
    for part in ["alert(1)</script>", "<img src=x", "<b>'", "onerror=alert(2)>"] {
        assert!(!html.contains(part), "{part}");
    }
    assert!(html.contains("<title>&lt;b&gt;&#39;&quot;&amp; - Cutis run</title>"));
    assert!(html.contains("&lt;img src=x onerror=alert(2)&gt;"), "the scene is shown");
    assert!(View::of(&html).is_some());
}

/// The page of a run holds no more than 8 MB, and loads nothing.
#[test]
fn the_page_is_small_and_complete() {
    let html = finished().text("report.html");
    assert!(html.len() < 8_000_000, "{} bytes", html.len());
    let sources = html.split(" src=\"").skip(1);
    assert!(
        sources.clone().count() > 5 && sources.into_iter().all(|s| s.starts_with("data:image/png;base64,"))
    );
    assert!(!html.contains(" href=") && !html.contains("@import") && !html.contains("url("));
    assert!(html.contains("default-src 'none'"));
}
