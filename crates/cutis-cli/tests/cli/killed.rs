//! A run that is killed at any moment loses and damages nothing: each file with a final name is
//! whole, and `--resume` ends with the bits of an uninterrupted run.

use std::collections::{BTreeMap, BTreeSet};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use cutis_test_kit::Random;

use crate::{Desk, PROGRAM};

/// Number of kills, spread over the whole run.
const KILLS: usize = 100;
const FRAMES: u32 = 6;
/// Number of the run whose files lie in the folder before some of the runs.
const EARLIER: usize = 1;
const CHECKPOINT: &str = "run/checkpoint.bin";
/// A body of some hundred vertices, and every output.
const SCENE: &str = r#"
scan_is_at_rest = false
incision = [{ from_mm = [30, 110, -50], to_mm = [30, 110, 50], depth_mm = 20.0, width_mm = 10.0 }]
[volume]
phantom = { size = [24, 24, 18], seed = 1 }
[lattice]
spacing_mm = 24.0
[constraints]
distance = { youngs_modulus_pa = 5.0e3 }
volume = { bulk_modulus_pa = 5.0e4 }
[fixed]
bone_above_hu = 250.0
end_layers = ["k"]
[run]
frames = 6
checkpoint_every = 1
[output]
report = true
surface = true
volume = true
tissue = true
ply = true
stl = true
displacement = true
series_every = 2
"#;

/// The files of a folder and its subfolders, by their path in it.
type Files = BTreeMap<String, Vec<u8>>;

fn files(desk: &Desk, folder: &str) -> Files {
    let mut files = Files::new();
    for name in desk.names(folder) {
        let path = format!("{folder}/{name}");
        match desk.path(&path).is_dir() {
            true => files.extend(self::files(desk, &path)),
            false => drop(files.insert(path.clone(), std::fs::read(desk.path(&path)).unwrap())),
        }
    }
    files
}

fn is_hidden(path: &str) -> bool {
    path.rsplit('/').next().is_some_and(|name| name.starts_with('.'))
}

/// What is wrong with a file of a run: nothing if it is one of the whole files with this name, or,
/// where it holds times of the machine, if it is complete.
fn damage(path: &str, bytes: &[u8], whole: &[&Files]) -> Option<String> {
    let text = String::from_utf8_lossy(bytes);
    let complete = match path.rsplit('/').next() {
        Some("report.json") => serde_json::from_slice::<serde_json::Value>(bytes).is_ok(),
        Some("report.html") => text.trim_end().ends_with("</html>"),
        Some("frames.csv") => {
            let lines = text.lines().count() as u32;
            text.ends_with('\n') && [FRAMES + 2, EARLIER as u32 + 3].contains(&lines)
        }
        _ => whole.iter().any(|files| files.get(path).is_some_and(|expected| expected == bytes)),
    };
    (!complete).then(|| format!("{path} has {} bytes and is not whole", bytes.len()))
}

/// When a process is killed.
enum Moment {
    /// After a time.
    After(Duration),
    /// A time after a file with this name appears.
    Named(String, Duration),
    /// As soon as a file is being written, after some others.
    Writing(usize),
}

impl Moment {
    /// Moments over the whole run: in time, and along its files, because a busy machine may spend
    /// most of the time in one part of it.
    fn random(random: &mut Random, length: Duration, whole: &Files) -> Self {
        let names: Vec<&String> = whole.keys().collect();
        match random.below(3) {
            0 => Self::After(length.mul_f64(random.uniform())),
            1 => {
                let name = names[random.below(names.len())].clone();
                Self::Named(name, Duration::from_secs_f64(0.01 * random.uniform()))
            }
            _ => Self::Writing(random.below(names.len())),
        }
    }

    /// Waits for the moment, or for the end of the process.
    fn wait(&self, desk: &Desk, child: &mut Child) {
        match self {
            Self::After(time) => pause(*time),
            Self::Named(name, time) => {
                while !desk.path(name).exists() && child.try_wait().unwrap().is_none() {
                    pause(Duration::from_micros(200));
                }
                pause(*time);
            }
            Self::Writing(number) => {
                let mut seen = BTreeSet::new();
                while seen.len() <= *number && child.try_wait().unwrap().is_none() {
                    let folders = ["run", "run/skin-series"];
                    seen.extend(
                        folders.iter().flat_map(|folder| desk.names(folder)).filter(|n| is_hidden(n)),
                    );
                }
            }
        }
    }
}

/// Waits for a time.
fn pause(time: Duration) {
    let (_sender, receiver) = channel::<()>();
    // Nobody sends.
    assert_eq!(receiver.recv_timeout(time), Err(RecvTimeoutError::Timeout));
}

/// Kills a process. Returns false if it ended before.
fn kill(mut child: Child) -> bool {
    child.kill().unwrap();
    child.wait().unwrap().signal().is_some()
}

fn start(desk: &Desk) -> Child {
    let mut command = Command::new(PROGRAM);
    command.args(["run", "scene.toml", "--out", "run"]).current_dir(desk.path("."));
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// What the kills met.
#[derive(Debug, Default)]
struct Met {
    before_the_first_checkpoint: usize,
    among_the_frames: usize,
    after_the_frames: usize,
    /// How many of those after the frames were after the end.
    after_the_end: usize,
    hidden_files: usize,
}

/// One kill, the check of what it left, and the run that resumes. `runs` are the files of
/// uninterrupted runs of each length. The run may replace the files of an earlier run.
fn kill_once(moment: &Moment, runs: &[Files], earlier: Option<&Files>, met: &mut Met) {
    let desk = desk();
    let whole = &runs[runs.len() - 1];
    for (path, bytes) in earlier.into_iter().flatten() {
        std::fs::create_dir_all(desk.path(path).parent().unwrap()).unwrap();
        desk.put(path, bytes);
    }
    let mut child = start(&desk);
    moment.wait(&desk, &mut child);
    met.after_the_end += usize::from(!kill(child));
    let left = files(&desk, "run");
    let (hidden, named): (Vec<_>, Vec<_>) = left.iter().partition(|(path, _)| is_hidden(path));
    met.hidden_files += hidden.len();
    for (path, bytes) in named {
        // A checkpoint of any frame is whole.
        let all = runs.iter().filter(|_| path == CHECKPOINT);
        let whole: Vec<&Files> = all.chain([whole]).chain(earlier).collect();
        assert_eq!(damage(path, bytes, &whole), None);
    }
    let begins_again = !left.contains_key(CHECKPOINT);
    match left.get(CHECKPOINT) {
        None => met.before_the_first_checkpoint += 1,
        Some(saved) if whole[CHECKPOINT] == *saved => met.after_the_frames += 1,
        Some(_) => met.among_the_frames += 1,
    }
    let mut is_unfinished = !hidden.is_empty();
    if desk.path("run").is_dir() {
        // A process that was killed while it wrote a file leaves this. Not every kill meets one.
        desk.put("run/.cutis-1-0.part", "half");
        is_unfinished = true;
    }
    let done = desk.cutis(&["run", "scene.toml", "--out", "run", "--resume"]).expect_success();
    let says = |words: &str| done.stderr.contains(words);
    assert_eq!(says("the run begins at its first frame"), begins_again, "{}", done.stderr);
    assert_eq!(says("unfinished files of a killed run"), is_unfinished, "{}", done.stderr);
    let resumed = files(&desk, "run");
    assert_eq!(resumed.keys().collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>());
    for (path, bytes) in &resumed {
        assert_eq!(damage(path, bytes, &[whole]), None, "after the resumed run");
    }
}

fn desk() -> Desk {
    let desk = Desk::new();
    desk.put("scene.toml", SCENE);
    desk
}

/// The files of uninterrupted runs of 1, 2 … frames.
fn whole_runs() -> Vec<Files> {
    let run = |frames: u32| {
        let desk = desk();
        let count = frames.to_string();
        desk.cutis(&["run", "scene.toml", "--out", "run", "--frames", &count]).expect_success();
        files(&desk, "run")
    };
    (1..=FRAMES).map(run).collect()
}

#[test]
fn a_run_that_is_killed_at_any_moment_resumes_with_the_same_bits() {
    let runs = whole_runs();
    let whole = &runs[FRAMES as usize - 1];
    assert!(whole.keys().all(|path| !is_hidden(path)) && whole.len() > 12, "{:?}", whole.keys());
    let begin = Instant::now();
    desk().cutis(&["run", "scene.toml", "--out", "run"]).expect_success();
    let length = begin.elapsed().mul_f64(1.1);
    let (mut random, mut met) = (Random::new(5), Met::default());
    for kill in 0..KILLS {
        let earlier = Some(&runs[EARLIER]).filter(|_| kill % 3 == 0);
        kill_once(&Moment::random(&mut random, length, whole), &runs, earlier, &mut met);
    }
    eprintln!("{KILLS} kills: {met:?}");
    // The kills meet each part of the run.
    assert!(met.before_the_first_checkpoint > 0 && met.among_the_frames > 0, "{met:?}");
    assert!(met.after_the_frames > met.after_the_end, "{met:?}");
}

/// Negative control: a program that writes to the final name is caught.
#[test]
fn a_half_written_file_is_caught() {
    let desk = desk();
    desk.cutis(&["run", "scene.toml", "--out", "run"]).expect_success();
    let whole = files(&desk, "run");
    for name in ["skin.vtu", "deformed.nii.gz", "checkpoint.bin", "report.json", "report.html", "frames.csv"]
    {
        let path = format!("run/{name}");
        assert_eq!(damage(&path, &whole[&path], &[&whole]), None);
        let half = whole[&path].len() / 2;
        let script =
            format!("cp {path} all; exec 3>{path}; head -c {half} all >&3; touch half; exec sleep 60");
        let mut command = Command::new("bash");
        let child = command.args(["-c", &script]).current_dir(desk.path(".")).spawn().unwrap();
        wait_for(&desk, "half");
        assert!(kill(child));
        let left = files(&desk, "run");
        assert!(damage(&path, &left[&path], &[&whole]).is_some(), "{name}");
        std::fs::remove_file(desk.path("half")).unwrap();
        desk.put(&path, &whole[&path]);
    }
}

fn wait_for(desk: &Desk, name: &str) {
    for _ in 0..3000 {
        if desk.path(name).exists() {
            return;
        }
        pause(Duration::from_millis(10));
    }
    panic!("no {name}");
}
