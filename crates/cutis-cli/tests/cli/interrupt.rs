//! Ctrl-C during a run: the message says how to resume, and the resumed run has the whole history.

use std::process::{Command, Stdio};
use std::time::Duration;

use crate::{Desk, PROGRAM, SCENE};

/// Starts a long run, and interrupts it when `ready` exists.
fn interrupt(desk: &Desk, options: &[&str], ready: &str) -> (Option<i32>, String) {
    let args = [&["run", "scene.toml", "--out", "run", "--frames", "1000000"], options].concat();
    interrupt_command(desk, &args, ready)
}

/// Starts a command, waits until `ready` exists, sends SIGINT, and returns exit code and standard
/// error.
#[expect(clippy::disallowed_methods, reason = "a file of another process is no event to wait for")]
fn interrupt_command(desk: &Desk, args: &[&str], ready: &str) -> (Option<i32>, String) {
    let mut command = Command::new(PROGRAM);
    command.args(args).current_dir(desk.path(".")).stdout(Stdio::null()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    for _ in 0..600 {
        if desk.path(ready).exists() {
            break;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(desk.path(ready).exists(), "no {ready} in a minute");
    std::thread::sleep(Duration::from_millis(300));
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let done = child.wait_with_output().unwrap();
    (done.status.code(), String::from_utf8(done.stderr).unwrap())
}

#[test]
fn an_interrupted_run_says_how_to_resume_and_resumes_with_its_history() {
    let desk = Desk::new();
    let every = ["--set", "run.checkpoint_every=3", "--set", "output={ report = true }"];
    let (code, text) = interrupt(&desk, &every, "run/checkpoint.bin");
    assert_eq!(code, Some(130), "{text}");
    let last = text.trim_end().lines().last().unwrap();
    assert!(last.contains("run/checkpoint.bin") && last.ends_with("--resume"), "{text}");
    assert_eq!(desk.names("run"), ["checkpoint.bin"], "no partial file stays");

    let state = std::fs::read(desk.path("run/checkpoint.bin")).unwrap();
    let frame = u32::from_le_bytes(state[40..44].try_into().unwrap());
    assert!(frame >= 3, "{frame}");
    let frames = (frame + 2).to_string();
    let resume = ["run", "scene.toml", "--out", "run", "--resume", "--frames", &frames];
    desk.cutis(&[&resume[..], &every].concat()).expect_success();
    let table = std::fs::read_to_string(desk.path("run/frames.csv")).unwrap();
    let found: Vec<u32> =
        table.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect();
    assert_eq!(found, (0..=frame + 2).collect::<Vec<u32>>());
    let html = std::fs::read_to_string(desk.path("run/report.html")).unwrap();
    assert!(html.contains("<title>scene - Cutis run</title>") && html.contains("name=\"viewport\""));
    let paths = html.split("<path d=\"M").filter_map(|rest| rest.split('"').next());
    let points = paths.map(|path| 1 + path.matches('L').count()).max().unwrap();
    assert_eq!(points, frame as usize + 3, "the curve has a point for each frame");
}

/// Without `run.checkpoint_every` the state is saved too, and the run resumes from it.
#[test]
fn an_interrupted_run_without_checkpoints_saves_its_state() {
    let desk = Desk::new();
    let series = ["--set", "output={ series_every = 1 }"];
    let (code, text) = interrupt(&desk, &series, "run/skin-series/skin-000003.vtp");
    assert_eq!(code, Some(130), "{text}");
    assert!(text.contains("ends after this frame") && text.trim_end().ends_with("--resume"), "{text}");
    assert_eq!(desk.names("run"), ["checkpoint.bin", "skin-series"]);
    let state = std::fs::read(desk.path("run/checkpoint.bin")).unwrap();
    let frame = u32::from_le_bytes(state[40..44].try_into().unwrap());
    assert!(frame >= 3, "{frame}");
    let frames = (frame + 2).to_string();
    let report = ["--set", "output={ report = true }"];
    let resume = ["run", "scene.toml", "--out", "run", "--resume", "--frames", &frames];
    desk.cutis(&[&resume[..], &report].concat()).expect_success();
    let table = std::fs::read_to_string(desk.path("run/frames.csv")).unwrap();
    assert_eq!(table.lines().count() as u32, frame + 4, "{table}");
}

/// Control: before the first frame nothing can be resumed, and the message says what to set.
#[test]
fn an_interrupted_run_before_its_frames_says_so() {
    let desk = Desk::new();
    let large = ["--set", "volume.phantom={ size = [512, 512, 400] }"];
    let (code, text) = interrupt(&desk, &large, "scene.toml");
    assert_eq!(code, Some(130), "{text}");
    let last = text.trim_end().lines().last().unwrap();
    assert!(last.contains("run.checkpoint_every") && !last.contains("--resume"), "{text}");
    assert!(desk.names("run").is_empty());
}

/// A search for rest ends first. Then its state is saved, and `settle` goes on with what is done
/// to the body next.
#[test]
fn an_interrupted_settle_resumes_with_the_next_state() {
    let desk = Desk::new();
    let scene = SCENE.replace("depth_mm = 20.0, width_mm = 10.0", "depth_mm = 20.0, at_s = 0.1");
    desk.put("scene.toml", scene.replace("spacing_mm = 12.0", "spacing_mm = 10.0"));
    let hook =
        "handle=[{ at_mm = [46, 92, 0], radius_mm = 14, move_mm = [9, 4, 0], at_s = 1.5, over_s = 0.2 }]";
    let settle = ["settle", "scene.toml", "--set", "run.checkpoint_every=1", "--set", hook];
    let args = [&settle[..], &["--out", "run"]].concat();
    let (code, text) = interrupt_command(&desk, &args, "run/checkpoint.bin");
    assert_eq!(code, Some(130), "{text}");
    assert!(text.contains("this frame or search") && text.trim_end().ends_with("--resume"), "{text}");
    assert_eq!(desk.names("run"), ["checkpoint.bin"], "no partial file stays");
    desk.cutis(&[&args[..], &["--resume"]].concat()).expect_success();
    desk.cutis(&[&settle[..], &["--out", "whole"]].concat()).expect_success();
    for file in ["checkpoint.bin", "deformed.nii.gz", "skin.vtu"] {
        let [resumed, whole] = ["run", "whole"].map(|run| std::fs::read(desk.path(run).join(file)).unwrap());
        assert!(resumed == whole, "{file} differs");
    }
    let report = std::fs::read_to_string(desk.path("run/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["stops"].as_array().unwrap().len(), 3, "{}", report["stops"]);
}
