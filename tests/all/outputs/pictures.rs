//! The pictures of a run: their orientation, their scale, and the state that they show.

use base64::Engine;

use super::body::{HU, MARKERS_MM, MOVE_MM, NOTCH_MM, finished};
use super::image::Picture;

/// Gray of tissue of 40 HU in slices.
const TISSUE: u8 = 179;
/// Background of the surface pictures.
const BACKGROUND: [u8; 3] = [24, 26, 32];
/// Colors of the skin's line in slices: at rest, deformed.
const LINES: [[u8; 3]; 2] = [[90, 160, 255], [255, 170, 60]];

fn picture(name: &str) -> Picture {
    Picture::of_bytes(&finished().files[name])
}

/// The slices before and after: the two halves of `slice.png`, without their captions.
fn slices() -> [Picture; 2] {
    let both = picture("slice.png");
    let (w, h) = (both.width, both.height);
    let paper: Vec<usize> = (0..w).filter(|&x| (0..h).all(|y| both.pixel(x, y) == [245; 3])).collect();
    let (first, last) = (paper[0], paper[paper.len() - 1]);
    assert!(last - first < 20 && first.abs_diff(w - last - 1) < 2, "one gap in the middle: {paper:?}");
    [0..first, last + 1..w].map(|columns| {
        let top = (0..h).find(|&y| both.pixel(columns.start, y) != both.pixel(columns.start, 0)).unwrap();
        both.part(columns, top..h)
    })
}

/// Column at which the body begins, in the median row of some rows.
fn left_edge(picture: &Picture, rows: [f64; 2]) -> f64 {
    let [from, to] = rows.map(|part| (part * picture.height as f64) as usize);
    let is_body = |[r, g, b]: [u8; 3]| {
        [r, g, b].iter().zip(BACKGROUND).any(|(found, background)| found.abs_diff(background) > 20)
    };
    let edge = |y: usize| (0..picture.width).find(|&x| is_body(picture.pixel(x, y))).unwrap();
    let mut edges: Vec<usize> = (from..to).map(edge).collect();
    edges.sort_unstable();
    edges[edges.len() / 2] as f64
}

/// Rows of the surface pictures: through the notch, and below the letters.
const NOTCH_ROWS: [f64; 2] = [0.12, 0.18];
const EDGE_ROWS: [f64; 2] = [0.56, 0.62];

/// Beyond the right edge and the top of the body there is background in the picture; on the left
/// and below there is none.
#[test]
fn letters_name_the_sides_of_the_body() {
    for name in ["before.png", "after.png"] {
        let picture = picture(name);
        let background = |x: usize, y: usize| picture.pixel(x, y) == BACKGROUND;
        let (w, h) = (picture.width, picture.height);
        let share = |[columns, rows]: [std::ops::Range<usize>; 2]| {
            let part = picture.part(columns, rows);
            part.find(|pixel| pixel == BACKGROUND).len() as f64 / (part.width * part.height) as f64
        };
        assert!(share([0..w / 20, h / 8..h / 3]) > 0.9 && background(1, h / 3), "{name}: right side");
        assert!(share([w / 8..w / 3, 0..h / 20]) > 0.9, "{name}: top");
        assert!(share([w - w / 20..w, h / 8..h / 3]) < 0.1, "{name}: left side");
        assert!(share([w / 2..w - w / 8, h - h / 20..h]) < 0.3, "{name}: bottom");
        assert_eq!(picture.letters(), ['R', 'L', 'S', 'I'], "{name}");
    }
}

/// The notch begins 28 mm from the right edge of the body.
#[test]
fn the_scale_bar_has_the_length_of_its_label() {
    let before = picture("before.png");
    let pixels = left_edge(&before, NOTCH_ROWS) - left_edge(&before, EDGE_ROWS);
    let expected = pixels / (super::body::BODY_MM[1][0] - NOTCH_MM[0]);
    assert!(expected > 1.0, "{pixels} pixels");
    for name in ["before.png", "after.png"] {
        let found = picture(name).scale_bar();
        assert!((found / expected - 1.0).abs() < 0.04, "{name}: {found} pixels per mm, not {expected}");
    }
}

/// The handle moves the right edge of the body; the notch and the scale stay.
#[test]
fn before_and_after_show_their_own_state() {
    let [before, after] = ["before.png", "after.png"].map(picture);
    let moved = (left_edge(&before, EDGE_ROWS) - left_edge(&after, EDGE_ROWS)) / before.scale_bar();
    // Voxels are 4 mm wide, and the handle does not reach the edge everywhere.
    assert!((moved - MOVE_MM[0]).abs() < 3.0, "the edge moved by {moved} mm");
    let stayed = (left_edge(&before, NOTCH_ROWS) - left_edge(&after, NOTCH_ROWS)) / before.scale_bar();
    assert!(stayed.abs() < 7.0, "the notch moved by {stayed} mm");
    // At rest the edge is 38 mm to the right of the wound, which is in the middle of the picture.
    let middle = before.width as f64 / 2.0;
    let from_wound = (middle - left_edge(&before, EDGE_ROWS)) / before.scale_bar();
    assert!((from_wound - 38.0).abs() < 4.0, "the edge is {from_wound} mm from the wound");
}

/// Centers of the markers in a slice, the left one in the picture first.
fn markers(slice: &Picture) -> [[f64; 2]; 2] {
    // Window 400, level 40, from the gray 0.4 on.
    let gray = ((0.4 + 0.6 * (f64::from(HU[1]) + 160.0) / 400.0) * 255.0).round() as u8;
    let pixels = slice.find(|[r, g, b]| r == g && g == b && r.abs_diff(gray) < 3);
    let middle = slice.width / 2;
    let center = |of: &[&[usize; 2]]| {
        assert!(of.len() > 500, "{} pixels of a marker", of.len());
        [0, 1].map(|axis| of.iter().map(|pixel| pixel[axis] as f64).sum::<f64>() / of.len() as f64)
    };
    let (left, right): (Vec<_>, Vec<_>) = pixels.iter().partition(|pixel| pixel[0] < middle);
    [center(&left), center(&right)]
}

#[test]
fn slices_show_their_markers_where_the_letters_and_the_scale_bar_say() {
    let [before, after] = slices();
    let found = [&before, &after].map(markers);
    for (slice, state) in [(&before, "before"), (&after, "after")] {
        assert_eq!(slice.letters(), ['R', 'L', 'A', 'P'], "{state}");
        let (w, h) = (slice.width, slice.height);
        // Anterior of the skin there is air.
        let black = slice.part(w / 8..7 * w / 8, h / 8..h / 3).find(|pixel| pixel == [0; 3]).len();
        assert!(black > w * h / 10, "{state}: air is at the top");
    }
    // The right marker moves with the handle. The left one moves less.
    let per_mm = before.scale_bar();
    assert!((per_mm - after.scale_bar()).abs() < 1e-9);
    let apart_mm = (found[0][1][0] - found[0][0][0]) / per_mm;
    let expected = MARKERS_MM[0][0] - MARKERS_MM[1][0];
    assert!((apart_mm / expected - 1.0).abs() < 0.04, "markers are {apart_mm} mm apart, not {expected}");
    let moved = [0, 1].map(|axis| (found[0][0][axis] - found[1][0][axis]) / per_mm);
    assert!((moved[0] - MOVE_MM[0]).abs() < 1.0 && (moved[1] - MOVE_MM[1]).abs() < 1.0, "{moved:?}");
    let moved = (found[0][1][0] - found[1][1][0]) / per_mm;
    assert!(moved.abs() < 0.75 * MOVE_MM[0], "the left marker moved by {moved} mm");
}

/// 40 HU is the level, so that tissue has the middle of the grays from 0.4 to 1; air is black.
#[test]
fn slices_have_the_window_of_soft_tissue() {
    for slice in slices() {
        let gray = |value: u8| slice.find(|pixel| pixel == [value; 3]).len();
        let pixels = slice.width * slice.height;
        assert!(gray(TISSUE) > pixels / 5 && gray(0) > pixels / 5, "{} and {}", gray(TISSUE), gray(0));
    }
}

#[test]
fn captions_stand_over_their_slices() {
    let both = picture("slice.png");
    let place = |text: &str| {
        let band = both.part(0..both.width, 0..both.height / 10);
        let found = band.texts(text);
        assert_eq!(found.len(), 1, "{text}");
        found[0][0] / both.width as f64
    };
    assert!((place("before") - 0.25).abs() < 0.05 && (place("after") - 0.75).abs() < 0.05);
}

/// The blue line is the skin at rest, in both slices; the orange one the deformed skin.
#[test]
fn lines_follow_the_skin_of_their_state() {
    let [before, after] = slices();
    let per_mm = before.scale_bar();
    let near = |color: [u8; 3]| {
        move |pixel: [u8; 3]| pixel.iter().zip(color).all(|(found, wanted)| found.abs_diff(wanted) < 12)
    };
    let first = |slice: &Picture, color: [u8; 3]| {
        let pixels = slice.find(near(color));
        pixels.iter().map(|pixel| pixel[0]).min().map(|x| x as f64)
    };
    // The edges of the letter on the left and of the scale bar's label have grays too.
    let is_letter = |slice: &Picture, [x, y]: [usize; 2]| {
        let middle = 9 * slice.height / 20..11 * slice.height / 20;
        (x < slice.width / 20 && middle.contains(&y)) || y > 7 * slice.height / 8
    };
    let tissue = |slice: &Picture| {
        let pixels = slice.find(|pixel| pixel == [TISSUE; 3]);
        pixels.into_iter().filter(|&at| !is_letter(slice, at)).map(|[x, _]| x).min().unwrap()
    };
    assert_eq!(first(&before, LINES[1]), None, "no deformed skin in the slice before");
    let rest = first(&before, LINES[0]).unwrap();
    assert_eq!(first(&after, LINES[0]), Some(rest), "the skin at rest is the same in both");
    let deformed = first(&after, LINES[1]).unwrap();
    assert!(((rest - deformed) / per_mm - MOVE_MM[0]).abs() < 1.0, "{rest} and {deformed}");
    // The skin of the lattice and the edge of the voxels differ by less than a voxel.
    for (line, slice) in [(rest, &before), (deformed, &after)] {
        let inside_mm = (line - tissue(slice) as f64) / per_mm;
        assert!((-4.0..4.0).contains(&inside_mm), "the line is {inside_mm} mm inside");
    }
}

/// The colors of tissue appear only in the wound, in both pictures.
#[test]
fn only_the_wound_has_the_color_of_flesh() {
    for name in ["before.png", "after.png"] {
        let picture = picture(name);
        let (w, h) = (picture.width, picture.height);
        let is_flesh = |[r, g, b]: [u8; 3]| r > 60 && f64::from(r) > 2.5 * f64::from(g.max(b));
        let flesh =
            |columns: std::ops::Range<usize>| picture.part(columns, h / 4..3 * h / 4).find(is_flesh).len();
        let (wound, around) =
            (flesh(3 * w / 8..5 * w / 8), flesh(w / 5..3 * w / 8) + flesh(5 * w / 8..7 * w / 8));
        assert!(wound > w * h / 50 && around < wound / 20, "{name}: {wound} and {around} pixels");
    }
}

/// The page holds the same pictures as the folder, each above its own caption.
#[test]
fn the_page_shows_the_pictures_of_the_folder() {
    let html = finished().text("report.html");
    let pictures = html.split("<h2>Pictures</h2>").nth(1).unwrap().split("</div>").next().unwrap();
    let figures: Vec<&str> = pictures.split("<figure class=").skip(1).collect();
    let expected = [("Before", "before.png"), ("After", "after.png"), ("Slice", "slice.png")];
    assert_eq!(figures.len(), expected.len());
    for (figure, (caption, name)) in figures.iter().zip(expected) {
        let data = figure.split("base64,").nth(1).unwrap().split('"').next().unwrap();
        let bytes = base64::engine::general_purpose::STANDARD.decode(data).unwrap();
        assert!(bytes == finished().files[name], "{caption}");
        assert!(figure.contains(&format!("<figcaption>{caption}")), "{name}");
    }
    assert!(figures[2].contains("at rest (blue) and deformed (orange)"));
}
