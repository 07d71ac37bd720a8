//! Printed summaries agree with the files, and `cutis render` draws the requested view.

use serde_json::Value;

use crate::{Desk, Done};

fn call(desk: &Desk, call: &str) -> Done {
    desk.cutis(&call.split(' ').collect::<Vec<_>>()).expect_success()
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

/// The number that precedes a word.
fn before(text: &str, word: &str) -> f64 {
    let start = text.split_once(word).unwrap_or_else(|| panic!("no {word:?} in {text}")).0;
    start.rsplit([' ', '(']).next().unwrap().parse().unwrap()
}

#[test]
fn the_summary_of_a_run_has_the_figures_of_its_report() {
    let desk = Desk::new();
    let printed = call(&desk, "run scene.toml --out run").stdout;
    let report = json(&std::fs::read(desk.path("run/report.json")).unwrap());
    for (word, key) in [
        (" vertices,", "vertices"),
        (" edges,", "edges"),
        (" tetrahedra,", "tets"),
        (" skin triangles", "skin_triangles"),
    ] {
        assert_eq!(before(&printed, word), report["sizes"][key].as_f64().unwrap(), "{key}");
    }
    let wound = printed.split_once("wound: ").unwrap().1;
    for (word, key) in [(" mm -> ", "initial_mm"), (" mm (", "final_mm"), (" mm in the middle)", "mid_mm")] {
        let expected = report["wound"][key].as_f64().unwrap();
        assert!((before(wound, word) - expected).abs() < 0.0051, "{key}: {expected}, {wound}");
    }
    assert!(report["wound"]["final_mm"].as_f64() > report["wound"]["initial_mm"].as_f64());
    let ms = before(&printed, " ms each");
    assert!((ms - report["frames"]["ms_mean"].as_f64().unwrap()).abs() < 0.051, "{printed}");
}

/// `run` and `check` print the tension of the skin and where it has a direction. Skin without a
/// membrane has no such line.
#[test]
fn the_summary_and_the_table_describe_the_lines_of_tension() {
    let desk = Desk::new();
    let membrane = "--without stc --set constraints.membrane={preset='trunk'} --set run.frames=1";
    let printed = call(&desk, &format!("run scene.toml --out run {membrane}")).stdout;
    let report = json(&std::fs::read(desk.path("run/report.json")).unwrap());
    let table = call(&desk, &format!("check scene.toml {membrane}")).stdout;
    let coverage = report["membrane"]["coverage"].as_f64().unwrap();
    let expected = format!("a direction on {:.1} % of the skin\n", 100.0 * coverage);
    for (text, line) in [(&printed, "lines of tension: "), (&table, "lines of tension ")] {
        assert!(text.contains(&format!("{line}{expected}")), "no {expected:?} in {text}");
        assert!(text.contains("membrane: 15.0 N/m along the lines, 5.0 N/m across them"), "{text}");
    }
    let plain = call(&desk, "check scene.toml").stdout;
    assert!(!plain.contains("lines of tension") && plain.contains("tension          stc: "), "{plain}");
}

#[test]
fn the_table_of_a_plan_has_the_figures_of_its_json() {
    let desk = Desk::new();
    let plan = json(call(&desk, "check scene.toml --json").stdout.as_bytes());
    let table = call(&desk, "check scene.toml").stdout;
    let sizes = &plan["sizes"];
    let line = |name: &str| {
        let line = table.lines().find(|line| line.starts_with(name));
        line.unwrap_or_else(|| panic!("no {name} in {table}"))[name.len()..].trim().to_owned()
    };
    let lattice: Vec<String> = sizes["lattice"].as_array().unwrap().iter().map(Value::to_string).collect();
    assert_eq!(line("lattice"), lattice.join(" x "));
    let vertices = format!(
        "{} ({} fixed, {} cut out)",
        sizes["vertices"], sizes["fixed_vertices"], sizes["removed_vertices"]
    );
    assert_eq!(line("vertices"), vertices);
    for (name, value) in [("tetrahedra", &sizes["tets"]), ("skin triangles", &sizes["skin_triangles"])] {
        assert_eq!(line(name), value.to_string(), "{name}");
    }
    let bytes: u64 =
        plan["memory"].as_array().unwrap().iter().map(|part| part["bytes"].as_u64().unwrap()).sum();
    let ct = 2.0 * 48.0 * 48.0 * 36.0 / 1e6;
    let memory = format!("{:.1} MB for the solver, {ct:.1} MB for the CT", bytes as f64 / 1e6);
    assert!(line("memory").starts_with(&memory), "no {memory:?} in {table}");
    // Two frames, as the scene says.
    let time = line("time");
    let number = |text: &str| text.trim().parse::<f64>().unwrap();
    let (ms, rest) = time.split_once(" ms per frame, about ").unwrap();
    let (s, rest) = rest.split_once(" s for 2 frames").unwrap();
    assert!((number(s) - 2e-3 * number(ms)).abs() < 0.051 && rest.contains(" of the body at rest"), "{time}");
}

/// The plan of a scene from the template fits a screen. It names what the scene leaves out, and
/// prints nothing of a preset that is as it should be.
#[test]
fn the_plan_of_a_new_scene_is_short() {
    let desk = Desk::new();
    call(&desk, "phantom --size 64,64,48 --seed 3 --out ct.nii.gz");
    let scene = call(&desk, "scene new ct.nii.gz").stdout;
    desk.put("new.toml", &scene);
    let printed = call(&desk, "check new.toml --set lattice.spacing_mm=8").stdout;
    assert!(printed.lines().count() <= 24, "{printed}");
    assert!(!printed.contains("note:") && !printed.contains("facets"), "{printed}");
    let named = printed.lines().find(|line| line.starts_with("left out, costs nothing: ")).unwrap();
    assert!(named.contains("suture, handle") && !named.contains("region"), "{named}");
    // Control: notes are printed.
    let near = call(&desk, "check new.toml --set lattice.spacing_mm=8 --set incision.0.to_mm.2=140").stdout;
    assert!(near.contains("note: incision[0]"), "{near}");
}

#[test]
fn inspect_prints_the_values_of_its_json() {
    let desk = Desk::new();
    call(&desk, "phantom --size 20,16,12 --seed 3 --out ct.nii.gz");
    let found = json(call(&desk, "inspect ct.nii.gz --json").stdout.as_bytes());
    let page = call(&desk, "inspect ct.nii.gz").stdout;
    for expected in [
        "shape        20 x 16 x 12".to_owned(),
        format!("orientation  {}", found["orientation"].as_str().unwrap()),
        format!(
            "HU           {} to {}",
            found["hu_min"].as_f64().unwrap(),
            found["hu_max"].as_f64().unwrap()
        ),
    ] {
        assert!(page.lines().any(|line| line == expected), "no {expected:?} in {page}");
    }
    let spacing: Vec<String> = found["spacing_mm"]
        .as_array()
        .unwrap()
        .iter()
        .map(|mm| format!("{:.4}", mm.as_f64().unwrap()))
        .collect();
    assert!(page.contains(&format!("spacing      {} mm", spacing.join(" x "))), "{page}");
}

#[test]
fn a_turned_phantom_is_cut_at_the_turned_place() {
    let desk = Desk::new();
    let place = |options: &str| call(&desk, &format!("phantom --size 20,20,12 --seed 7 {options}")).stdout;
    let upright = place("--out a.nii");
    assert!(upright.contains("from_mm = [36.0, 109.3, -85.0]"), "{upright}");
    let turned = place("--turn-deg 0 0 -90 --out b.nii");
    assert!(turned.contains("from_mm = [109.3, -36.0, -85.0]"), "{turned}");
    assert_ne!(std::fs::read(desk.path("a.nii")).unwrap(), std::fs::read(desk.path("b.nii")).unwrap());
}

/// Draws a picture and returns its pixels and its width.
fn pixels(desk: &Desk, options: &str) -> (Vec<[u8; 3]>, usize) {
    call(desk, &format!("render ct.nii --out picture.png --pixels 200 {options}"));
    let file = std::io::BufReader::new(std::fs::File::open(desk.path("picture.png")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    (data.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(), info.width as usize)
}

/// Share of gray pixels, neither black nor white.
fn gray(desk: &Desk, options: &str) -> f64 {
    let (pixels, _) = pixels(desk, options);
    let is_gray = |[r, g, b]: &&[u8; 3]| r == g && g == b && (60..200).contains(r);
    pixels.iter().filter(is_gray).count() as f64 / pixels.len() as f64
}

/// Soft tissue is gray in its own window; a narrow window far from it leaves black and white.
#[test]
fn a_slice_has_the_requested_window_and_position() {
    let desk = Desk::new();
    call(&desk, "phantom --size 48,48,36 --out ct.nii");
    let soft = gray(&desk, "--slice axial@0 --window 40/400");
    let narrow = gray(&desk, "--slice axial@0 --window 400/40");
    assert!(soft > 0.15 && narrow < 0.05, "{soft} and {narrow} of the pixels are gray");
    assert!(gray(&desk, "--slice sagittal@195") < 0.02, "next to the body there is air");
    let whole = gray(&desk, "--slice coronal@0");
    let close = gray(&desk, "--slice coronal@0 --focus 0,0,0 --zoom 60");
    assert!(close > whole + 0.1, "a close-up shows the inside: {whole} and {close}");
}

/// The torso is wider than it is deep.
#[test]
fn a_surface_is_seen_from_the_requested_side() {
    let desk = Desk::new();
    call(&desk, "phantom --size 48,48,36 --out ct.nii");
    let body = |options: &str| {
        let (pixels, width) = pixels(&desk, options);
        let row = &pixels[width * (pixels.len() / width / 3)..][..width];
        row.iter().filter(|[r, g, b]| r.abs_diff(*b) > 25 || r.abs_diff(*g) > 25).count()
    };
    let (front, side) = (body("--side anterior"), body("--side left"));
    assert!(front as f64 > 1.2 * side as f64 && side > 20, "{front} and {side} pixels across");
}
