//! PLY, STL and PVD files: layout, world frames, and refused input.

use std::fs;

use cutis_mesh::vtk::Space;
use cutis_mesh::{Frame, MeshError, Surface, write_ply, write_pvd, write_stl};
use nalgebra::Point3;

const FRAME: Frame = Frame { origin_mm: Point3::new(100.0, 200.0, 300.0) };

/// No triangle uses vertex 1.
fn positions() -> [Point3<f32>; 4] {
    [[0.0, 0.0, 0.0], [9.0, 9.0, 9.0], [0.01, 0.0, 0.0], [0.0, 0.02, 0.0]].map(Point3::from)
}

fn surface<'a>(positions: &'a [Point3<f32>], triangles: &'a [[u32; 3]]) -> Surface<'a> {
    Surface { frame: &FRAME, positions, triangles }
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn ply_has_the_frame_that_its_header_names() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.ply");
    for (space, name, sign) in [(Space::Lps, "LPS", -1.0), (Space::Ras, "RAS", 1.0)] {
        write_ply(&path, space, &surface(&positions(), &[[0, 2, 3]])).unwrap();
        let bytes = fs::read(&path).unwrap();
        let mark = b"end_header\n";
        let end = bytes.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
        let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
        assert!(header.contains(&format!("\ncomment SPACE={name}\n")), "{header}");
        assert!(header.contains("\nelement vertex 3\n") && header.contains("\nelement face 1\n"), "{header}");
        let (points, faces) = bytes[end..].split_at(36);
        let expected = [100.0, 200.0, 300.0, 110.0, 200.0, 300.0, 100.0, 220.0, 300.0];
        let signed = expected.chunks(3).flat_map(|p| [sign * p[0], sign * p[1], p[2]]);
        assert!(floats(points).into_iter().eq(signed));
        assert_eq!(faces, [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    }
}

#[test]
fn stl_has_outward_normals_in_both_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.stl");
    for (space, name, sign) in [(Space::Lps, "LPS", -1.0), (Space::Ras, "RAS", 1.0)] {
        write_stl(&path, space, &surface(&positions(), &[[0, 2, 3], [2, 2, 3]])).unwrap();
        let bytes = fs::read(&path).unwrap();
        assert_eq!(bytes.len(), 84 + 2 * 50);
        let header = String::from_utf8(bytes[..80].to_vec()).unwrap();
        assert!(header.contains(&format!("SPACE={name} ")) && !header.starts_with("solid"), "{header}");
        assert_eq!(bytes[80..84], 2_u32.to_le_bytes());
        let numbers = floats(&bytes[84..132]);
        assert_eq!(numbers[..3], [0.0, 0.0, 1.0], "the turn from RAS to LPS keeps the orientation");
        assert_eq!(numbers[3..6], [sign * 100.0, sign * 200.0, 300.0]);
        assert_eq!(floats(&bytes[134..146]), [0.0; 3], "a triangle without an area");
    }
}

#[test]
fn a_list_of_files_names_their_times() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.pvd");
    write_pvd(&path, &[(0.0, "s/a-1.vtp".into()), (0.25, "s/a-2.vtp".into())]).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(r#"type="Collection""#), "{text}");
    let second = r#"<DataSet timestep="0.25" group="" part="0" file="s/a-2.vtp"/>"#;
    assert!(text.contains(second) && text.matches("<DataSet").count() == 2, "{text}");
    let hostile = write_pvd(&path, &[(0.0, "a\"/><x y=\"".into())]).unwrap_err();
    assert!(matches!(hostile, MeshError::ArrayName { .. }), "{hostile}");
    assert_eq!(fs::read_to_string(&path).unwrap(), text, "the old file stays");
}

#[test]
fn wrong_surfaces_are_refused_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin");
    for write in [write_ply, write_stl] {
        let refused = write(&path, Space::Lps, &surface(&positions(), &[[0, 2, 3], [0, 4, 1]])).unwrap_err();
        assert!(
            matches!(refused, MeshError::VertexIndex { position: 1, vertex: 4, vertices: 4, .. }),
            "{refused}"
        );
        let nowhere = folder.path().join("missing/skin");
        let refused = write(&nowhere, Space::Lps, &surface(&positions(), &[[0, 2, 3]])).unwrap_err();
        assert!(refused.to_string().contains("missing"), "{refused}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
