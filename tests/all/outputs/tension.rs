//! The field of skin tension of `constraints.membrane`: in `skin.vtu`, in `tension.png`, and in the
//! reports.

use super::body::{self, BODY_MM, Finished, STEP_MM};
use super::image::Picture;
use super::vtu::Vtu;
use crate::scenes::{Run, SMALL, scene};

/// Constraints with a membrane.
fn membrane(section: &str) -> String {
    format!(
        "{{ distance = {{ youngs_modulus_pa = 5e3 }}, volume = {{ bulk_modulus_pa = 5e4 }}, membrane = {section} }}"
    )
}

/// The preset of the trunk: 15 and 5 N/m, around the body.
const TRUNK: &str = "{ preset = 'trunk' }";
/// The same values along the body.
const ALONG: &str = "{ preset = 'trunk', directions = { along = [0, 0, 1] } }";

/// Arrays of a skin without a membrane, and those that a membrane adds.
const PLAIN: [&str; 2] = ["displacement_mm", "hu"];
const FIELD: [&str; 5] = [
    "scan_line_direction",
    "scan_line_weight",
    "scan_normal",
    "scan_tension_across_n_per_m",
    "scan_tension_along_n_per_m",
];

const SURFACE: (&str, &str) = ("output", "{ surface = true }");

/// The small phantom with a membrane. It writes the skin only.
fn phantom(section: &str, set: &[(&str, &str)]) -> Run {
    let constraints = membrane(section);
    let own = [("constraints", constraints.as_str()), ("run.frames", "1"), SURFACE];
    Run::of(&scene(SMALL, &[&own, set].concat()))
}

fn skin(run: &Run) -> Vtu {
    Vtu::of_bytes(&run.bytes("skin.vtu"))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Share of the triangles with a full weight whose line is perpendicular to the axis of the body.
fn share_around(mesh: &Vtu) -> f64 {
    let lines = mesh.cell_vectors("scan_line_direction");
    let full: Vec<_> =
        lines.iter().zip(mesh.cell_scalars("scan_line_weight")).filter(|(_, w)| **w == 1.0).collect();
    assert!(full.len() > lines.len() / 2, "{} of {} triangles", full.len(), lines.len());
    full.iter().filter(|(line, _)| line[2].abs() < 1e-6).count() as f64 / full.len() as f64
}

/// Lines are unit vectors in the skin. Around the body they are perpendicular to its axis. The
/// control runs along the body.
#[test]
fn lines_of_the_phantom_are_in_the_skin_and_around_the_body() {
    let [around, along] = [TRUNK, ALONG].map(|section| skin(&phantom(section, &[])));
    for mesh in [&around, &along] {
        let (lines, normals) = (mesh.cell_vectors("scan_line_direction"), mesh.cell_vectors("scan_normal"));
        for (line, normal) in lines.into_iter().zip(normals) {
            assert!((dot(line, line) - 1.0).abs() < 1e-6 && (dot(normal, normal) - 1.0).abs() < 1e-6);
            assert!(dot(line, normal).abs() < 1e-6, "{line:?} {normal:?}");
        }
    }
    assert_eq!((share_around(&around), share_around(&along)), (1.0, 0.0));
}

/// Triangles of the block at rest: middle in RAS mm, and number of the cell.
fn middles(mesh: &Vtu) -> Vec<[f64; 3]> {
    let moved = mesh.vectors("displacement_mm");
    let middle = |cell: &Vec<usize>| {
        let lps: [f64; 3] = std::array::from_fn(|axis| {
            cell.iter().map(|&n| mesh.points[n][axis] - moved[n][axis]).sum::<f64>() / 3.0
        });
        [-lps[0], -lps[1], lps[2]]
    };
    mesh.cells.iter().map(middle).collect()
}

/// The block has plane sides with known normals. On the sides the lines run around it; at the top
/// and the bottom there is no direction, and the tension is the mean.
#[test]
fn sides_of_the_block_have_their_normals_lines_and_tension() {
    let constraints = membrane(TRUNK);
    let run = body::run(&[("constraints", &constraints), ("run.frames", "3"), ("solver.substeps", "2")]);
    let mesh = Vtu::of_bytes(&run.files["skin.vtu"]);
    assert_eq!(mesh.space, "LPS");
    let middles = middles(&mesh);
    let (lines, normals) = (mesh.cell_vectors("scan_line_direction"), mesh.cell_vectors("scan_normal"));
    let weights = mesh.cell_scalars("scan_line_weight");
    let [along, across] = ["scan_tension_along_n_per_m", "scan_tension_across_n_per_m"]
        .map(|name| mesh.cell_scalars(name).to_vec());
    let mut seen = [[0; 2]; 3];
    for (n, middle) in middles.iter().enumerate() {
        // Far from all edges and from the notch.
        let from = |side: usize, axis: usize| (middle[axis] - BODY_MM[side][axis]).abs();
        let near = |axis: usize| (0..2).find(|&side| from(side, axis) < STEP_MM);
        let far = |axis: usize| (0..2).all(|side| from(side, axis) > 4.5 * STEP_MM);
        let Some((axis, side)) = (0..3).find_map(|axis| Some((axis, near(axis)?))) else { continue };
        let notch = middle[0] > -6.0 && middle[2] > 18.0;
        if notch || (0..3).any(|other| other != axis && !far(other)) {
            continue;
        }
        seen[axis][side] += 1;
        // RAS to LPS.
        let mut expected = [0.0; 3];
        expected[axis] = [-1.0, 1.0][side] * [-1.0, -1.0, 1.0][axis];
        assert!(dot(normals[n], expected) > 0.99, "{middle:?}: {:?}", normals[n]);
        if axis == 2 {
            assert_eq!((weights[n], along[n], across[n]), (0.0, 10.0, 10.0), "{middle:?}");
        } else {
            assert!(lines[n][1 - axis].abs() > 0.99, "{middle:?}: {:?}", lines[n]);
            assert_eq!((weights[n], along[n], across[n]), (1.0, 15.0, 5.0), "{middle:?}");
        }
    }
    assert!(seen.iter().flatten().all(|&count| count > 20), "{seen:?}");
}

/// The skin outside a region of interest has the field of the whole body.
#[test]
fn a_region_has_the_field_of_the_whole_body() {
    let region = ("lattice.region", "{ around_mm = 30.0 }");
    let [part, whole] = [&[region][..], &[]].map(|set| skin(&phantom(TRUNK, set)));
    let field = |mesh: &Vtu| -> std::collections::BTreeMap<[i64; 3], Vec<f64>> {
        let (lines, normals) = (mesh.cell_vectors("scan_line_direction"), mesh.cell_vectors("scan_normal"));
        let weights = mesh.cell_scalars("scan_line_weight").to_vec();
        let place = |at: &[f64; 3]| at.map(|c| (c * 100.0).round() as i64);
        let values = lines.into_iter().zip(normals).zip(weights);
        let values = values.map(|((line, normal), weight)| [&line[..], &normal, &[weight]].concat());
        middles(mesh).iter().map(place).zip(values).collect()
    };
    let (part, whole) = (field(&part), field(&whole));
    assert!(part.len() > 1000 && part.len() == whole.len(), "{} and {}", part.len(), whole.len());
    let same = part.iter().filter(|(place, values)| whole.get(*place) == Some(values)).count();
    assert!(same as f64 > 0.98 * part.len() as f64, "{same} of {}", part.len());
}

/// A scene without a membrane writes no values of cells; PBD knows no tension in N/m; isotropic
/// skin has a field without weight.
#[test]
fn arrays_follow_from_the_scene() {
    let plain = Run::of(&scene(SMALL, &[("run.frames", "1"), SURFACE]));
    assert_eq!(skin(&plain).names(), PLAIN);
    assert!(!String::from_utf8_lossy(&plain.bytes("skin.vtu")).contains("CellData"));
    let all: Vec<&str> = PLAIN.into_iter().chain(FIELD).collect();
    assert_eq!(skin(&phantom(TRUNK, &[])).names(), all);
    let pbd = phantom(TRUNK, &[("solver.formulation", "pbd"), ("constraints.membrane.stiffness", "0.1")]);
    assert_eq!(skin(&pbd).names(), all[..5]);
    let even = "{ tension_along_n_per_m = 8, tension_across_n_per_m = 8, modulus_along_n_per_m = 50, \
                modulus_across_n_per_m = 50 }";
    let isotropic = phantom(even, &[("output", "{ surface = true, pictures = true }")]);
    let mesh = skin(&isotropic);
    assert!(mesh.cell_scalars("scan_line_weight").iter().all(|weight| *weight == 0.0));
    assert!(!isotropic.names().contains(&"tension.png".to_owned()), "there are no lines to draw");
    assert_eq!(isotropic.report.membrane.unwrap().coverage, None);
}

/// Coverage is the share of the area with a weight above one half, and every triangle has tension,
/// both measured on `skin.vtu`.
#[test]
fn reports_say_where_the_skin_has_a_direction() {
    let constraints = membrane(TRUNK);
    let run = body::run(&[("constraints", &constraints), ("incision", "[]"), ("run.frames", "1")]);
    let mesh = Vtu::of_bytes(&run.files["skin.vtu"]);
    let moved = mesh.vectors("displacement_mm");
    let normals = mesh.cell_vectors("scan_normal");
    let weights = mesh.cell_scalars("scan_line_weight");
    let (mut covered, mut total) = (0.0, 0.0);
    for ((cell, normal), weight) in mesh.cells.iter().zip(normals).zip(weights) {
        let at = |n: usize| {
            nalgebra::Vector3::from_fn(|axis, _| mesh.points[cell[n]][axis] - moved[cell[n]][axis])
        };
        let area = (at(1) - at(0)).cross(&(at(2) - at(0))).dot(&nalgebra::Vector3::from(normal)).abs();
        total += area;
        covered += if *weight > 0.5 { area } else { 0.0 };
    }
    let coverage = run.number("/membrane/coverage");
    assert!((coverage - covered / total).abs() < 1e-4, "{coverage}, not {}", covered / total);
    // The four sides of the body of 148 × 88 × 160 mm are 74 % of its skin. Top and bottom have a
    // direction only near their edges, which are rounded by the blur of two lattice steps.
    assert!((0.74..0.95).contains(&coverage), "{coverage}");
    assert_eq!(run.number("/membrane/triangles"), mesh.cells.len() as f64);
    assert!(mesh.cell_scalars("scan_tension_along_n_per_m").iter().all(|tension| *tension >= 5.0));
    assert_eq!(run.number("/tension/membrane/along_n_per_m"), 15.0);
    let html = run.text("report.html");
    for words in [
        "Tension, membrane: 15.0 N/m along the lines, 5.0 N/m across them (preset &quot;trunk&quot;"
            .to_owned(),
        format!("Lines of tension: a direction on {:.1} % of the skin", 100.0 * coverage),
    ] {
        assert!(html.contains(&words), "no {words:?}");
    }
    let plain = body::finished();
    assert!(
        plain.report.get("membrane").is_none() && !plain.text("report.html").contains("Lines of tension")
    );
    assert_eq!(plain.report["tension"].as_object().unwrap().len(), 1, "the area form has a tension too");
}

/// The block with a membrane, drawn.
fn drawn(section: &str) -> Finished {
    let constraints = membrane(section);
    let output = ("output", "{ pictures = true, report = true }");
    body::run(&[("constraints", &constraints), ("run.frames", "1"), ("solver.substeps", "2"), output])
}

/// Pixels at which `tension.png` differs from `before.png`, without the legend at the bottom right.
fn line_pixels(run: &Finished) -> (Picture, Vec<[usize; 2]>) {
    let [tension, before] = ["tension.png", "before.png"].map(|name| Picture::of_bytes(&run.files[name]));
    assert_eq!((tension.width, tension.height), (before.width, before.height));
    let (w, h) = (tension.width, tension.height);
    let all = (0..h).flat_map(|y| (0..w).map(move |x| [x, y]));
    let drawn =
        all.filter(|&[x, y]| (x < w / 2 || y < h - h / 20) && tension.pixel(x, y) != before.pixel(x, y));
    let pixels = drawn.collect();
    (before, pixels)
}

/// Mean length of the runs of pixels along the rows.
fn mean_run(pixels: &[[usize; 2]], along: usize) -> f64 {
    let mut sorted: Vec<[usize; 2]> = pixels.iter().map(|at| [at[1 - along], at[along]]).collect();
    sorted.sort_unstable();
    let ends = sorted.windows(2).filter(|pair| pair[0][0] != pair[1][0] || pair[0][1] + 1 != pair[1][1]);
    sorted.len() as f64 / (ends.count() + 1) as f64
}

/// The lines cross the picture around the body, and along it in the control. They are on the skin
/// only: not in the wound, and not next to the body.
#[test]
fn the_picture_shows_lines_on_the_skin() {
    for (section, along) in [(TRUNK, 0), (ALONG, 1)] {
        let run = drawn(section);
        let (before, pixels) = line_pixels(&run);
        let (w, h) = (before.width, before.height);
        assert!((w * h / 40..w * h / 4).contains(&pixels.len()), "{} pixels", pixels.len());
        let [wide, high] = [along, 1 - along].map(|axis| mean_run(&pixels, axis));
        assert!(wide > 20.0 * high && high < 5.0, "{section}: {wide} along, {high} across");
        let is_flesh = |[r, g, b]: [u8; 3]| r > 60 && f64::from(r) > 2.5 * f64::from(g.max(b));
        let under = |accepts: &dyn Fn([u8; 3]) -> bool| {
            pixels.iter().filter(|[x, y]| accepts(before.pixel(*x, *y))).count()
        };
        // The end of a line is round and may touch the edge of the wound.
        let (flesh, background) = (under(&is_flesh), under(&|pixel| pixel == [24, 26, 32]));
        assert!(
            200 * flesh < pixels.len() && background == 0,
            "{flesh} and {background} of {}",
            pixels.len()
        );
        let picture = Picture::of_bytes(&run.files["tension.png"]);
        assert_eq!(picture.letters(), before.letters());
        assert_eq!(picture.scale_bar(), before.scale_bar());
        let html = run.text("report.html");
        let pictures = html.split("<h2>Pictures</h2>").nth(1).unwrap().split("</div>").next().unwrap();
        assert_eq!(pictures.matches("<figure class=").count(), 4);
        assert!(html.contains("<figcaption>Lines of tension in the scan"));
    }
    assert!(!body::finished().files.contains_key("tension.png"));
}
