//! GPUs from the command line: the list of devices, the message without a device, and no search for
//! devices that the scene does not need.

use serde_json::Value;

use crate::{Desk, Done};

/// Environment in which the Vulkan loader finds no driver.
const NO_DRIVER: [(&str, &str); 2] =
    [("VK_DRIVER_FILES", "/nonexistent"), ("VK_ICD_FILENAMES", "/nonexistent")];

/// Environment in which the Vulkan loader logs every action.
const TALKATIVE: [(&str, &str); 1] = [("VK_LOADER_DEBUG", "all")];

fn words(call: &str) -> Vec<&str> {
    call.split(' ').collect()
}

fn parsed(done: Done) -> Value {
    let done = done.expect_success();
    serde_json::from_str(&done.stdout).unwrap_or_else(|e| panic!("{}: {e}: {}", done.call, done.stdout))
}

/// The adapters of this machine. Without an adapter the test is skipped with a printed reason, or
/// fails where an adapter is required.
fn adapters(desk: &Desk) -> Option<Vec<Value>> {
    let found = parsed(desk.cutis(&["devices", "--json"]));
    let adapters = found["devices"].as_array().unwrap().clone();
    if adapters.is_empty() {
        let required = ["CI", "CUTIS_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
        assert!(!required, "{}", found["note"]);
        eprintln!("skipped: {}", found["note"]);
        return None;
    }
    Some(adapters)
}

#[test]
fn a_missing_gpu_is_refused_with_installation_advice() {
    let desk = Desk::new();
    for call in [
        "run scene.toml --backend gpu",
        "run scene.toml --backend gpu --adapter 0 --out elsewhere",
        "check scene.toml --backend gpu",
        "run scene.toml --set solver.backend=gpu --resume",
        "demo --backend gpu --out elsewhere",
        "settle scene.toml --backend gpu --out elsewhere",
        "resample scene.toml --run elsewhere --out ct.nii.gz --backend gpu",
    ] {
        let scene = if call.starts_with("demo") { "demo.toml" } else { "scene.toml" };
        desk.cutis_with(&NO_DRIVER, &words(call))
            .expect_error(2, &[scene, "solver.backend", "no GPU adapter", "mesa-vulkan-drivers", "\"cpu\""]);
    }
    assert_eq!(desk.names("."), ["scene.toml"], "no run folder");
}

#[test]
fn other_calls_need_no_gpu() {
    let desk = Desk::new();
    for call in ["run scene.toml --out auto", "run scene.toml --backend cpu --adapter nvidia --out cpu"] {
        desk.cutis_with(&NO_DRIVER, &words(call)).expect_success();
    }
    let found = parsed(desk.cutis_with(&NO_DRIVER, &["devices", "--json"]));
    assert_eq!((&found["devices"], &found["auto"]), (&serde_json::json!([]), &Value::Null));
    assert!(found["note"].as_str().unwrap().contains("mesa-vulkan-drivers"), "{found}");
    let table = desk.cutis_with(&NO_DRIVER, &["devices"]).expect_success().stdout;
    assert_eq!(table.trim_end(), found["note"].as_str().unwrap());
}

#[test]
fn devices() {
    let desk = Desk::new();
    let Some(adapters) = adapters(&desk) else { return };
    let table = desk.cutis(&["devices"]).expect_success().stdout;
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), adapters.len() + 2, "a head, the adapters, what auto does: {table}");
    for (n, adapter) in adapters.iter().enumerate() {
        for key in ["name", "kind", "api", "driver"] {
            let text = adapter[key].as_str().unwrap();
            assert!(!text.is_empty() && lines[n + 1].contains(text), "{key}: {table}");
        }
        assert_eq!(adapter["index"], n);
        assert!(adapter["usable"] == true || adapter["why"].is_string(), "{adapter}");
        let binding = adapter["limits"]["max_binding_bytes"].as_u64().unwrap();
        assert!(binding >= 128 << 20 && lines[n + 1].contains(&format!("{} MiB", binding >> 20)), "{table}");
    }
    let found = parsed(desk.cutis(&["devices", "--json"]));
    if let Some(taken) = found["auto"].as_u64() {
        assert_ne!(adapters[taken as usize]["kind"], "software");
    } else {
        assert!(found["note"].as_str().unwrap().contains("CPU backend"), "{found}");
    }
}

#[test]
fn an_unknown_adapter_is_refused_with_a_list() {
    let desk = Desk::new();
    let Some(adapters) = adapters(&desk) else { return };
    let first = adapters[0]["name"].as_str().unwrap();
    for adapter in ["unheard-of", "99"] {
        for call in ["run scene.toml --backend gpu --out elsewhere", "check scene.toml --backend gpu"] {
            let done = desk.cutis(&[&words(call)[..], &["--adapter", adapter]].concat());
            done.expect_error(2, &["scene.toml", "solver.adapter", adapter, first, "cutis devices"]);
        }
    }
    assert_eq!(desk.names("."), ["scene.toml"]);
}

#[test]
fn a_run_on_a_gpu_says_where_it_ran() {
    let desk = Desk::new();
    let Some(adapters) = adapters(&desk) else { return };
    let name = adapters[0]["name"].as_str().unwrap();
    let part = name.split(' ').next().unwrap().to_uppercase();

    let check = desk.cutis(&["check", "scene.toml", "--backend", "gpu", "--adapter", "0"]).expect_success();
    assert!(check.stdout.contains(&format!("gpu: {name}")), "{}", check.stdout);
    for words in [" MB on the GPU", "time             not measured", "cutis tune"] {
        assert!(check.stdout.contains(words), "no {words:?} in {}", check.stdout);
    }
    assert!(!check.stdout.contains("gpu\n"), "{}", check.stdout);

    let plan = parsed(desk.cutis(&["check", "scene.toml", "--backend", "gpu", "--json"]));
    let parts: Vec<&Value> = plan["device_memory"].as_array().unwrap().iter().map(|p| &p["part"]).collect();
    assert_eq!(parts, ["vertices", "distance", "volume", "stc"]);
    assert!(plan["device_memory"].as_array().unwrap().iter().all(|p| p["bytes"].as_u64() > Some(0)));
    let costs = plan["ledger"]["parts"].as_array().unwrap();
    assert!(
        costs.iter().all(|part| part["device_bytes"].as_u64() > Some(0) && part["ms_per_frame"].is_null())
    );

    let call = "run scene.toml --backend gpu --out run --json --set output={report=true} --adapter";
    let report = parsed(desk.cutis(&[&words(call)[..], &[&part]].concat()));
    assert_eq!((&report["backend"]["name"], &report["backend"]["adapter"]), (&"gpu".into(), &name.into()));
    for key in ["adapter_kind", "driver", "reason"] {
        assert!(report["backend"][key].as_str().is_some_and(|text| !text.is_empty()), "{key}: {report}");
    }
    for key in ["kernels", "submits", "dispatches", "readbacks", "readback_bytes"] {
        assert!(report["device"][key].as_u64() > Some(0), "{key}: {report}");
    }
    let costs = report["ledger"]["parts"].as_array().unwrap();
    let timed: Vec<&Value> = costs.iter().map(|part| &part["part"]).collect();
    assert_eq!(timed, ["vertices", "distance", "volume", "stc", "check"]);
    assert!(costs.iter().all(|part| part["ms_per_frame"].as_f64() > Some(0.0)), "{costs:?}");
    let stages = report["stages"].as_array().unwrap();
    let on = |name: &str| &stages.iter().find(|stage| stage["name"] == name).unwrap()["on"];
    assert_eq!((on("simulate"), on("lattice, skin, incision")), (&"gpu".into(), &"cpu".into()));
    let page = std::fs::read_to_string(desk.path("run/report.html")).unwrap();
    assert!(page.contains(name) && page.contains("on the GPU"));
    let warned = report["warnings"].to_string().contains("software device");
    assert_eq!(warned, adapters[0]["kind"] == "software");
}

/// A search for the state of rest solves its equations on the GPU that the run names, and ends
/// where the CPU does, within the errors that both state. Controls: tissue that is 5 % softer moves
/// farther, and other backends use no GPU.
#[test]
fn a_search_for_rest_on_a_gpu_says_so_and_ends_where_the_cpu_does() {
    let desk = Desk::new();
    let Some(adapters) = adapters(&desk) else { return };
    let name = adapters[0]["name"].as_str().unwrap();
    let part = name.split(' ').next().unwrap().to_uppercase();
    let settle = |call: &str| {
        let call = format!("settle scene.toml --set output={{report=true}} --json {call}");
        parsed(desk.cutis(&words(&call)))
    };
    let gpu = settle(&format!("--out gpu --backend gpu --adapter {part}"));
    assert_eq!((&gpu["backend"]["name"], &gpu["backend"]["adapter"]), (&"gpu".into(), &name.into()));
    let on = |report: &Value| {
        let stages = report["stages"].as_array().unwrap();
        let search = stages.iter().find(|stage| stage["name"] == "search for the state of rest").unwrap();
        assert_eq!(search["on"], report["rest"]["equations_on"]);
        search["on"].as_str().unwrap().to_owned()
    };
    let cycles = |report: &Value| -> u64 {
        let steps = report["rest"]["steps"].as_array().unwrap();
        steps.iter().map(|step| step["cycles"].as_u64().unwrap()).sum()
    };
    assert_eq!(on(&gpu), "gpu");
    let in_device = |report: &Value| report["device_memory"].as_array().unwrap().len();
    assert_eq!((in_device(&gpu), &gpu["device_memory"][0]["part"]), (1, &"rest".into()));
    assert!(cycles(&gpu) > 1 && gpu["device"]["readbacks"].as_u64() > Some(cycles(&gpu)), "{gpu}");
    let page = std::fs::read_to_string(desk.path("gpu/report.html")).unwrap();
    assert!(page.contains("multigrid cycles on the GPU") && page.contains(name));

    let cpu = settle("--out cpu --backend cpu");
    assert_eq!((on(&cpu).as_str(), &cpu["device"], in_device(&cpu)), ("cpu", &Value::Null, 0));
    assert_eq!(on(&settle("--out reference --backend reference")), "cpu");
    let moved = |report: &Value| report["max_displacement_mm"].as_f64().unwrap();
    let error = |report: &Value| report["rest"]["error"].as_f64().unwrap();
    let apart = |report: &Value| (moved(report) / moved(&cpu) - 1.0).abs();
    let allowed = error(&gpu) + error(&cpu);
    assert!(allowed < 2e-3 && apart(&gpu) < allowed, "{} of {allowed}", apart(&gpu));
    let soft =
        "--set constraints.distance.youngs_modulus_pa=4.75e3 --set constraints.volume.bulk_modulus_pa=4.75e4";
    let control = settle(&format!("--out control --backend gpu {soft}"));
    assert!(apart(&control) > allowed, "{} of {allowed}", apart(&control));
}

/// Both backends give the same bits for every vertex and every opening.
#[test]
fn the_demo_on_a_software_gpu_equals_the_cpu() {
    let desk = Desk::new();
    let Some(adapters) = adapters(&desk) else { return };
    if adapters[0]["kind"] != "software" {
        eprintln!("skipped: {} may fuse operations; parity has the tolerance for it", adapters[0]["name"]);
        return;
    }
    let demo = |folder: &str, more: &[&str]| {
        let call = "demo --frames 3 --set volume.phantom.size=[64,64,48] --set lattice.spacing_mm=12 \
                    --set run.checkpoint_every=3 --set output={report=true} --out";
        desk.cutis(&[&words(call)[..], &[folder], more].concat()).expect_success();
        let state = std::fs::read(desk.path(folder).join("checkpoint.bin")).unwrap();
        let table = std::fs::read_to_string(desk.path(folder).join("frames.csv")).unwrap();
        let openings: Vec<String> = table
            .lines()
            .map(|line| line.split(',').enumerate().filter(|(n, _)| *n != 2).map(|(_, cell)| cell).collect())
            .collect();
        (state, openings)
    };
    let cpu = demo("cpu", &["--backend", "cpu"]);
    let gpu = demo("gpu", &["--backend", "gpu"]);
    assert!(cpu.0 == gpu.0, "the states differ");
    assert_eq!(cpu.1, gpu.1);
    let control =
        demo("control", &["--backend", "gpu", "--set", "constraints.membrane.tension_along_n_per_m=15.1"]);
    assert!(control.0[60..] != gpu.0[60..] && control.1 != gpu.1, "the comparison sees a small change");
}

/// Scenes that name no GPU or are too small for `auto` do not load Vulkan.
#[test]
fn vulkan_is_loaded_only_on_request() {
    let desk = Desk::new();
    if adapters(&desk).is_none() {
        return;
    }
    let speaks = |call: &str| {
        let done = desk.cutis_with(&TALKATIVE, &words(call)).expect_success();
        done.stderr.contains("vulkan") || done.stderr.contains("VK_")
    };
    for call in ["run scene.toml --backend cpu --out cpu", "run scene.toml --out auto", "check scene.toml"] {
        assert!(!speaks(call), "{call}");
    }
    if cfg!(target_os = "linux") {
        assert!(
            speaks("devices") && speaks("run scene.toml --backend gpu --set output={} --out gpu"),
            "the control"
        );
    }
    let printed = parsed(desk.cutis(&["check", "scene.toml", "--json"]));
    assert_eq!(printed["backend"]["name"], "cpu");
    assert!(printed["backend"]["reason"].as_str().unwrap().contains("too few"), "{}", printed["backend"]);
    assert!(printed["left_out"].to_string().contains("gpu: no device is opened"), "{}", printed["left_out"]);
}

/// Without a display session, a layer of Mesa prints errors although nothing is wrong.
#[cfg(target_os = "linux")]
#[test]
fn a_machine_without_a_display_session_prints_no_errors() {
    let desk = Desk::new();
    let done = desk.script("unset NODEVICE_SELECT XDG_RUNTIME_DIR; exec \"$cutis\" devices").expect_success();
    assert!(!done.stderr.contains("error"), "{}", done.stderr);
}
