//! A short campaign for every reader, and readers with faults that a campaign must find.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::campaign::ACCEPTED;
use crate::{Campaign, Limits, TARGETS, Target, find, require_no_fault, run, run_input, write_corpus};

fn campaign(target: &Target, inputs: usize) -> Campaign {
    run(target, &Limits { inputs, time: Duration::from_secs(60), seed: 1 }).unwrap()
}

/// `cargo xtask fuzz` tries more.
#[test]
fn no_input_makes_a_reader_panic_hang_or_take_much_memory() {
    for target in TARGETS {
        let campaign = campaign(target, 1000);
        for fault in &campaign.faults {
            eprintln!("{}: {}: {:?}", target.name, fault.what, String::from_utf8_lossy(&fault.input));
        }
        assert!(campaign.faults.is_empty(), "{}", target.name);
        // The generator makes valid inputs, and invalid ones of many kinds.
        let Campaign { inputs, accepted, outcomes, .. } = campaign;
        assert!(
            accepted >= 2 && inputs - accepted >= 10 && outcomes >= 5,
            "{}: {accepted} of {inputs}, {outcomes}",
            target.name
        );
    }
}

/// The seeds are valid, except two images that are too short for their size.
#[test]
fn seeds_are_accepted() {
    for target in TARGETS {
        let seeds = (target.seeds)();
        let refused = if target.name == "dicom" { 2 } else { 0 };
        let folder = tempfile::tempdir().unwrap();
        (target.prepare)(folder.path()).unwrap();
        let path = folder.path().join(target.file);
        let said: Vec<String> = seeds
            .iter()
            .map(|seed| {
                std::fs::write(&path, seed).unwrap();
                (target.read)(&path, seed).unwrap()
            })
            .collect();
        let accepted = said.iter().filter(|said| *said == ACCEPTED).count();
        assert_eq!(accepted + refused, seeds.len(), "{}: {said:#?}", target.name);
    }
}

/// Messages once quoted a key of a megabyte.
#[test]
fn long_keys_are_quoted_in_part() {
    let long = "9".repeat(100_000);
    for (target, text) in [
        ("set", format!("incision[{long}].depth_mm=1")),
        ("set", format!("run.a{long}=1")),
        ("scene", format!("[volume]\na{long} = 1\n")),
    ] {
        let target = find(target).unwrap();
        assert_eq!(run_input(target, text.as_bytes()).unwrap(), None, "{}", target.name);
    }
}

/// The manifest, the targets and their corpora name every reader, and no other.
#[test]
fn every_reader_is_a_target_of_cargo_fuzz() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("libfuzzer");
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
    let corpora = tempfile::tempdir().unwrap();
    write_corpus(corpora.path()).unwrap();
    for Target { name, seeds, .. } in TARGETS {
        assert!(manifest.contains(&format!("path = \"targets/{name}.rs\"")), "{name} is not in the manifest");
        let text = std::fs::read_to_string(folder.join(format!("targets/{name}.rs"))).unwrap();
        assert!(text.contains(&format!("require_no_fault(\"{name}\", input)")), "{name}: {text}");
        assert_eq!(std::fs::read_dir(corpora.path().join(name)).unwrap().count(), seeds().len(), "{name}");
    }
    assert_eq!(manifest.matches("[[bin]]").count(), TARGETS.len());
}

#[test]
#[should_panic(expected = "there is no reader other")]
fn a_target_without_a_reader_fails() {
    require_no_fault("other", b"");
}

/// A reader for the controls. Its inputs begin with a length.
fn planted(read: fn(&Path, &[u8]) -> Result<String, String>) -> Target {
    Target {
        name: "planted",
        file: "input.bin",
        seeds: || vec![vec![4, 0, 1, 2, 3, 4]],
        words: &[],
        prepare: |_| Ok(()),
        read,
        memory_per_byte: 16,
    }
}

#[test]
fn faults_are_found() {
    type Read = fn(&Path, &[u8]) -> Result<String, String>;
    let faults: [(&str, Read); 4] = [
        ("panic", |_, input| Ok(input[2 + usize::from(input[0])..].len().to_string())),
        ("allocated", |_, input| {
            let length = input.first().copied().map_or(0, usize::from) << 20;
            Ok(Vec::<u8>::with_capacity(length).capacity().to_string())
        }),
        ("took", |_, input| {
            let start = Instant::now();
            while input.first() == Some(&0xff) && start.elapsed() < Duration::from_millis(2500) {}
            Ok(ACCEPTED.into())
        }),
        ("not named", |_, input| match input.len() {
            6 => Ok(ACCEPTED.into()),
            _ => Err("not named".into()),
        }),
    ];
    for (what, read) in faults {
        let campaign = campaign(&planted(read), 2000);
        let found = campaign.faults.first().unwrap_or_else(|| panic!("no fault of the sort {what:?}"));
        assert!(found.what.contains(what), "{what}: {}", found.what);
    }
    // Control: a reader without a fault.
    let sound = campaign(&planted(|_, input| Ok(format!("{} bytes", input.len()))), 2000);
    assert!(sound.faults.is_empty() && sound.inputs == 2000, "{:?}", sound.faults);
}
