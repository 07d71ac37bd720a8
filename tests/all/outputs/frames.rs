//! `frames.csv` and the times: each column is compared with another output of the same quantity.

use super::body::{DT_S, FRAMES, Finished, finished, run};

/// The values of `frames.csv` by the name of their column.
pub fn column(run: &Finished, name: &str) -> Vec<f64> {
    let mut lines = run.text("frames.csv").lines();
    let place = lines.next().unwrap().split(',').position(|column| column == name);
    let place = place.unwrap_or_else(|| panic!("no column {name}"));
    lines.map(|line| line.split(',').nth(place).unwrap().parse().unwrap()).collect()
}

#[test]
fn columns_are_named_in_order() {
    let head = finished().text("frames.csv").lines().next().unwrap();
    let gapes = "gape_0_mean_mm,gape_0_mid_mm,gape_1_mean_mm,gape_1_mid_mm";
    assert_eq!(head, format!("frame,time_s,ms,{gapes},handle_0_n"));
}

#[test]
fn frames_and_times_count_up() {
    let (frames, times) = (column(finished(), "frame"), column(finished(), "time_s"));
    assert_eq!(frames.len(), FRAMES + 1, "one row before the first frame");
    for (n, (frame, time)) in frames.iter().zip(&times).enumerate() {
        assert_eq!(*frame, n as f64);
        assert!((time - n as f64 * DT_S).abs() < 1e-9, "frame {n} at {time} s");
    }
}

/// The first row is the body at rest, and the last row is the result. The mean and the middle
/// opening are not swapped.
#[test]
fn openings_match_the_report() {
    let run = finished();
    for wound in 0..2 {
        let [mean, mid] = ["mean", "mid"].map(|what| column(run, &format!("gape_{wound}_{what}_mm")));
        let number = |key: &str| run.number(&format!("/wounds/{wound}/{key}"));
        for (found, key) in [
            (mean[0], "initial_mm"),
            (mean[FRAMES], "final_mm"),
            (mid[0], "initial_mid_mm"),
            (mid[FRAMES], "mid_mm"),
        ] {
            assert!((found - number(key)).abs() < 1e-3, "wound {wound}, {key}: {found}, {}", number(key));
        }
        assert!(mean[FRAMES] > mean[0] + 0.5, "wound {wound} opens: {mean:?}");
        assert!(mid[FRAMES] - mid[0] > mean[FRAMES] - mean[0], "wound {wound} opens most in its middle");
    }
    let differ = |a: &str, b: &str| (run.number(a) - run.number(b)).abs() > 0.05;
    assert!(differ("/wounds/1/initial_mm", "/wounds/1/initial_mid_mm"), "{:#}", run.report["wounds"]);
    assert!(differ("/wounds/0/initial_mm", "/wounds/1/initial_mm"), "{:#}", run.report["wounds"]);
    assert_eq!(run.report["wound"], run.report["wounds"][0], "`wound` is the first one");
}

/// Frame count, mean and shortest time in the report equal those of the table, and fit into the
/// time of the stage. The run has 20 times as many substeps as the others, so that frames take
/// longer than what a busy machine does in between.
#[test]
fn the_report_has_the_times_of_the_table() {
    let run = &run(&[("solver.substeps", "100")]);
    let ms = &column(run, "ms")[1..];
    assert_eq!(run.number("/frames/count"), FRAMES as f64);
    let mean = ms.iter().sum::<f64>() / FRAMES as f64;
    let least = ms.iter().copied().fold(f64::MAX, f64::min);
    let [reported_mean, reported_least] =
        ["mean", "min"].map(|what| run.number(&format!("/frames/ms_{what}")));
    assert!((reported_mean - mean).abs() < 1e-3, "mean: {reported_mean} ms, {mean} ms in the table");
    assert!((reported_least - least).abs() < 1e-3, "least: {reported_least} ms, {least} ms in the table");
    assert_eq!(column(run, "ms")[0], 0.0, "nothing is computed before the first frame");
    let stages = run.report["stages"].as_array().unwrap();
    let simulate = stages.iter().find(|stage| stage["name"] == "simulate").unwrap()["ms"].as_f64().unwrap();
    let sum: f64 = ms.iter().sum();
    assert!(sum <= simulate && sum > 0.7 * simulate, "frames take {sum} of {simulate} ms");
}
