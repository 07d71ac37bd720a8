//! Paths of cuts from files: both frames, every type of markup, and files that are refused.

use cutis_skin::{DrawnPath, SkinError, Strokes};

const POINTS: &str = r#"[{"position": [1, 2, 3]}, {"position": [4, 5, 6]}, {"position": [7, 5, 6]}]"#;

fn markup(kind: &str, more: &str) -> String {
    format!(r#"{{"type": "{kind}", {more} "controlPoints": {POINTS}}}"#)
}

fn parse(list: &[String]) -> Result<DrawnPath, SkinError> {
    DrawnPath::parse("cut.mrk.json", format!(r#"{{"markups": [{}]}}"#, list.join(",")).as_bytes())
}

fn points(path: &DrawnPath) -> Vec<[f64; 3]> {
    path.points_mm().iter().map(|&point| point.into()).collect()
}

#[test]
fn a_path_has_the_frame_that_the_file_names() {
    let lps = [[-1.0, -2.0, 3.0], [-4.0, -5.0, 6.0], [-7.0, -5.0, 6.0]];
    let ras = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 5.0, 6.0]];
    for (more, expected) in [
        ("", lps),
        (r#""coordinateSystem": "LPS","#, lps),
        (r#""coordinateSystem": "RAS","#, ras),
        (r#""coordinateSystem": 0,"#, ras),
    ] {
        for kind in ["Curve", "Line", "Fiducial"] {
            assert_eq!(points(&parse(&[markup(kind, more)]).unwrap()), expected, "{kind} {more}");
        }
        let closed = points(&parse(&[markup("ClosedCurve", more)]).unwrap());
        assert_eq!((closed.len(), closed[3]), (4, expected[0]));
    }
    let text = DrawnPath::parse("cut.txt", b"1 2 3\n4 5 6\n7 5 6\n").unwrap();
    assert_eq!(points(&text), ras);
}

#[test]
fn a_list_of_points_is_a_path_but_no_stroke() {
    let file = format!(r#"{{"markups": [{}]}}"#, markup("Fiducial", ""));
    assert!(DrawnPath::parse("a.mrk.json", file.as_bytes()).is_ok());
    let refused = Strokes::parse("a.mrk.json", file.as_bytes()).unwrap_err();
    assert!(matches!(refused, SkinError::NoStroke { .. }), "{refused}");
}

#[test]
fn other_markups_are_skipped_with_a_warning() {
    let path = parse(&[markup("Plane", ""), markup("Curve", ""), markup("ROI", "")]).unwrap();
    assert_eq!(path.points_mm().len(), 3);
    let [warning] = path.warnings() else { panic!("{:?}", path.warnings()) };
    assert!(warning.contains("2 markups") && warning.contains("markups[0]") && warning.contains("Fiducial"));
}

#[test]
fn wrong_files_are_refused_by_name() {
    let several = parse(&[markup("Angle", ""), markup("Curve", ""), markup("Fiducial", "")]).unwrap_err();
    assert!(matches!(several, SkinError::SeveralPaths { count: 2, .. }), "{several}");
    for (list, said) in [
        (vec![markup("Curve", ""), markup("Line", "")], "markups[0] and markups[1]"),
        (vec![], "Fiducial"),
        (vec![markup("Plane", "")], "no stroke"),
        (vec![markup("Fiducial", r#""coordinateUnits": "cm","#)], "cm"),
        (vec![markup("Line", r#""coordinateSystem": "IJK","#)], "IJK"),
        (vec![markup("Curve", "").replace("[4, 5, 6]", "[4, 5]")], "controlPoints[1]"),
        (vec![markup("Curve", "").replace("[4, 5, 6]", "[4, 5, 1e999]")], "line 1"),
        (vec![markup("Fiducial", "").replace(POINTS, r#"[{"position": [1, 2, 3]}]"#)], "1 points"),
    ] {
        let message = parse(&list).unwrap_err().to_string();
        assert!(message.contains("cut.mrk.json") && message.contains(said), "{message}");
    }
    let many: String = (0..=DrawnPath::MAX_POINTS).map(|n| format!("{n} 0 0\n")).collect();
    let refused = DrawnPath::parse("cut.txt", many.as_bytes()).unwrap_err();
    assert!(matches!(refused, SkinError::StrokeFileSize { unit: "points", .. }), "{refused}");
    let missing = DrawnPath::read("nowhere/cut.mrk.json").unwrap_err();
    assert!(missing.to_string().contains("nowhere/cut.mrk.json"), "{missing}");
}
