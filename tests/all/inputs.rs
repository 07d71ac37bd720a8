//! The page on inputs tells the outcome of every volume of the test data.

use cutis_studies::inputs;
use cutis_studies::kit::results;
use cutis_test_kit::scans;

#[test]
fn the_page_on_inputs_has_the_outcome_of_every_volume() {
    if scans::find("dicom").is_none() || scans::find("awkward").is_none() {
        return;
    }
    let page = std::fs::read_to_string(results().join("inputs.md")).unwrap();
    let (tables, checks) = inputs::outcomes(&scans::folder()).unwrap();
    assert!(checks.pass(), "{}", checks.summary());
    for (name, table) in tables {
        let lines = table.markdown();
        assert!(lines.lines().count() > 7, "{name}: {lines}");
        assert!(page.contains(&lines), "`cargo xtask study inputs --write` updates this table:\n{lines}");
    }
}
