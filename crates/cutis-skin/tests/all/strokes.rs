//! Files of strokes: both formats, wrong values, and random bytes.

use cutis_skin::{Place, SkinError, Strokes};
use nalgebra::Point3;
use proptest::prelude::*;

fn parse(text: &str) -> Result<Strokes, SkinError> {
    Strokes::parse("langer.txt", text.as_bytes())
}

/// A file of 3D Slicer with these markups.
fn markups(list: &str) -> String {
    format!(
        r#"{{"@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#", "markups": [{list}]}}"#
    )
}

/// A markup with keys in addition to its type and two control points.
fn markup(kind: &str, more: &str) -> String {
    format!(
        r#"{{"type": "{kind}", {more} "controlPoints": [{{"id": "1", "position": [1.0, 2.0, 3.0], "positionStatus": "defined"}}, {{"position": [4, 5e0, -6.5], "orientation": [1,0,0,0,1,0,0,0,1]}}]}}"#
    )
}

fn points(strokes: &Strokes) -> Vec<Vec<[f64; 3]>> {
    let points = |points: &[Point3<f64>]| points.iter().map(|&point| point.into()).collect();
    strokes.polylines().iter().map(|polyline| points(polyline.points_mm())).collect()
}

#[test]
fn text_with_comments_header_and_several_strokes() {
    let text = "\u{feff}# Langer's lines\r\n x y z \r\n1 2 3\r\n# between\r\n4 5.5 -6e1 # end\r\n\r\n\t\r\n0 0 0\n0 0 1\n0 0 2";
    let strokes = parse(text).unwrap();
    assert_eq!(
        points(&strokes),
        [vec![[1.0, 2.0, 3.0], [4.0, 5.5, -60.0]], vec![[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0]]]
    );
    let places: Vec<Place> = strokes.polylines().iter().map(|polyline| polyline.place()).collect();
    assert_eq!(places, [Place::Line(3), Place::Line(8)]);
    assert_eq!((strokes.polylines()[1].length_mm(), strokes.warnings().len()), (2.0, 0));
}

#[test]
fn wrong_lines_are_named() {
    for (text, line, value) in [
        ("0 0 0\n1 2\n", 2, "2 numbers"),
        ("0 0 0 0\n", 1, "4 numbers"),
        ("0 0 0\n1 1,5 2\n", 2, "\"1,5\""),
        ("0 0 0\n1 nan 2\n", 2, "\"nan\""),
        ("0 0 0\n1 1e999 2\n", 2, "\"1e999\""),
        ("r a s\n1 2 3\n", 1, "\"r\""),
        ("0 0 0\nx y z\n", 2, "\"x\""),
        ("[0, 0, 0]", 1, "\"[0,\""),
    ] {
        let refused = parse(text).unwrap_err();
        assert!(matches!(refused, SkinError::StrokeFile { line: found, .. } if found == line), "{refused}");
        let message = refused.to_string();
        assert!(message.starts_with("langer.txt, line ") && message.contains(value), "{message}");
        assert!(message.contains("expected the coordinates x y z in mm"), "{message}");
    }
    let refused = Strokes::parse("langer.txt", b"0 0 0\n\xff 1 2\n").unwrap_err();
    assert!(matches!(refused, SkinError::StrokeFile { line: 2, .. }), "{refused}");
}

#[test]
fn strokes_without_two_different_points_are_refused() {
    for (text, points) in [("0 0 0\n1 1 1\n\n2 2 2\n", 1), ("0 0 1\n1 1 1\n\n2 2 2\n2 2 2\n", 2)] {
        let refused = parse(text).unwrap_err();
        assert!(
            matches!(refused, SkinError::StrokeTooShort { place: Place::Line(4), points: found, .. } if found == points),
            "{refused}"
        );
    }
    for text in ["", "\n\n# nothing\n", "x y z\n", "{\"markups\": []}"] {
        assert!(matches!(parse(text), Err(SkinError::NoStroke { .. })), "{text:?}");
    }
    let nan = Strokes::from_points("given", &[vec![[0.0; 3], [1.0, f64::NAN, 0.0]]]);
    assert!(matches!(nan, Err(SkinError::StrokePoint { place: Place::Number(0), point: 1, .. })));
    let one = Strokes::from_points("given", &[vec![[0.0; 3], [1.0; 3]], vec![[0.0; 3]]]);
    assert!(matches!(one, Err(SkinError::StrokeTooShort { place: Place::Number(1), .. })));
    assert!(matches!(Strokes::from_points("given", &[]), Err(SkinError::NoStroke { .. })));
}

#[test]
fn markups_in_both_coordinate_systems() {
    let lps = vec![[-1.0, -2.0, 3.0], [-4.0, -5.0, -6.5]];
    let ras = vec![[1.0, 2.0, 3.0], [4.0, 5.0, -6.5]];
    for (keys, expected) in [
        ("", &lps),
        (r#""coordinateSystem": "LPS", "coordinateUnits": "mm","#, &lps),
        (r#""coordinateSystem": "1","#, &lps),
        (r#""coordinateSystem": 1,"#, &lps),
        (r#""coordinateSystem": "RAS", "coordinateUnits": ["mm", "UCUM", "millimeter"],"#, &ras),
        (r#""coordinateSystem": "0","#, &ras),
        (r#""coordinateSystem": 0, "locked": false, "display": {"color": [0.4, 1.0, 1.0]},"#, &ras),
    ] {
        for kind in ["Curve", "Line", "ClosedCurve"] {
            let strokes = parse(&markups(&markup(kind, keys))).unwrap();
            assert_eq!(points(&strokes), std::slice::from_ref(expected), "{keys} {kind}");
        }
    }
}

#[test]
fn closed_curves_end_where_they_begin_and_other_markups_are_skipped() {
    let points_of = |extra: &str| {
        format!(
            r#""controlPoints": [{{"position": [0, 0, 0]}}, {extra} {{"position": [1, 0, 0]}}, {{"position": [0, 0, 1]}}]"#
        )
    };
    let unplaced = r#"{"position": "", "positionStatus": "undefined"}, {"position": [9, 9, 9], "positionStatus": "preview"},"#;
    let list = [
        r#"{"type": "Fiducial", "controlPoints": [{"position": [7, 7, 7]}]}"#.to_owned(),
        format!(r#"{{"coordinateSystem": "RAS", {}, "type": "ClosedCurve"}}"#, points_of(unplaced)),
        r#"{"type": "ROI", "center": [0, 0, 0]}"#.to_owned(),
        format!(r#"{{"coordinateSystem": "RAS", {}, "type": "Curve"}}"#, points_of("")),
    ];
    let strokes = parse(&markups(&list.join(", "))).unwrap();
    let open = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let closed = [open.clone(), vec![[0.0; 3]]].concat();
    assert_eq!(points(&strokes), [closed, open]);
    assert_eq!(strokes.polylines()[1].place(), Place::Markup(3));
    let warnings = strokes.warnings().join("\n");
    assert_eq!(strokes.warnings().len(), 2);
    assert!(
        warnings.contains("2 markups")
            && warnings.contains("markups[0]")
            && warnings.contains("2 control points")
    );
}

#[test]
fn wrong_values_in_markups_are_named() {
    let point = |position: &str| {
        markups(&format!(
            r#"{{"type": "Curve", "controlPoints": [{{"position": [0, 0, 0]}}, {{{position}}}]}}"#
        ))
    };
    let in_point = "markups[0].controlPoints[1]";
    for (text, place, expected) in [
        (
            markups(&markup("Curve", r#""coordinateSystem": "IJK","#)),
            "markups[0].coordinateSystem is \"IJK\"",
            "\"RAS\"",
        ),
        (
            markups(&markup("Curve", r#""coordinateUnits": "um","#)),
            "markups[0].coordinateUnits is \"um\"",
            "\"mm\"",
        ),
        (
            markups(&markup("Curve", r#""coordinateUnits": ["mm", "SI", ""],"#)),
            "\"mm\" of \"SI\"",
            "expected \"mm\"",
        ),
        (markups(r#"{"controlPoints": []}"#), "markups[0]", "type"),
        (markups("5"), "markups[0]", "Markup"),
        (point(r#""position": [1, 2]"#), in_point, "three numbers in mm"),
        (point(r#""position": [1, 2, 3, 4]"#), in_point, "three numbers in mm"),
        (point(r#""position": "1 2 3""#), in_point, "three numbers in mm"),
        (point(r#""position": [1, "2", 3]"#), in_point, "f64"),
        (point(r#""position": [1, 1e999, 3]"#), in_point, "number out of range"),
        (point(r#""position": 1"#), in_point, "three numbers in mm"),
        (point(r#""id": "2""#), in_point, "three numbers in mm"),
        (point(r#""position": [1, 2, 3], "positionStatus": "set""#), in_point, "\"defined\""),
        (r#"{"markups": {}}"#.to_owned(), "", "a list of markups"),
        (r#"{"points": []}"#.to_owned(), "", "`markups`"),
        (r#"{"@schema": "markups-schema-v2.0.0.json", "markups": []}"#.to_owned(), "`@schema`", "v1."),
        ("{\"markups\": [\n\n{]".to_owned(), "line 3", "key"),
    ] {
        let refused = parse(&text).unwrap_err();
        assert!(matches!(refused, SkinError::StrokeFile { .. }), "{refused}");
        let message = refused.to_string();
        assert!(message.starts_with("langer.txt, line ") && !message.contains("column"), "{message}");
        assert!(message.contains(place) && message.contains(expected), "{message}");
    }
    let short = markups(r#"{"type": "Curve", "controlPoints": [{"position": [0, 0, 0]}]}"#);
    let refused = parse(&short).unwrap_err();
    assert!(
        matches!(refused, SkinError::StrokeTooShort { place: Place::Markup(0), points: 1, .. }),
        "{refused}"
    );
}

#[test]
fn files_are_read_and_missing_or_large_ones_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("curve.mrk.json");
    std::fs::write(&path, markups(&markup("Line", ""))).unwrap();
    assert_eq!(Strokes::read(&path).unwrap().path(), path);
    let missing = Strokes::read(folder.path().join("none.txt")).unwrap_err();
    assert!(
        matches!(&missing, SkinError::StrokeRead { path, .. } if path.ends_with("none.txt")),
        "{missing}"
    );
    std::fs::File::create(&path).unwrap().set_len(Strokes::MAX_BYTES as u64 + 1).unwrap();
    let large = Strokes::read(&path).unwrap_err();
    assert!(matches!(large, SkinError::StrokeFileSize { unit: "bytes", .. }), "{large}");
}

#[test]
fn hostile_files_are_refused() {
    let lines = "0 0 0\n0 0 1\n".repeat(Strokes::MAX_POINTS / 2 + 1);
    assert!(matches!(parse(&lines), Err(SkinError::StrokeFileSize { unit: "points", .. })));
    let points = r#"{"position":[0,0,0]},"#.repeat(Strokes::MAX_POINTS);
    let curve = markups(&format!(r#"{{"type":"Curve","controlPoints":[{points}{{"position":[1,0,0]}}]}}"#));
    assert!(matches!(parse(&curve), Err(SkinError::StrokeFileSize { unit: "points", .. })));
    let deep = format!("{{\"markups\": {}", "[".repeat(1_000_000));
    assert!(matches!(parse(&deep), Err(SkinError::StrokeFile { .. })));
    let ignored = format!("{{\"x\": {}{}, \"markups\": []}}", "[".repeat(1000), "]".repeat(1000));
    assert!(matches!(parse(&ignored), Err(SkinError::NoStroke { .. })));
    let long = format!("0 0 {}\n", "9".repeat(100_000));
    assert!(parse(&long).unwrap_err().to_string().len() < 300);
    let long = markups(&markup("Curve", &format!(r#""coordinateSystem": "{}","#, "é".repeat(100_000))));
    assert!(parse(&long).unwrap_err().to_string().len() < 300);
}

/// Bytes of which many form valid parts of a file.
fn nearly_valid() -> impl Strategy<Value = Vec<u8>> {
    let pieces = [
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        "\"markups\"",
        "\"type\"",
        "\"Curve\"",
        "\"controlPoints\"",
        "\"position\"",
        "\"positionStatus\"",
        "\"undefined\"",
        "\"coordinateSystem\"",
        "\"LPS\"",
        "0",
        "-1.5e3",
        "null",
        " ",
        "\n",
        "\n\n",
        "0 0 0\n",
        "1 2 3\n",
        "# a",
        "x y z\n",
        "1e400",
        "\u{feff}",
        "é",
        "\\u0000",
        "\"",
    ];
    let piece = prop_oneof![
        8 => prop::sample::select(pieces.to_vec()).prop_map(|piece| piece.as_bytes().to_vec()),
        1 => prop::collection::vec(any::<u8>(), 0..4),
    ];
    prop::collection::vec(piece, 0..40).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn no_bytes_panic(random in prop::collection::vec(any::<u8>(), 0..200), pieces in nearly_valid()) {
        for bytes in [random, pieces] {
            if let Ok(strokes) = Strokes::parse("random", &bytes) {
                prop_assert!(strokes.polylines().iter().all(|stroke| stroke.length_mm() > 0.0));
            }
        }
    }

    /// Damaged markups give an error or strokes, and undamaged ones are read.
    #[test]
    fn no_damage_panics(at in 0usize..400, with in any::<u8>(), cut in 0usize..400) {
        let text = markups(&[markup("Curve", ""), markup("ClosedCurve", r#""coordinateUnits": "mm","#)].join(","));
        prop_assert!(parse(&text).is_ok());
        let mut bytes = text.into_bytes();
        let place = at % bytes.len();
        bytes[place] = with;
        let _ = Strokes::parse("damaged", &bytes);
        bytes.truncate(cut);
        prop_assert!(Strokes::parse("cut", &bytes).is_err());
    }
}
