//! Label maps are read and written as they are, in every format and type. Files that are no label
//! map are refused by name.

use std::fs;
use std::path::Path;

use cutis_volume::nrrd::VectorWriter;
use cutis_volume::{Affine, Grid, LabelMap, VolumeError};

/// Name, bytes per voxel and header of each integer and real type in NRRD.
const TYPES: [(&str, usize, &str); 10] = [
    ("uint8", 1, "unsigned char"),
    ("int8", 1, "signed char"),
    ("int16", 2, "short"),
    ("uint16", 2, "unsigned short"),
    ("int32", 4, "int"),
    ("uint32", 4, "uint32"),
    ("int64", 8, "longlong"),
    ("uint64", 8, "uint64"),
    ("float32", 4, "float"),
    ("float64", 8, "double"),
];

const NAMES: [&str; 7] = ["a.nii", "a.nii.gz", "a.nrrd", "a.nhdr", "a.mha", "a.mhd", "a.seg.nrrd"];

/// An NRRD file of 3 × 2 × 2 voxels.
fn nrrd(dtype: &str, endian: &str, more: &str, voxels: &[u8]) -> Vec<u8> {
    let header = format!(
        "NRRD0004\ntype: {dtype}\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 2\n\
         space directions: (2,0,0) (0,3,0) (0,0,4)\nkinds: domain domain domain\nendian: {endian}\n\
         encoding: raw\nspace origin: (1,2,3)\n{more}\n"
    );
    [header.as_bytes(), voxels].concat()
}

fn put(folder: &Path, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn every_type_stays_as_it_is_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for (name, size, header) in TYPES {
        // Values with all bits, which no conversion to another type keeps.
        let bytes: Vec<u8> = (0..12 * size).map(|n| (n * 89 + 7) as u8).collect();
        let path = put(folder.path(), "given.nrrd", &nrrd(header, "little", "", &bytes));
        let (labels, warnings) = LabelMap::read(&path).unwrap();
        assert_eq!((labels.dtype(), labels.voxel_bytes(), warnings.len()), (name, size, 0));
        assert_eq!(labels.bytes(), bytes);
        for out in NAMES {
            labels.write(folder.path().join(out)).unwrap();
            let (back, warnings) = LabelMap::read(folder.path().join(out)).unwrap();
            assert_eq!((&back, warnings.len()), (&labels, 0), "{name} in {out}");
        }
        let swapped: Vec<u8> = bytes.chunks(size).flat_map(|value| value.iter().rev()).copied().collect();
        let path = put(folder.path(), "big.nrrd", &nrrd(header, "big", "", &swapped));
        assert_eq!(LabelMap::read(&path).unwrap().0, labels, "{name}, big-endian");
        if size > 1 {
            let path = put(folder.path(), "wrong.nrrd", &nrrd(header, "little", "", &swapped));
            assert_ne!(LabelMap::read(&path).unwrap().0, labels, "the control: the wrong byte order");
        }
    }
}

#[test]
fn names_of_segments_are_kept_without_their_extents() {
    let folder = tempfile::tempdir().unwrap();
    let more =
        "Segment0_Name:=skin\nSegment0_Extent:=0 1 0 1 0 1\nSegmentation_Source:=x\nPatientName:=doe\n";
    let given = put(folder.path(), "given.seg.nrrd", &nrrd("uint8", "little", more, &[1; 12]));
    let out = folder.path().join("out.seg.nrrd");
    LabelMap::read(given).unwrap().0.write(&out).unwrap();
    let text = String::from_utf8_lossy(&fs::read(&out).unwrap()).into_owned();
    assert!(text.contains("\nSegment0_Name:=skin\nSegmentation_Source:=x\n\n"), "{text}");
    assert!(!text.contains("Extent") && !text.contains("doe"), "{text}");
}

#[test]
fn what_is_no_label_map_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8]| {
        let path = put(folder.path(), name, bytes);
        let error = LabelMap::read(&path).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        error
    };
    let short = refused("short.nrrd", &nrrd("short", "little", "", &[0; 23]));
    assert!(matches!(short, VolumeError::Truncated { expected_bytes: 24, .. }), "{short}");
    let huge = nrrd("short", "little", "", &[0; 24]);
    let huge = String::from_utf8_lossy(&huge).replace("sizes: 3 2 2", "sizes: 3000000000 3000000000 2");
    assert!(matches!(
        refused("huge.nrrd", huge.as_bytes()),
        VolumeError::TooLarge { .. } | VolumeError::Truncated { .. }
    ));
    assert!(matches!(refused("text.nrrd", b"hello"), VolumeError::NotNifti { .. }));
    let layers = nrrd("uint8", "little", "", &[0; 24]);
    let layers = String::from_utf8_lossy(&layers)
        .replace("dimension: 3", "dimension: 4")
        .replace("sizes: ", "sizes: 2 ")
        .replace("space directions: ", "space directions: none ");
    assert!(matches!(
        refused("layers.nrrd", layers.as_bytes()),
        VolumeError::SeveralVolumes { count: 2, .. }
    ));
    let dicom = [&[0; 128][..], b"DICM", &[2, 0, 0, 0]].concat();
    assert!(matches!(refused("scan.dcm", &dicom), VolumeError::NotNifti { .. }));
    assert!(LabelMap::read(folder.path()).unwrap_err().to_string().contains("DICOM"));

    let grid = Grid { shape: [3, 2, 2], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
    let labels = LabelMap::new(grid, vec![5; 12]).unwrap();
    labels.write(folder.path().join("scaled.nii")).unwrap();
    let mut bytes = fs::read(folder.path().join("scaled.nii")).unwrap();
    bytes[112..116].copy_from_slice(&2.0_f32.to_le_bytes());
    let scaled = refused("scaled.nii", &bytes);
    assert!(matches!(scaled, VolumeError::Header { field: "scl_slope", .. }), "{scaled}");
    assert!(matches!(LabelMap::new(grid, vec![5; 11]), Err(VolumeError::VoxelCount { found: 11, .. })));
    assert!(matches!(labels.write("a.png"), Err(VolumeError::Extension { .. })));
}

#[test]
fn a_field_of_vectors_is_complete_or_absent() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("field.nrrd");
    let grid =
        Grid { shape: [3, 2, 1], affine: Affine::from_spacing([2.0, 3.0, 4.0], [10.0, 20.0, 30.0]).unwrap() };
    let mut writer = VectorWriter::create(&path, &grid).unwrap();
    writer.push(&[[1.0, 2.0, 3.0]; 4]).unwrap();
    assert!(matches!(writer.push(&[[0.0; 3]; 3]), Err(VolumeError::Pushed { expected: 6, found: 7, .. })));
    drop(writer);
    let mut writer = VectorWriter::create(&path, &grid).unwrap();
    writer.push(&[[1.0, 2.0, 3.0]; 4]).unwrap();
    assert!(matches!(writer.finish(), Err(VolumeError::Pushed { expected: 6, found: 4, .. })));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);

    let mut writer = VectorWriter::create(&path, &grid).unwrap();
    writer.push(&[[1.0, 0.0, 3.0]; 4]).unwrap();
    writer.push(&[[0.0, -2.0, 0.5]; 2]).unwrap();
    writer.finish().unwrap();
    let bytes = fs::read(&path).unwrap();
    let end = bytes.windows(2).position(|pair| pair == b"\n\n").unwrap() + 2;
    let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
    for line in [
        "type: float",
        "dimension: 4",
        "space: left-posterior-superior",
        "sizes: 3 3 2 1",
        "space directions: none (-2.0,0.0,0.0) (0.0,-3.0,0.0) (0.0,0.0,4.0)",
        "kinds: vector domain domain domain",
        "space origin: (-10.0,-20.0,30.0)",
    ] {
        assert!(header.contains(&format!("\n{line}\n")), "no {line:?} in {header}");
    }
    let mut voxels = Vec::new();
    std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(&bytes[end..]), &mut voxels).unwrap();
    let numbers: Vec<f32> = voxels.chunks(4).map(|n| f32::from_le_bytes(n.try_into().unwrap())).collect();
    assert_eq!(numbers.len(), 18);
    assert_eq!((&numbers[..3], &numbers[15..]), (&[-1.0, 0.0, 3.0][..], &[0.0, 2.0, 0.5][..]));

    let sheared = [[1.0, 0.2, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let sheared = Grid { shape: [2; 3], affine: Affine::from_rows(sheared).unwrap() };
    let out = folder.path().join("out.nrrd");
    assert!(matches!(VectorWriter::create(&out, &sheared), Err(VolumeError::Sheared { .. })));
    for name in ["out.nhdr", "out.h5", "out"] {
        let refused = VectorWriter::create(folder.path().join(name), &grid).err();
        assert!(matches!(refused, Some(VolumeError::Extension { .. })), "{name}");
    }
}
