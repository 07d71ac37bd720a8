//! `report.html`: its sentences, tables and chart agree with `report.json` and `frames.csv`.

use super::body::{DT_S, FRAMES, finished};
use super::frames::column;

/// The text between the first `from` and the next `to`.
fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let rest = text.split_once(from).unwrap_or_else(|| panic!("no {from:?}")).1;
    rest.split_once(to).unwrap_or_else(|| panic!("no {to:?} after {from:?}")).0
}

fn number(text: &str) -> f64 {
    text.trim().parse().unwrap_or_else(|e| panic!("{text:?}: {e}"))
}

fn html() -> &'static str {
    finished().text("report.html")
}

#[test]
fn the_heading_names_the_ct_and_the_scene_and_says_what_a_run_is_not() {
    let header = between(html(), "<header>", "</header>");
    assert!(header.starts_with("<h1>ct.nii.gz, scene body.toml</h1>"), "{header}");
    let run = finished();
    let seconds = number(between(header, " in ", " s. Finished"));
    let ms: f64 = run.report["stages"].as_array().unwrap().iter().map(|s| s["ms"].as_f64().unwrap()).sum();
    assert!(
        seconds * 1e3 > ms - 51.0 && (seconds * 1e3 - run.number("/total_ms")).abs() < 51.0,
        "{seconds} s"
    );
    let date = run.report["finished_at"].as_str().unwrap();
    assert!(
        header.contains(&format!("Finished at {} {} UTC.", &date[..10], &date[11..19])),
        "{header}, {date}"
    );
    assert!(header.contains("<b>This is not a medical device.</b>"), "{header}");
}

#[test]
fn the_first_paragraph_says_how_far_each_wound_opened() {
    let first = between(html(), "</header>", "</p>").strip_prefix("<p class=\"result\">").unwrap();
    let sentences: Vec<&str> = first.split(" opened from ").collect();
    assert_eq!(sentences.len(), 3);
    for (n, sentence) in sentences[1..].iter().enumerate() {
        assert!(sentences[n].ends_with(&format!("Wound {} (incision[{n}])", n + 1)), "{first}");
        let (initial, rest) = sentence.strip_prefix("<b>").unwrap().split_once(" mm</b> to <b>").unwrap();
        let (last, rest) = rest.split_once(" mm</b> (mean distance of the lips; ").unwrap();
        let mid = rest.split_once(" mm in the middle)").unwrap().0;
        for (found, key) in [(initial, "initial_mm"), (last, "final_mm"), (mid, "mid_mm")] {
            let expected = finished().number(&format!("/wounds/{n}/{key}"));
            assert!((number(found) - expected).abs() < 0.0051, "wound {n}, {key}: {found}, not {expected}");
        }
        assert!(number(last) > number(initial) + 0.5, "{sentence}");
    }
    // A run with frames says how much it still moves.
    assert!(first.contains(&format!("the state after {FRAMES} frames")), "{first}");
    let change = (0..2).map(|wound| {
        let mean = column(finished(), &format!("gape_{wound}_mean_mm"));
        (mean[FRAMES] - mean[FRAMES - 1]).abs()
    });
    let shown = number(between(first, "in the last frame the opening changed by ", " mm"));
    let expected = change.fold(0.0, f64::max);
    assert!((shown - expected).abs() < 2e-4 && shown > 0.0, "{shown} mm, not {expected}");
    let most = number(between(first, "largest displacement of tissue is ", " mm"));
    assert!((most - finished().number("/max_displacement_mm")).abs() < 0.0051, "{most} mm");
}

/// Counts, times and memory come after the result and the pictures.
#[test]
fn how_it_was_computed_comes_last_with_the_counts_and_the_time() {
    let place = |text: &str| html().find(text).unwrap_or_else(|| panic!("no {text}"));
    let order =
        ["class=\"result\"", "id=\"view-title\"", "<h2>Pictures</h2>", "<h2>How it was computed</h2>"];
    assert!(order.map(place).is_sorted());
    let (early, late) = html().split_once("<h2>How it was computed</h2>").unwrap();
    assert!(!early.contains(" vertices, ") && !early.contains("<h3>"), "counts before the result");
    let first = between(late, "<p>", "</p>");
    let run = finished();
    for (key, unit) in [
        ("vertices", " vertices"),
        ("edges", " edges"),
        ("tets", " tetrahedra"),
        ("skin_triangles", " skin triangles"),
    ] {
        let before = first.split_once(unit).unwrap().0;
        let found = before.rsplit([' ', ',']).next().unwrap();
        assert_eq!(number(found), run.number(&format!("/sizes/{key}")), "{key}");
    }
    assert!(first.contains(&format!("{FRAMES} frames on <b>cpu</b>")), "{first}");
    let ms = number(first.rsplit_once(" ms per frame").unwrap().0.rsplit(' ').next().unwrap());
    assert!((ms - run.number("/frames/ms_mean")).abs() < 0.051, "{ms} ms");
}

/// Cells of the rows of a table under its heading.
fn table(heading: &str) -> Vec<Vec<String>> {
    let table = between(html(), &format!("<h3>{heading}</h3><div class=\"scroll\"><table>"), "</table>");
    let row = |row: &str| {
        let cells = row.split("<td").skip(1);
        cells.map(|cell| between(cell, ">", "</td>").to_owned()).collect::<Vec<_>>()
    };
    table.split("<tr>").map(row).filter(|cells| !cells.is_empty()).collect()
}

#[test]
fn tables_hold_the_figures_of_the_report() {
    let report = &finished().report;
    let stages = report["stages"].as_array().unwrap();
    let rows = table("Time and memory per stage");
    assert_eq!(rows.len(), stages.len());
    for (row, stage) in rows.iter().zip(stages) {
        assert_eq!((row[0].as_str(), row[2].as_str()), (stage["name"].as_str().unwrap(), "cpu"));
        let ms = number(&row[1]);
        assert!((ms - stage["ms"].as_f64().unwrap()).abs() < 0.051, "{row:?}");
        let bytes = stage.get("peak_bytes").and_then(|bytes| bytes.as_f64());
        assert_eq!(bytes.is_some(), cfg!(target_os = "linux"));
        let shown = row.get(3).map(|cell| number(cell));
        assert!(
            shown.zip(bytes).is_none_or(|(mb, bytes)| bytes > 5e6 && (mb - bytes / 1e6).abs() < 0.51),
            "{row:?}"
        );
        assert_eq!(shown.is_some(), bytes.is_some(), "{row:?}");
    }

    let residuals = report["residuals"].as_array().unwrap();
    let rows = table("Constraints");
    assert_eq!(rows.len(), residuals.len());
    for (row, residual) in rows.iter().zip(residuals) {
        let kind = residual["kind"].as_str().unwrap();
        assert_eq!(row[0], kind);
        assert_eq!(number(&row[1]), report["colors"][kind].as_f64().unwrap(), "{kind}: colors");
        for (cell, key) in [(&row[2], "rms"), (&row[3], "max")] {
            let expected = 100.0 * residual[key].as_f64().unwrap();
            assert!((number(cell) - expected).abs() <= 1e-3 * expected, "{kind}, {key}: {cell} %");
        }
    }

    let parts = report["ledger"]["parts"].as_array().unwrap();
    let rows = table("What the solver costs");
    assert_eq!(rows.len(), parts.len());
    for (row, part) in rows.iter().zip(parts) {
        assert_eq!(row[0], part["part"].as_str().unwrap());
        let bytes = part["host_bytes"].as_f64().unwrap();
        // No column for a GPU, on which nothing is.
        assert_eq!(row.len(), 3, "{row:?}");
        let shown = if row[1].is_empty() { 0.0 } else { number(&row[1]) };
        assert!((shown - bytes / 1e6).abs() < 0.051, "{row:?}: {bytes} bytes");
        let ms = part["ms_per_frame"].as_f64();
        assert_eq!(row[2].is_empty(), ms.is_none(), "{row:?}");
        if let Some(ms) = ms {
            assert!((number(&row[2]) - ms).abs() < 0.0051, "{row:?}: {ms} ms");
        }
    }
}

/// No table has a column without a value, and each number has a unit in its title or is a count.
#[test]
fn every_column_has_values_and_every_quantity_a_unit() {
    const WITHOUT_UNIT: [&str; 8] = ["stage", "on", "kind", "colors", "part", "section", "what", "after"];
    let tables: Vec<&str> =
        html().split("<table>").skip(1).map(|rest| rest.split("</table>").next().unwrap()).collect();
    assert!(tables.len() >= 4, "{} tables", tables.len());
    for table in tables {
        let cells = |row: &str, tag: &str| -> Vec<String> {
            row.split(tag).skip(1).map(|cell| between(cell, ">", "<").to_owned()).collect()
        };
        let titles = cells(table, "<th");
        let rows: Vec<Vec<String>> = table.split("<tr>").skip(2).map(|row| cells(row, "<td")).collect();
        for (column, title) in titles.iter().enumerate() {
            assert!(rows.iter().any(|row| !row[column].is_empty()), "{title} is empty");
            let has_unit = [", ms", ", MB", ", s", ", %"].iter().any(|unit| title.contains(unit));
            assert!(has_unit || WITHOUT_UNIT.contains(&title.as_str()), "{title} has no unit");
        }
    }
}

#[test]
fn the_paragraph_on_the_ct_has_the_counts_in_order() {
    let paragraph = between(html(), "<h3>Resampled CT</h3><p>", "</p>");
    let count = |before: &str, after: &str| number(between(paragraph, before, after));
    let run = finished();
    let moved = number(paragraph.split_once(" voxels of the body moved").unwrap().0);
    assert_eq!(moved, run.number("/resample/moved_voxels"));
    assert_eq!(count("moved, ", " left as air"), run.number("/resample/vacated_voxels"));
    assert_eq!(count("air, ", " folds"), run.number("/resample/folds"));
}

#[test]
fn lists_and_the_scene_are_shown_in_full() {
    let report = &finished().report;
    let list = between(html(), "<h3>Left out by the scene</h3><ul>", "</ul>");
    let left_out = report["left_out"].as_array().unwrap();
    assert_eq!(list.matches("<li>").count(), left_out.len());
    assert!(left_out.iter().all(|line| list.contains(line.as_str().unwrap())), "{list}");
    for line in ["checkpoints:", "gpu:"] {
        assert!(list.contains(line), "{line} is left out by this scene: {list}");
    }
    for line in ["surface:", "tissue:", "pictures:", "report:", "incision:", "handle:", "stc:"] {
        assert!(!list.contains(&format!("<li>{line}")), "{line} is in this scene: {list}");
    }
    let scene = between(html(), "<h2>Scene as it ran</h2><pre tabindex=\"0\">", "</pre>");
    for line in ["rest_area_scale = 0.8", "over_s = 0.1", "frames = 12", "depth_mm = 15.0"] {
        assert!(scene.contains(line), "{line} is not in {scene}");
    }
}

/// The chart's lines, read by its ticks, have the values of `frames.csv` at the first and the last
/// frame.
#[test]
fn the_chart_shows_the_openings_over_time() {
    let svg = between(html(), "<figure class=\"plot\"><svg", "</svg>");
    for text in [">Opening of the wound<", ">time / s<", ">distance of the lips / mm<"] {
        assert!(svg.contains(text), "no {text}");
    }
    let texts: Vec<(&str, &str)> =
        svg.split("<text ").skip(1).map(|tag| tag.split_once('>').unwrap()).collect();
    let ticks = |anchor: &str, place: &str| -> Vec<[f64; 2]> {
        let of = |(tag, rest): &(&str, &str)| {
            let value = rest.split('<').next().unwrap().parse::<f64>().ok()?;
            tag.contains(anchor).then(|| [value, number(between(tag, place, "\""))])
        };
        texts.iter().filter_map(of).collect()
    };
    // Value at a position in the picture, from the first and the last tick of an axis.
    let scale = |ticks: &[[f64; 2]], place: f64| {
        let [[a, x], [b, y]] = [ticks[0], ticks[ticks.len() - 1]];
        a + (place - x) / (y - x) * (b - a)
    };
    let (across, upward) = (ticks("\"middle\"", "x=\""), ticks("\"end\"", "y=\""));
    assert!(across.len() > 2 && upward.len() > 2, "{across:?}, {upward:?}");
    let paths: Vec<(Vec<[f64; 2]>, &str)> = svg
        .split("<path d=\"")
        .skip(1)
        .filter(|tag| tag.contains("stroke-width=\"2\"") && tag.matches('L').count() > 1)
        .map(|tag| {
            let points = between(tag, "M", "\"").split('L');
            let point = |point: &str| {
                let (x, y) = point.split_once(' ').unwrap();
                // A label is half a line below its tick.
                [scale(&across, number(x)), scale(&upward, number(y) + 4.5)]
            };
            (points.map(point).collect(), between(tag, "stroke=\"", "\""))
        })
        .collect();
    let name = |color: &str| {
        let sample = svg.split(&format!("h22\" fill=\"none\" stroke=\"{color}\"")).nth(1).unwrap();
        between(between(sample, "<text ", "/text>"), ">", "<")
    };
    assert_eq!(paths.len(), 4, "mean and middle of two wounds");
    for (points, color) in &paths {
        let name = name(color);
        let wound = number(name.split(' ').nth(1).unwrap()) as usize - 1;
        let what = if name.ends_with("in the middle") { "mid" } else { "mean" };
        let expected = column(finished(), &format!("gape_{wound}_{what}_mm"));
        assert_eq!(points.len(), FRAMES + 1, "{name}");
        for (frame, [time, opening]) in points.iter().enumerate() {
            assert!((time - frame as f64 * DT_S).abs() < 0.002, "{name}: frame {frame} at {time} s");
            let expected = expected[frame];
            assert!((opening - expected).abs() < 0.05, "{name}, frame {frame}: {opening}, not {expected} mm");
        }
    }
}
