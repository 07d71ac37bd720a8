//! Reading a scene file or an override with random bytes ends with a scene or a typed error.

use std::path::Path;

use cutis::{Error, LoadedScene, Override, Scene};
use proptest::prelude::*;
use proptest::sample::{Index, select};

const DEMO: &str = include_str!("../../crates/cutis/src/scene/demo.toml");
const PIECES: [&str; 16] = [
    "[",
    "]",
    "[[",
    "{",
    "=",
    "\"",
    "'''",
    "\n",
    ".",
    "#",
    "nan",
    "-1e999",
    "[volume]\n",
    "frames = 1\n",
    "\u{0}",
    "é",
];
const KEYS: [&str; 16] = [
    "volume",
    "volume.phantom.size",
    "lattice.spacing_mm",
    "tissue.density",
    "constraints",
    "constraints.stc.form",
    "fixed.planes.0",
    "fixed.planes.0.normal",
    "incision",
    "incision.0",
    "incision.0.depth_mm",
    "solver.gravity_m_s2",
    "solver.threads",
    "run.frames",
    "output",
    "model",
];
const VALUES: [&str; 20] = [
    "{}",
    "[]",
    "[[]]",
    "0",
    "-1",
    "1",
    "18446744073709551616",
    "9223372036854775807",
    "nan",
    "-inf",
    "1e-320",
    "[1,2,3]",
    "[1e308,1e308,1e308]",
    "{ spacing_mm = 1 }",
    "\"\"",
    "true",
    "1979-05-27T07:32:00Z",
    "1\nframes = 2",
    "]",
    "\"",
];

fn parse(text: &str, overrides: &[Override]) -> Result<LoadedScene, Error> {
    Scene::parse(text, Path::new("random.toml"), Path::new(""), overrides)
}

/// An accepted scene can be written to a report and read back. An error must blame the input and
/// name its place.
fn ends_well(result: Result<LoadedScene, Error>) -> Result<(), TestCaseError> {
    match result {
        Ok(loaded) => {
            let text = serde_json::to_string(&loaded.scene).unwrap();
            prop_assert!(serde_json::from_str::<Scene>(&text).is_ok(), "{}", text);
        }
        Err(error) => {
            prop_assert!(error.is_bad_input() && error.to_string().contains("random.toml"), "{}", error)
        }
    }
    Ok(())
}

/// Keys of a scene, entries of its lists, deeper keys, and random text.
fn key() -> impl Strategy<Value = String> {
    let known = || select(&KEYS[..]).prop_map(String::from);
    prop_oneof![
        known(),
        (known(), ".{0,200}").prop_map(|(key, rest)| format!("{key}.{rest}")),
        "[a-z_.0-9]{0,40}"
    ]
}

/// Valid and invalid values, and random text.
fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        select(&VALUES[..]).prop_map(String::from),
        any::<f64>().prop_map(|v| format!("{v:?}")),
        ".{0,40}"
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_cause_no_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        ends_well(parse(&String::from_utf8_lossy(&bytes), &[]))?;
    }

    /// Text is inserted, deleted or repeated anywhere.
    #[test]
    fn a_damaged_scene_causes_no_panic(
        damage in proptest::collection::vec((any::<Index>(), any::<Index>(), select(&PIECES[..]), 0..4_u8), 1..6),
    ) {
        let mut text: Vec<char> = DEMO.chars().collect();
        for (at, to, piece, what) in damage {
            let (a, b) = (at.index(text.len() + 1), to.index(text.len() + 1));
            let (from, to) = (a.min(b), a.max(b));
            match what {
                0 => drop(text.splice(from..from, piece.chars())),
                1 => drop(text.drain(from..to.min(from + 20))),
                2 => {
                    let copy = text[from..to.min(from + 200)].to_vec();
                    drop(text.splice(to..to, copy));
                }
                _ => drop(text.splice(from..to.min(from + 3), piece.chars())),
            }
        }
        ends_well(parse(&text.into_iter().collect::<String>(), &[]))?;
    }

    #[test]
    fn random_overrides_cause_no_panic(set in proptest::collection::vec((key(), value()), 1..4)) {
        let overrides: Vec<Override> = set.into_iter().map(|(key, value)| Override { key, value }).collect();
        ends_well(parse(DEMO, &overrides))?;
    }
}

/// The generators above produce accepted and refused scenes.
#[test]
fn some_overrides_are_accepted_and_some_refused() {
    let set = |key: &str, value: &str| parse(DEMO, &[Override { key: key.into(), value: value.into() }]);
    assert!(set("run.frames", "1").is_ok() && set("incision", "[]").is_ok() && set("output", "{}").is_ok());
    assert!(set("run.frames", "-1").is_err() && set("incision.0", "1").is_err());
}
