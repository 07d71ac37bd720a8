//! Tests of mesh files: layout of the appended data, world frames, and refused input.

use std::path::Path;

use cutis_mesh::vtk::{Cells, DataArray, Piece, Space, Values, write_vtp, write_vtu};
use cutis_mesh::{Frame, MeshError};
use nalgebra::Point3;

const FRAME: Frame = Frame { origin_mm: Point3::new(100.0, 200.0, 300.0) };

fn positions() -> Vec<Point3<f32>> {
    // No cell uses vertex 1.
    [[0.0, 0.0, 0.0], [9.0, 9.0, 9.0], [0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.03]]
        .map(Point3::from)
        .to_vec()
}

/// The header, and the bytes of the appended array with a name.
fn array(path: &Path, name: &str) -> (String, Vec<u8>) {
    let bytes = std::fs::read(path).unwrap();
    let mark = b"encoding=\"raw\">\n_";
    let start = bytes.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
    let header = String::from_utf8(bytes[..start].to_vec()).unwrap();
    let tag = header.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).unwrap();
    let offset: usize = tag.split("offset=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    let block = &bytes[start + offset..];
    let length = u64::from_le_bytes(block[..8].try_into().unwrap()) as usize;
    (header, block[8..8 + length].to_vec())
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

fn numbers(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn tets_are_written_in_both_world_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tissue.vtu");
    let (positions, hu) = (positions(), [1.0, 2.0, 3.0, 4.0, 5.0]);
    let moved = [[0.5, 0.25, 0.125]; 5];
    let data = [
        DataArray { name: "hu", values: Values::Scalars(&hu) },
        DataArray { name: "displacement_mm", values: Values::Vectors(&moved) },
    ];
    let piece = Piece {
        frame: &FRAME,
        positions: &positions,
        cells: Cells::Tets(&[[0, 2, 3, 4]]),
        data: &data,
        cell_data: &[],
    };
    for (space, name, sign, codes) in
        [(Space::Lps, "LPS", -1.0, "76 80 83 0"), (Space::Ras, "RAS", 1.0, "82 65 83 0")]
    {
        write_vtu(&path, space, &piece).unwrap();
        let (header, points) = array(&path, "Points");
        assert!(header.contains(codes), "{name}: {header}");
        assert!(header.contains(r#"NumberOfPoints="4" NumberOfCells="1""#));
        let points = floats(&points);
        assert_eq!(points[..3], [sign * 100.0, sign * 200.0, 300.0]);
        assert_eq!(points[3..6], [sign * 110.0, sign * 200.0, 300.0]);
        assert_eq!(points[9..], [sign * 100.0, sign * 200.0, 330.0]);
        assert_eq!(floats(&array(&path, "hu").1), [1.0, 3.0, 4.0, 5.0]);
        assert_eq!(floats(&array(&path, "displacement_mm").1)[..3], [sign * 0.5, sign * 0.25, 0.125]);
        assert_eq!(numbers(&array(&path, "connectivity").1), [0, 1, 2, 3]);
        assert_eq!(numbers(&array(&path, "offsets").1), [4]);
        assert_eq!(array(&path, "types").1, [10]);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn triangles_are_written_in_both_formats() {
    let folder = tempfile::tempdir().unwrap();
    let positions = positions();
    let triangles = [[4, 2, 3], [0, 3, 2]];
    let piece = Piece {
        frame: &FRAME,
        positions: &positions,
        cells: Cells::Triangles(&triangles),
        data: &[],
        cell_data: &[],
    };
    let (vtp, vtu) = (folder.path().join("skin.vtp"), folder.path().join("skin.vtu"));
    write_vtp(&vtp, Space::Lps, &piece).unwrap();
    write_vtu(&vtu, Space::Lps, &piece).unwrap();
    assert!(array(&vtp, "Points").0.contains(r#"NumberOfPolys="2""#));
    for path in [&vtp, &vtu] {
        assert_eq!(numbers(&array(path, "connectivity").1), [3, 1, 2, 0, 2, 1]);
        assert_eq!(numbers(&array(path, "offsets").1), [3, 6]);
    }
    assert_eq!(array(&vtu, "types").1, [5, 5]);
}

/// Values of cells stand between those of points and the points. Without them the file has no
/// section for them.
#[test]
fn values_of_cells_are_written_in_both_world_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.vtu");
    let positions = positions();
    let cells = Cells::Triangles(&[[4, 2, 3], [0, 3, 2]]);
    let hu = [DataArray { name: "hu", values: Values::Scalars(&[1.0, 2.0, 3.0, 4.0, 5.0]) }];
    let cell_data = [
        DataArray { name: "normal", values: Values::Vectors(&[[0.5, 0.25, 1.0], [0.0, 1.0, 0.0]]) },
        DataArray { name: "weight", values: Values::Scalars(&[0.75, 0.125]) },
    ];
    let with = Piece { frame: &FRAME, positions: &positions, cells, data: &hu, cell_data: &cell_data };
    for (space, sign) in [(Space::Lps, -1.0), (Space::Ras, 1.0)] {
        write_vtu(&path, space, &with).unwrap();
        let (header, normals) = array(&path, "normal");
        let place = |text: &str| header.find(text).unwrap();
        assert!(place("Name=\"hu\"") < place("<CellData>") && place("</CellData>") < place("<Points>"));
        assert!((place("<CellData>")..place("</CellData>")).contains(&place("Name=\"weight\"")));
        assert_eq!(floats(&normals), [sign * 0.5, sign * 0.25, 1.0, 0.0, sign, 0.0]);
        assert_eq!(floats(&array(&path, "weight").1), [0.75, 0.125]);
        assert_eq!(floats(&array(&path, "hu").1), [1.0, 3.0, 4.0, 5.0]);
        assert_eq!(numbers(&array(&path, "connectivity").1), [3, 1, 2, 0, 2, 1]);
    }
    write_vtu(&path, Space::Lps, &Piece { cell_data: &[], ..with }).unwrap();
    assert!(!array(&path, "hu").0.contains("CellData"));
}

#[test]
fn inconsistent_input_is_refused_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtp");
    let positions = positions();
    let cells = Cells::Triangles(&[[0, 2, 3]]);
    let write = |cells, data: &[DataArray<'_>]| {
        write_vtp(
            &path,
            Space::Ras,
            &Piece { frame: &FRAME, positions: &positions, cells, data, cell_data: &[] },
        )
        .unwrap_err()
    };
    let scalars = |name| [DataArray { name, values: Values::Scalars(&[0.0; 4]) }];
    assert!(matches!(
        write(cells, &scalars("hu")),
        MeshError::ArrayLength { elements: "points", expected: 5, found: 4, .. }
    ));
    assert!(matches!(write(cells, &scalars("a\"b")), MeshError::ArrayName { .. }));
    assert!(matches!(write(Cells::Tets(&[[0, 1, 2, 3]]), &[]), MeshError::NotASurface { .. }));
    let short = [DataArray { name: "weight", values: Values::Scalars(&[0.0; 5]) }];
    let piece = Piece { frame: &FRAME, positions: &positions, cells, data: &[], cell_data: &short };
    let refused = write_vtp(&path, Space::Ras, &piece).unwrap_err();
    assert!(matches!(refused, MeshError::ArrayLength { elements: "cells", expected: 1, found: 5, .. }));
    let outside = write(Cells::Triangles(&[[0, 1, 2], [0, 5, 1]]), &[]);
    assert!(matches!(outside, MeshError::VertexIndex { position: 1, vertex: 5, vertices: 5, .. }));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let nowhere = folder.path().join("missing/a.vtp");
    let piece = Piece { frame: &FRAME, positions: &positions, cells, data: &[], cell_data: &[] };
    assert!(write_vtp(&nowhere, Space::Ras, &piece).unwrap_err().to_string().contains("missing"));
    // A folder that cannot hold files.
    if Path::new("/dev/full").exists() {
        assert!(matches!(
            write_vtp(Path::new("/dev/full/a.vtp"), Space::Ras, &piece),
            Err(MeshError::Volume(_))
        ));
    }
}
