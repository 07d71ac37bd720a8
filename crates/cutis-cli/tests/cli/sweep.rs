//! `cutis sweep`: tables of many cases, failures that are kept, and sweeps that go on where they
//! ended.

use std::collections::BTreeMap;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::{Desk, PROGRAM};

/// Two axes, a control, and a case that fails while it runs.
const STUDY: &str = r#"
scene = "scene.toml"
set = ["output={ report = true }"]
[[axis]]
key = "constraints.stc.area_modulus_n_per_m"
values = [50.0, 100.0]
[[axis]]
key = "run.frames"
values = [1, 2]
[[case]]
name = "no-tension"
without = ["stc"]
"#;

/// The columns that depend on the machine.
const MEASURED: [&str; 3] = ["frame_ms", "seconds", "peak_mb"];

impl Desk {
    fn with_study(text: &str) -> Self {
        let desk = Self::new();
        desk.put("study.toml", text);
        desk
    }

    /// The table by case and column.
    fn table(&self, folder: &str) -> BTreeMap<String, BTreeMap<String, String>> {
        let text = std::fs::read_to_string(self.path(&format!("{folder}/table.csv"))).unwrap();
        let mut lines = text.lines().map(cells);
        let columns = lines.next().unwrap();
        let row = |cells: Vec<String>| {
            assert_eq!(cells.len(), columns.len());
            (cells[0].clone(), columns.iter().cloned().zip(cells).collect())
        };
        lines.map(row).collect()
    }

    /// The table without the columns that depend on the machine.
    fn results(&self, folder: &str) -> BTreeMap<String, BTreeMap<String, String>> {
        let mut table = self.table(folder);
        let rows = table.values_mut();
        rows.for_each(|row| row.retain(|column, _| !MEASURED.contains(&column.as_str())));
        table
    }

    /// Number of lines in the journal of each case.
    fn runs(&self, folder: &str) -> BTreeMap<String, usize> {
        let journal = format!("{folder}/journal");
        let count = |name: String| {
            let text = std::fs::read_to_string(self.path(&format!("{journal}/{name}"))).unwrap();
            (name.trim_end_matches(".jsonl").to_owned(), text.lines().count())
        };
        self.names(&journal).into_iter().map(count).collect()
    }
}

/// The cells of a line of CSV.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    for letter in line.chars() {
        match letter {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            letter => cells.last_mut().unwrap().push(letter),
        }
    }
    cells
}

const CASES: [&str; 5] = [
    "area_modulus_n_per_m=50+frames=1",
    "area_modulus_n_per_m=50+frames=2",
    "area_modulus_n_per_m=100+frames=1",
    "area_modulus_n_per_m=100+frames=2",
    "no-tension",
];

#[test]
fn a_sweep_has_the_results_of_single_runs_in_one_table() {
    let desk = Desk::with_study(STUDY);
    let listed = desk.cutis(&["sweep", "study.toml", "--list"]).expect_success().stdout;
    assert_eq!(listed.lines().collect::<Vec<_>>(), CASES);
    let planned = desk.cutis(&["sweep", "study.toml", "--dry-run"]).expect_success().stdout;
    assert!(planned.contains("5 cases: 0 done, 5 to run"), "{planned}");
    assert_eq!(desk.names("."), ["scene.toml", "study.toml"], "neither of them writes");

    let done = desk.cutis(&["sweep", "study.toml", "--jobs", "2"]).expect_success();
    assert!(done.stderr.contains("[5/5]") && done.stderr.contains("left"), "{}", done.stderr);
    assert!(done.stdout.contains("5 of 5 cases are done"), "{}", done.stdout);
    let table = desk.table("study-sweep");
    assert_eq!(table.len(), 5);

    // The same case as a single run.
    let set = ["--set", "constraints.stc.area_modulus_n_per_m=50.0", "--frames", "2"];
    let set = [&set[..], &["--set", "output={ report = true }", "--json"]].concat();
    let single = desk.cutis(&[&["run", "scene.toml"], &set[..]].concat()).expect_success().stdout;
    let single: Value = serde_json::from_str(&single).unwrap();
    let row = &table[CASES[1]];
    let number = |column: &str| row[column].parse::<f64>().unwrap();
    assert_eq!(number("wound0_final_mm"), single["wounds"][0]["final_mm"].as_f64().unwrap());
    assert_eq!(number("max_displacement_mm"), single["max_displacement_mm"].as_f64().unwrap());
    assert_eq!(number("vertices"), single["sizes"]["vertices"].as_f64().unwrap());
    assert_eq!((row["run.frames"].as_str(), row["exit"].as_str()), ("2", "0"));
    assert!(number("seconds") > 0.0 && row["error"].is_empty());
    // Controls: other settings have other results, and the wound stays shut without tension.
    assert_ne!(row["wound0_final_mm"], table[CASES[0]]["wound0_final_mm"]);
    assert_ne!(row["wound0_final_mm"], table[CASES[3]]["wound0_final_mm"]);
    assert_eq!(table["no-tension"]["without"], "stc");
    let opening = |case: &str| table[case]["wound0_final_mm"].parse::<f64>().unwrap();
    assert!(opening("no-tension") < opening(CASES[3]));

    let page = std::fs::read_to_string(desk.path("study-sweep/plots.html")).unwrap();
    assert_eq!(page.matches("<h2>Over ").count(), 2);
    assert!(page.matches("<svg").count() >= 9 && !page.contains("http-equiv=\"refresh\""));
    assert!(!page.contains("src=") && page.contains(&format!("cases/{}/report.html", CASES[1])));
    assert!(desk.path(&format!("study-sweep/cases/{}/report.html", CASES[1])).is_file());
}

#[test]
fn only_what_changed_runs_again() {
    let desk = Desk::with_study(STUDY);
    let sweep = || desk.cutis(&["sweep", "study.toml"]);
    sweep().expect_success();
    let once: BTreeMap<String, usize> = CASES.iter().map(|case| ((*case).to_owned(), 1)).collect();
    assert_eq!(desk.runs("study-sweep"), once);
    let before = desk.results("study-sweep");

    // Nothing changed, or only the place and comments of the study.
    desk.put("study.toml", format!("# again\n{STUDY}"));
    sweep().expect_success();
    assert_eq!(desk.runs("study-sweep"), once);

    // A value more: its cases run, the others do not.
    desk.put("study.toml", STUDY.replace("[1, 2]", "[1, 2, 3]"));
    sweep().expect_success();
    let runs = desk.runs("study-sweep");
    assert!(runs.len() == 7 && runs.values().all(|&count| count == 1), "{runs:?}");

    // The scene changed: the cases whose values changed run, and their results do.
    desk.put("study.toml", STUDY);
    desk.put("scene.toml", crate::SCENE.replace("rest_area_scale = 0.8", "rest_area_scale = 0.6"));
    let planned = desk.cutis(&["sweep", "study.toml", "--dry-run"]).expect_success().stdout;
    assert!(planned.contains("changed: settings") && planned.contains("1 done, 4 to run"), "{planned}");
    sweep().expect_success();
    let after = desk.results("study-sweep");
    for (case, runs) in CASES.iter().zip([2, 2, 2, 2, 1]) {
        assert_eq!(desk.runs("study-sweep")[*case], runs, "{case}");
        let changed = before[*case]["wound0_final_mm"] != after[*case]["wound0_final_mm"];
        assert_eq!(changed, runs == 2, "{case}");
    }

    // A report that someone changed is not the one that the case wrote.
    let report = format!("study-sweep/cases/{}/report.json", CASES[0]);
    let text = std::fs::read_to_string(desk.path(&report)).unwrap();
    desk.put(&report, text.replace("\"final_mm\": ", "\"final_mm\": 1"));
    let planned = desk.cutis(&["sweep", "study.toml", "--dry-run"]).expect_success().stdout;
    assert!(
        planned.contains("report.json is not the one") && planned.contains("4 done, 1 to run"),
        "{planned}"
    );
    let table = desk.cutis(&["sweep", "study.toml", "--table"]);
    assert_eq!(table.code, 1, "the table has a case that is not done: {}", table.stderr);
    assert_eq!(desk.table("study-sweep")[CASES[0]]["wound0_final_mm"], "");
    sweep().expect_success();
    assert_eq!(desk.results("study-sweep"), after);
}

/// A scan that changes under its name makes its cases run again.
#[test]
fn scans_are_identified_by_their_bytes() {
    let study = "scene = \"scene.toml\"\nset = [\"output={ report = true }\", \"run.frames=1\"]\n\
                 [[scan]]\npath = \"a.nii\"\n[[scan]]\npath = \"b.nii.gz\"\n\
                 set = [\"incision.0.depth_mm=25\"]\n";
    let desk = Desk::with_study(study);
    let text = crate::SCENE.replace("phantom = { size = [48, 48, 36], seed = 1 }", "path = \"a.nii\"");
    desk.put("scene.toml", text);
    let phantom = |out: &str, seed: &str| {
        desk.cutis(&["phantom", "--size", "48,48,36", "--seed", seed, "--out", out]).expect_success();
    };
    phantom("a.nii", "1");
    phantom("b.nii.gz", "1");
    desk.cutis(&["sweep", "study.toml"]).expect_success();
    let before = desk.results("study-sweep");
    assert_eq!(before.keys().collect::<Vec<_>>(), ["a", "b"]);
    assert_ne!(before["a"]["wound0_final_mm"], before["b"]["wound0_final_mm"], "the depth differs");
    phantom("b.nii.gz", "2");
    let planned = desk.cutis(&["sweep", "study.toml", "--dry-run"]).expect_success().stdout;
    assert!(planned.contains("changed: an input file") && planned.contains("1 done, 1 to run"), "{planned}");
    desk.cutis(&["sweep", "study.toml"]).expect_success();
    let after = desk.results("study-sweep");
    assert_eq!(before["a"], after["a"]);
    assert_ne!(before["b"], after["b"]);
}

/// A case that fails is in the table with its message and exit code, and the others run.
#[test]
fn failures_are_kept_and_the_sweep_goes_on() {
    let study = "scene = \"scene.toml\"\nset = [\"output={ report = true }\", \"run.frames=1\"]\n\
                 [[axis]]\nkey = \"volume.phantom.size\"\nvalues = [[48, 48, 36], [2, 2, 2]]\n";
    let desk = Desk::with_study(study);
    let done = desk.cutis(&["sweep", "study.toml"]);
    assert_eq!(done.code, 1, "{}", done.stderr);
    assert!(done.stderr.contains("failed: ") && done.stdout.contains("1 of 2 cases"), "{}", done.stderr);
    let table = desk.table("study-sweep");
    let (_, failed) = table.iter().find(|(_, row)| row["state"] == "failed").unwrap();
    assert_eq!(failed["exit"], "2");
    assert!(failed["error"].contains("skin") || failed["error"].contains("tissue"), "{}", failed["error"]);
    assert!(failed["wound0_final_mm"].is_empty());
    assert_eq!(table.values().filter(|row| row["state"] == "done").count(), 1);
    // It runs again, because the reason may be gone; the other one does not.
    assert_eq!(desk.cutis(&["sweep", "study.toml"]).code, 1);
    let mut runs: Vec<usize> = desk.runs("study-sweep").into_values().collect();
    runs.sort_unstable();
    assert_eq!(runs, [1, 2]);
}

/// A sweep that is killed goes on, and its table is that of one that was not.
#[test]
#[cfg(unix)]
#[expect(clippy::disallowed_methods, reason = "a file of another process is no event to wait for")]
fn a_killed_sweep_goes_on() {
    let desk = Desk::with_study(&STUDY.replace("[1, 2]", "[1, 2, 40]"));
    let start = || {
        let mut command = Command::new(PROGRAM);
        command.args(["sweep", "study.toml", "--out", "killed"]).current_dir(desk.path("."));
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let mut sweep = start();
    for _ in 0..600 {
        if desk.names("killed/journal").len() >= 2 {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    sweep.kill().unwrap();
    sweep.wait().unwrap();
    let journals = desk.runs("killed");
    let finished = journals.values().filter(|&&lines| lines > 0).count();
    assert!((1..7).contains(&finished), "killed in the middle: {journals:?}");
    // A killed process may leave half a line, too.
    let torn = desk.path(&format!("killed/journal/{}.jsonl", CASES[0]));
    let line = std::fs::read_to_string(&torn).unwrap();
    std::fs::write(&torn, format!("{line}{}", &line[..line.len() / 2])).unwrap();

    desk.cutis(&["sweep", "study.toml", "--out", "killed"]).expect_success();
    desk.cutis(&["sweep", "study.toml", "--out", "whole"]).expect_success();
    assert_eq!(desk.results("killed"), desk.results("whole"));
    assert_eq!(desk.results("killed").len(), 7);
}

#[test]
fn bad_studies_are_refused_by_name() {
    let desk = Desk::new();
    let refused = |text: &str, words: &[&str]| {
        desk.put("study.toml", text);
        let done = desk.cutis(&["sweep", "study.toml"]);
        done.expect_error(2, &[&["study.toml"], words].concat());
        assert_eq!(desk.names("."), ["scene.toml", "study.toml"], "{text}");
    };
    let scene = "scene = \"scene.toml\"\nset = [\"output={ report = true }\"]\n";
    let axis = |key: &str, values: &str| format!("{scene}[[axis]]\nkey = \"{key}\"\nvalues = {values}\n");
    refused("scene = ", &["TOML"]);
    refused("", &["scene"]);
    refused("scene = []\n", &["`scene`", "at least one"]);
    refused("scene = 5\n", &["`scene`", "a path"]);
    refused("scene = \"none.toml\"\n", &["none.toml"]);
    refused("scene = \"scene.toml\"\nsets = []\n", &["sets", "nearest one is `set`"]);
    refused("scene = \"scene.toml\"\nset = [\"frames\"]\n", &["`set[0]`", "key=value"]);
    refused("scene = \"scene.toml\"\nset = [\"output={}\"]\n", &["output.report"]);
    refused(&axis("latice.spacing_mm", "[8]"), &["latice", "the nearest one is `lattice`"]);
    refused(&axis("lattice.spacng_mm", "[8]"), &["the nearest one is `spacing_mm`"]);
    refused(&axis("lattice.spacing_mm", "[8, \"wide\"]"), &["case `spacing_mm=wide`", "invalid type"]);
    refused(&axis("lattice.spacing_mm", "[8, -1]"), &["case `spacing_mm=-1`", "lattice.spacing_mm"]);
    refused(&axis("lattice.spacing_mm", "[]"), &["`axis[0].values`", "at least one value"]);
    refused(&axis("lattice.spacing_mm", "[8, 8.0]"), &["spacing_mm=8", "different values"]);
    refused(&axis("lattice.spacing_mm", "8"), &["`axis[0].values`"]);
    let twice = axis("run.frames", "[1]") + "[[axis]]\nkey = \"run.frames\"\nvalues = [2]\n";
    refused(&twice, &["`axis[1].key`", "another axis"]);
    let many: Vec<String> = (1..=101).map(|n| n.to_string()).collect();
    let many = format!("[{}]", many.join(", "));
    let huge = axis("run.frames", &many) + &format!("[[axis]]\nkey = \"solver.substeps\"\nvalues = {many}\n");
    refused(&huge, &["101 values of run.frames x 101 values of solver.substeps", "10000"]);
    refused(&format!("{scene}[[case]]\nname = \"a/b\"\n"), &["`case[0].name`", "a/b"]);
    refused(
        &format!("{scene}[[case]]\nname = \"a\"\nwithout = [\"skin\"]\n"),
        &["`case[0].without`", "skin"],
    );
    refused(&format!("{scene}[[case]]\nname = \"a\"\nscan = \"b\"\n"), &["case[0]", "does not list"]);
    refused(&format!("{scene}[[case]]\nname = \"a\"\n[[case]]\nname = \"A\"\n"), &["`case`", "another case"]);
    refused(&format!("{scene}[[scan]]\n"), &["scan[0].name"]);
}

#[test]
fn calls_that_mean_nothing_are_refused() {
    let desk = Desk::with_study(STUDY);
    let call = |args: &[&str]| desk.cutis(&[&["sweep", "study.toml"], args].concat());
    for args in [
        &["--case", "a", "--list"][..],
        &["--table", "--dry-run"],
        &["--jobs", "many"],
        &["--jobs", "0"],
        &["--threads", "0"],
    ] {
        assert_eq!(call(args).code, 2, "{args:?}");
    }
    call(&["--case", "no-tensio"]).expect_error(2, &["no such case", "the nearest one is `no-tension`"]);
    call(&["--out", "scene.toml"]).expect_error(1, &["scene.toml"]);
    assert_eq!(desk.names("."), ["scene.toml", "study.toml"]);
}

/// The studies in the book are valid for a scene of the repository.
#[test]
fn the_studies_in_the_book_are_valid() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let scene = format!("scene = \"{root}/fixtures/scenes/abdomen-incision.toml\"");
    let desk = Desk::new();
    for (page, cases) in [("sweeps", 14), ("values", 10)] {
        let text = std::fs::read_to_string(format!("{root}/docs/book/{page}.md")).unwrap();
        let study = text.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
        desk.put("study.toml", study.replace("scene = \"scene.toml\"", &scene));
        let listed = desk.cutis(&["sweep", "study.toml", "--list"]).expect_success().stdout;
        assert_eq!(listed.lines().count(), cases, "{page}");
    }
}

/// A case alone is the one of the sweep, for any number of threads.
#[test]
fn cases_one_by_one_give_the_same_table() {
    let desk = Desk::with_study(STUDY);
    for (n, case) in CASES.iter().enumerate() {
        let threads = (n % 2 + 1).to_string();
        let args = ["sweep", "study.toml", "--out", "single", "--case", case, "--threads", &threads];
        desk.cutis(&args).expect_success();
    }
    let again = desk.cutis(&["sweep", "study.toml", "--out", "single", "--case", CASES[0]]).expect_success();
    assert!(again.stdout.contains("done before"), "{}", again.stdout);
    desk.cutis(&["sweep", "study.toml", "--out", "single", "--table"]).expect_success();
    desk.cutis(&["sweep", "study.toml", "--out", "all"]).expect_success();
    assert_eq!(desk.results("single"), desk.results("all"));
}
