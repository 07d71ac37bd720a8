//! Tables that do not fit the body or the scene, and presets on the phantom and on real scans.

use cutis::{Error, LoadedScene, Silent};

use super::table::{LAYERS, Row, small, toml};
use crate::scenes::{SMALL, overrides, real, scene};

fn refusal(loaded: &LoadedScene) -> String {
    match cutis::check(loaded, &Silent).unwrap_err() {
        error @ Error::SceneKey { .. } => {
            assert!(error.is_bad_input(), "{error}");
            error.to_string()
        }
        other => panic!("{other}"),
    }
}

/// The message names the HU and the depth of a vertex without a row, and the rows next to it.
#[test]
fn a_vertex_without_a_row_is_named() {
    let no_rest: Vec<Row> = LAYERS[..4].to_vec();
    let text = refusal(&small(&no_rest, &[]));
    for words in ["`materials`", " HU, ", "below the skin", "vertices in all", "`muscle`"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let only_bone = [LAYERS[1]];
    let text = refusal(&small(&only_bone, &[]));
    assert!(text.contains("materials[0] (`bone`: 250 to 4000 HU, any mm)"), "{text}");
    assert!(!text.contains("below the skin"), "{text}");
    // Control: the same rows with one for the rest.
    cutis::check(&small(&[LAYERS[1], LAYERS[4]], &[]), &Silent).unwrap();
}

#[test]
fn tables_without_effect_cause_a_warning() {
    let warns = |set: &[(&str, &str)], words: &str| {
        let plan = cutis::check(&small(&LAYERS, set), &Silent).unwrap();
        plan.warnings.iter().any(|warning| warning.contains(words))
    };
    let no_effect = "materials have no effect";
    assert!(!warns(&[], no_effect));
    assert!(warns(&[("solver.formulation", "pbd")], no_effect));
    assert!(warns(&[("model", "chainmail")], no_effect));
    let mut loaded = small(&LAYERS, &[]);
    loaded.scene.constraints.remove("distance");
    loaded.scene.constraints.remove("volume");
    let plan = cutis::check(&loaded, &Silent).unwrap();
    assert!(plan.warnings.iter().any(|warning| warning.contains(no_effect)));
}

#[test]
fn a_layer_thinner_than_the_lattice_step_causes_a_warning() {
    let warning = |rows: &[Row]| {
        let plan = cutis::check(&small(rows, &[]), &Silent).unwrap();
        plan.warnings.into_iter().find(|warning| warning.contains("thinner than the lattice step"))
    };
    let text = warning(&LAYERS).unwrap();
    assert!(
        text.starts_with("materials[0] (`skin`)") && text.contains("spacing_mm of 5.0 or less"),
        "{text}"
    );
    let mut thick = LAYERS;
    thick[0].depth_mm = Some([0.0, 12.0]);
    thick[3].depth_mm = Some([12.0, 31.0]);
    assert!(warning(&thick).is_none());
    // The presets are meant for lattices that are coarser than skin.
    let preset = cutis::check(&small(&[], &[("materials", "\"layered\"")]), &Silent).unwrap();
    assert!(!preset.warnings.iter().any(|warning| warning.contains("thinner than the lattice step")));
    assert!(preset.materials.iter().any(|row| row.name == "skin"));
}

/// Every preset holds all of the phantom and of real scans, and its table is reported with sources.
#[test]
fn presets_hold_whole_bodies() {
    let scans = ["ct/abdomen_ts_64x53x58.nii.gz", "ct/leg_sts013_64x55x58.nii.gz"];
    let scans = scans.map(real).into_iter().flatten().map(|path| format!("{{ path = {path:?} }}"));
    let volumes: Vec<String> =
        ["{ phantom = { size = [64, 64, 48], seed = 2 } }".into()].into_iter().chain(scans).collect();
    for volume in &volumes {
        for preset in ["layered", "trunk", "limb", "head"] {
            let set = [
                ("volume", volume.as_str()),
                ("incision", "[]"),
                ("fixed", "{ end_layers = [\"k\"] }"),
                ("materials", preset),
                ("constraints.distance", "{}"),
                ("constraints.volume", "{}"),
            ];
            let plan = cutis::check(&scene(SMALL, &set), &Silent).unwrap();
            let rows = &plan.materials;
            let vertices: usize = rows.iter().map(|row| row.vertices).sum();
            assert_eq!(vertices, plan.sizes.vertices, "{preset}");
            assert!(rows.iter().map(|row| row.tets).sum::<usize>() < plan.sizes.tets, "{preset}");
            let named = |name: &str| rows.iter().any(|row| row.name == name && row.vertices > 0);
            assert!(named("skin") && named("fat") && named("bone"), "{preset}: {rows:?}");
            assert!(rows.iter().all(|row| row.source.is_some()), "{preset}");
            // The thin skin of a preset is as it should be.
            assert!(
                !plan.warnings.iter().any(|line| line.contains("thinner than the lattice")),
                "{:?}",
                plan.warnings
            );
        }
    }
}

/// A value of a row can be overridden by its number, and a preset as a whole.
#[test]
fn rows_can_be_overridden() {
    let table = toml(&LAYERS);
    let set = |more: &[(&str, &str)]| {
        let of_table = [("materials", table.as_str()), ("constraints", "{ distance = {} }")];
        let path = crate::scenes::folder().join(SMALL);
        cutis::Scene::load(&path, &overrides(&[&of_table, more].concat()))
    };
    assert!(set(&[("materials[2].youngs_modulus_pa", "4e3")]).is_ok());
    let text = set(&[("materials.5.name", "no such row")]).unwrap_err().to_string();
    assert!(text.contains("one of the 5 entries"), "{text}");
    assert!(set(&[("materials", "limb")]).is_ok());
    assert!(set(&[("materials", "foot")]).unwrap_err().to_string().contains("layered, trunk, limb, head"));
}
