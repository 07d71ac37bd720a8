//! Every key of a scene refuses invalid values with a message that names file, key and value. The
//! keys come from the scene reference, so every new key is tested at once.

use std::path::Path;

use cutis::{Error, LoadedScene, Scene};

use crate::scenes::overrides;

/// A scene with every section but sutures, so that each key can be set on its own.
const EVERYTHING: &str = r#"
model = "chainmail"
[volume]
phantom = { size = [8, 8, 8] }
[tissue]
air_below_hu = 2
cut_planes = [{ point_mm = [0, 0, 0], normal = [0, 0, 1] }]
[constraints.distance]
youngs_modulus_pa = 1e4
[constraints.volume]
bulk_modulus_pa = 1e5
[constraints.stc]
area_modulus_n_per_m = 50
near_incision = { radius_mm = 10 }
[constraints.membrane]
preset = "arm"
tension_along_n_per_m = 0
tension_across_n_per_m = 0
modulus_along_n_per_m = 50
modulus_across_n_per_m = 30
directions = { along = [0, 0, 1] }
[constraints.contact]
[constraints.adhesion]
[chainmail]
materials = [{ from_hu = -1024, shortest = 0.5, longest = 1.5, shear = 0.5 }]
[fixed]
boxes = [{ min_mm = [0, 0, 0], max_mm = [1, 1, 1] }]
planes = [{ point_mm = [0, 0, 0], normal = [0, 0, 1] }]
[[incision]]
from_mm = [0, 0, 0]
to_mm = [1, 0, 0]
depth_mm = 2
width_mm = 1
[[undermining]]
wound = 1
distance_mm = 1
depth_mm = 1
at_s = 2
adheres = true
[[excision]]
path_mm = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]]
depth_mm = 2
[[handle]]
at_mm = [0, 0, 0]
radius_mm = 1
move_mm = [1, 0, 0]
[solver]
dt_s = 0.1
"#;

/// The section that the scene with every section cannot have: ChainMail knows no sutures.
const SUTURE: &str = r#"
[[suture]]
wound = 0
every_mm = 1
depth_mm = 0.5
"#;

/// The section that replaces the moduli of the constraint kinds.
const MATERIALS: &str = r#"
[[materials]]
name = "skin"
hu = [0, 2]
depth_mm = [0, 2]
youngs_modulus_pa = 6e3
bulk_modulus_pa = 6e4
source = "nobody"
[[materials]]
name = "rest"
youngs_modulus_pa = 6e3
bulk_modulus_pa = 6e4
"#;

/// The scene with every section, and with `materials` in place of the moduli of the constraint
/// kinds.
fn with_materials() -> String {
    EVERYTHING.replace("youngs_modulus_pa = 1e4\n", "").replace("bulk_modulus_pa = 1e5\n", "") + MATERIALS
}

/// The scene with the other model and a suture.
fn with_suture() -> String {
    EVERYTHING.replace("\"chainmail\"", "\"pbd\"").replace("width_mm = 1\n", "") + SUTURE
}

/// The scene with every section. Overrides of `materials` and `suture` change the scene that has
/// them. A speed is for an incision without a width.
fn parse(set: &[(&str, &str)]) -> Result<LoadedScene, Error> {
    let sets = |section: &str| set.iter().any(|(key, _)| key.starts_with(section));
    let without_width = sets("suture") || sets("incision.0.speed_mm_s");
    let text = match (sets("materials"), without_width) {
        (true, _) => with_materials(),
        (false, true) => with_suture(),
        (false, false) => EVERYTHING.to_owned(),
    };
    Scene::parse(&text, Path::new("every.toml"), Path::new(""), &overrides(set))
}

/// For every row of the reference: the key as `--set` accepts it, the key as messages name it, and
/// the type of its value.
fn keys() -> Vec<(String, String, String)> {
    let mut keys = Vec::new();
    let (mut path, mut name) = (String::new(), String::new());
    for line in cutis::scene::reference().lines() {
        if let Some(heading) = line.strip_prefix("##") {
            let heading = heading.trim_matches(['#', ' ', '`']);
            let section = heading.trim_matches(['[', ']']);
            let list = heading.starts_with("[[");
            path = if list { format!("{section}.0.") } else { format!("{section}.") };
            name = if list { format!("{section}[0].") } else { format!("{section}.") };
            if !heading.starts_with('[') {
                (path, name) = Default::default();
            }
        } else if let Some((key, rest)) = line.strip_prefix("| `").and_then(|row| row.split_once("` | ")) {
            let kind = rest.split(" | ").next().unwrap_or_default();
            keys.push((format!("{path}{key}"), format!("{name}{key}"), kind.to_owned()));
        }
    }
    keys
}

/// Fails unless the value of `key` is refused with a message that names file, key and value.
fn refused(key: &str, name: &str, value: &str) -> Result<(), String> {
    let Err(error) = parse(&[(key, value)]) else { return Err(format!("{key} = {value} was accepted")) };
    let Error::SceneKey { key: found, .. } = &error else {
        return Err(format!("{key} = {value}: {error:?}"));
    };
    // The message may name a wrong value inside a list or a table by its own key.
    if !found.starts_with(name) && !name.starts_with(found.as_str()) {
        return Err(format!("{key} = {value}: names {found}: {error}"));
    }
    let text = error.to_string();
    if !text.contains("every.toml") || !error.is_bad_input() {
        return Err(format!("{key} = {value}: {text}"));
    }
    Ok(())
}

#[test]
fn the_scene_with_everything_is_valid_and_has_every_section() {
    parse(&[]).unwrap();
    let keys = keys();
    assert!(keys.len() > 60, "{} keys: the reference is not read", keys.len());
    for (key, _, kind) in keys.iter().filter(|(_, _, kind)| kind == "number") {
        // 1 is a valid number for every key.
        let set = parse(&[(key, "1.0")]);
        // The scene has a phantom, which has no offset.
        let other = key.starts_with("lattice.") || key == "volume.offset_hu";
        assert!(set.is_ok() || other, "{key} ({kind}): {:?}", set.err());
    }
}

#[test]
fn nan_infinity_and_wrong_types_are_refused() {
    let mut failures = Vec::new();
    for (key, name, kind) in keys() {
        let values: &[&str] = match kind.as_str() {
            "number" => &["nan", "inf", "-inf", "\"text\"", "true", "[1.0]", "{ a = 1 }"],
            "number or [number, number, number]" => {
                &["nan", "-0.1", "inf", "[1, nan, 1]", "[1, 1, -0.1]", "[1, 1]", "\"text\"", "true"]
            }
            "[number, number, number]" => {
                &["[nan, 0, 0]", "[0, inf, 0]", "[0, 0, -inf]", "[1, 2]", "[1, 2, 3, 4]", "1.0", "\"text\""]
            }
            "list of [number, number, number]" => &["1.0", "[1]", "[[1, 2]]", "[[1, 2, 3, 4]]", "\"text\""],
            "[number, number]" => {
                &["[nan, 0]", "[0, inf]", "[-inf, 0]", "[1]", "[1, 2, 3]", "1.0", "\"text\""]
            }
            "[whole number, whole number, whole number]" => {
                &["[-1, 2, 2]", "[1.5, 2, 2]", "[2, 2]", "2", "[2, 2, nan]"]
            }
            "whole number" => &["-1", "1.5", "nan", "\"text\"", "[1]", "99999999999999999999"],
            "boolean" => &["1", "\"true\"", "[true]"],
            "string" => &["1", "[\"a\"]"],
            "whole number or string" => &["-1", "1.5", "99", "\"unheard of\"", "[1]"],
            _ if kind.starts_with("list of [[") => {
                &["1.0", "[1]", "[[[1, 2, 3]]]", "[[[0, 0, 0], [0, 0, nan]]]"]
            }
            _ if kind.starts_with("section") => &["1", "\"text\"", "{ unheard_of = 1 }"],
            _ if kind.starts_with("list of sections") => &["1", "\"text\"", "[1]", "[{ unheard_of = 1 }]"],
            _ if kind.starts_with("string or list") => &["1", "[1]", "[[1]]", "[[\"a\", 1]]"],
            _ if kind.starts_with("list of `") => &["[\"unheard of\"]", "\"i\"", "1"],
            _ if kind.starts_with('`') => &["\"unheard of\"", "1", "[]"],
            other => panic!("{key}: unknown kind {other}"),
        };
        failures.extend(values.iter().filter_map(|value| refused(&key, &name, value).err()));
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn numbers_out_of_range_are_refused() {
    let positive = [
        "lattice.spacing_mm",
        "constraints.distance.youngs_modulus_pa",
        "constraints.volume.bulk_modulus_pa",
        "materials.0.youngs_modulus_pa",
        "materials.1.bulk_modulus_pa",
        "constraints.stc.area_modulus_n_per_m",
        "constraints.stc.rest_area_scale",
        "constraints.membrane.modulus_along_n_per_m",
        "constraints.membrane.modulus_across_n_per_m",
        "constraints.stc.near_incision.radius_mm",
        "constraints.stc.near_incision.rest_area_factor",
        "constraints.stc.near_incision.stiffness_factor",
        "incision.0.depth_mm",
        "incision.0.width_mm",
        "handle.0.radius_mm",
        "handle.0.over_s",
        "solver.dt_s",
    ];
    let shares = [
        "constraints.distance.stiffness",
        "constraints.volume.stiffness",
        "constraints.stc.stiffness",
        "constraints.membrane.stiffness",
        "constraints.membrane.compression",
    ];
    let others = [
        ("constraints.stc.amplification", "-0.5"),
        ("constraints.membrane.preset", "nose"),
        ("constraints.membrane.stiffening", "-1"),
        ("constraints.membrane.tension_along_n_per_m", "-1"),
        ("constraints.membrane.tension_along_n_per_m", "50"),
        ("constraints.membrane.tension_across_n_per_m", "30.5"),
        ("constraints.membrane.directions.along", "[0, 0, 0]"),
        ("solver.damping_per_s", "-1"),
        ("solver.substeps", "0"),
        ("solver.iterations", "0"),
        ("solver.threads", "1025"),
        ("lattice.vertices", "[1, 8, 8]"),
        ("tissue.cut_planes.0.normal", "[0, 0, 0]"),
        ("fixed.planes.0.normal", "[0, 0, 0]"),
        ("fixed.boxes.0.max_mm", "[1, -1, 1]"),
        ("incision.0.to_mm", "[0, 0, 0]"),
        ("tissue.air_below_hu", "1e300"),
        ("fixed.bone_above_hu", "-1e300"),
        ("incision.0.at_s", "-0.1"),
        ("incision.0.at_s", "6"),
        ("materials", "[]"),
        ("materials", "unheard of"),
        ("materials.0.name", "\" \""),
        ("materials.0.hu", "[2, 2]"),
        ("materials.1.hu", "[2, 1]"),
        ("materials.0.depth_mm", "[-1, 2]"),
        ("materials.0.depth_mm", "[2, 0]"),
        ("chainmail.materials", "[]"),
        ("chainmail.materials.0.from_hu", "3"),
        ("chainmail.materials.0.shortest", "1.1"),
        ("chainmail.materials.0.longest", "[2, 2, 0.9]"),
        ("chainmail.materials.0.longest", "17"),
        ("chainmail.materials.0.shear", "[17, 1, 1]"),
        ("chainmail.materials.0.k_steps", "-1"),
        ("chainmail.materials.0.k_steps", "5000"),
    ];
    let rows = positive.iter().flat_map(|&key| [(key, "0"), (key, "-1.5")]);
    let rows = rows.chain(shares.iter().flat_map(|&key| [(key, "-0.1"), (key, "1.1")])).chain(others);
    let name = |key: &str| key.replace(".0.", "[0].").replace(".1.", "[1].");
    let failures: Vec<String> =
        rows.filter_map(|(key, value)| refused(key, &name(key), value).err()).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));

    // The message shows the value as a person would write it.
    for (key, value, shown) in [
        ("solver.dt_s", "-1.5", "-1.5"),
        ("solver.dt_s", "-1e300", "-1e300"),
        ("solver.substeps", "0", "= 0"),
        ("handle.0.at_mm", "[0, nan, 0]", "[0.0, NaN, 0.0]"),
        ("solver.backend", "tpu", "\"tpu\""),
    ] {
        let text = parse(&[(key, value)]).unwrap_err().to_string();
        assert!(text.contains(shown), "{text}");
    }
}

#[test]
fn contradicting_values_are_refused() {
    let moduli = ["constraints.distance.youngs_modulus_pa", "constraints.volume.bulk_modulus_pa"];
    let cases: [(&[(&str, &str)], &str); 13] = [
        (&[("materials", "layered"), (moduli[0], "1e4")], moduli[0]),
        (&[("materials", "layered"), (moduli[1], "1e5")], moduli[1]),
        (&[("constraints.distance", "{}")], moduli[0]),
        (&[("constraints.volume", "{ stiffness = 1.0 }")], moduli[1]),
        (&[("volume.path", "ct.nii")], "volume"),
        (&[("volume", "{}")], "volume"),
        (&[("volume", "{ path = \"\" }")], "volume.path"),
        (&[("lattice", "{ spacing_mm = 2.0, vertices = [8, 8, 8] }")], "lattice"),
        (&[("constraints.stc.form", "paper")], "constraints.stc.form"),
        (&[("constraints.membrane", "{ tension_along_n_per_m = 8 }")], "constraints.membrane"),
        (
            &[("constraints.membrane.directions", "{ along = [0, 0, 1], around = [0, 0, 1] }")],
            "constraints.membrane.directions",
        ),
        (&[("constraints.membrane.directions", "{}")], "constraints.membrane.directions"),
        (
            &[
                ("solver.formulation", "pbd"),
                ("constraints.stc.form", "paper"),
                ("constraints.stc.stiffness", "0"),
            ],
            "constraints.stc.stiffness",
        ),
    ];
    for (set, expected) in cases {
        match parse(set) {
            Err(Error::SceneKey { key, file, .. }) => {
                // The key is set by an override, or contradicts one.
                let files = ["every.toml", "every.toml, overridden"].map(Path::new);
                assert!(key == expected && files.contains(&&*file), "{key} in {}", file.display());
            }
            other => panic!("{set:?}: {other:?}"),
        }
    }
    parse(&[("solver.formulation", "pbd"), ("constraints.stc.form", "paper")]).unwrap();
    parse(&[("materials", "layered")]).unwrap();
    // The message names the other place of the modulus.
    for set in [&[("materials", "layered"), (moduli[0], "1e4")][..], &[("constraints.distance", "{}")]] {
        let text = parse(set).unwrap_err().to_string();
        assert!(text.contains("`materials`"), "{text}");
    }
}

#[test]
fn unknown_keys_are_refused_everywhere() {
    for (key, name, _) in keys() {
        let sibling = |key: &str| match key.rsplit_once('.') {
            Some((section, _)) => format!("{section}.unheard_of"),
            None => "unheard_of".into(),
        };
        refused(&sibling(&key), &sibling(&name), "1").unwrap();
    }
}

#[test]
fn overrides_of_missing_parents_are_refused() {
    for key in
        ["", ".", "incision.1.depth_mm", "incision.x.depth_mm", "incision.-1", "solver.dt_s.x", "run..frames"]
    {
        let error = parse(&[(key, "1")]).unwrap_err();
        assert!(matches!(error, Error::SceneKey { .. }), "{key}: {error:?}");
    }
    // This key is long enough to overflow the stack of a recursive parser.
    let long = vec!["a"; 100_000].join(".");
    let error = parse(&[(&long, "1")]).unwrap_err().to_string();
    assert!(error.contains("parts") && error.len() < 1000, "{error}");
    assert!("=1".parse::<cutis::Override>().is_err() && "frames".parse::<cutis::Override>().is_err());
}
