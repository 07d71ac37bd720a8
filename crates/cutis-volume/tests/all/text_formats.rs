//! NRRD and MetaImage files: written ones are read back, hand-made ones are read as the formats
//! say, and damaged ones are refused.

use std::fs;
use std::io::Write;

use cutis_volume::{Affine, Grid, Loaded, ReadOptions, Volume, VolumeError};
use flate2::{Compression, write::GzEncoder, write::ZlibEncoder};
use nalgebra::Point3;
use proptest::prelude::*;

const NAMES: [&str; 4] = ["v.nrrd", "v.nhdr", "v.mha", "v.mhd"];

/// Voxels of a volume of 2 x 3 x 4: 0 to 23.
fn voxels(big_endian: bool) -> Vec<u8> {
    (0i16..24).flat_map(|n| if big_endian { n.to_be_bytes() } else { n.to_le_bytes() }).collect()
}

fn read_files(files: &[(&str, &[u8])]) -> Result<Loaded, VolumeError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    cutis_volume::read(folder.path().join(files[0].0), &ReadOptions::default())
}

const NRRD: &str = "NRRD0004\n# a comment\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 3 4\n\
    space directions: (2,0,0) (0,3,0) (0,0,4)\nkinds: domain domain domain\nendian: little\nencoding: raw\n\
    space origin: (10,20,30)\nkey:=value\n\n";
const MHA: &str = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n\
    CompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 10 20 30\nCenterOfRotation = 0 0 0\n\
    AnatomicalOrientation = RAI\nElementSpacing = 2 3 4\nDimSize = 2 3 4\nElementType = MET_SHORT\n\
    ElementDataFile = LOCAL\n";

fn nrrd(changes: &[(&str, &str)]) -> Result<Loaded, VolumeError> {
    read_files(&[("v.nrrd", &changed(NRRD, changes, &voxels(false)))])
}

fn mha(changes: &[(&str, &str)]) -> Result<Loaded, VolumeError> {
    read_files(&[("v.mha", &changed(MHA, changes, &voxels(false)))])
}

fn changed(header: &str, changes: &[(&str, &str)], voxels: &[u8]) -> Vec<u8> {
    let mut text = header.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    [text.as_bytes(), voxels].concat()
}

/// Fails unless the volume has the values 0 to 23, and voxel (1, 2, 3) is at this RAS position.
fn check(loaded: Result<Loaded, VolumeError>, corner: [f64; 3]) -> Loaded {
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.volume.voxels().iter().map(|&v| loaded.volume.hu(v)).eq((0..24).map(|n| n as f32)));
    let found = loaded.volume.grid().mm([1, 2, 3]);
    assert!((found - Point3::from(corner)).norm() < 1e-9, "{found:?}");
    loaded
}

/// The corner of the files above, in RAS.
const CORNER: [f64; 3] = [-12.0, -26.0, 42.0];

#[test]
fn plain_files_are_read() {
    for loaded in [nrrd(&[]), mha(&[])] {
        let loaded = check(loaded, CORNER);
        assert_eq!((loaded.warnings.len(), loaded.dtype), (0, "int16"));
    }
}

#[test]
fn the_space_of_nrrd_decides_the_signs() {
    let space = |name| nrrd(&[("left-posterior-superior", name)]);
    check(space("LPS"), CORNER);
    check(space("right-anterior-superior"), [12.0, 26.0, 42.0]);
    check(space("RAS"), [12.0, 26.0, 42.0]);
    check(space("left-anterior-superior"), [-12.0, 26.0, 42.0]);
    let error = space("scanner-xyz").unwrap_err().to_string();
    assert!(error.contains("space is scanner-xyz") && error.contains("v.nrrd"), "{error}");
    let none = check(nrrd(&[("space: left-posterior-superior\n", "")]), CORNER);
    assert!(none.warnings[0].contains("no space"), "{:?}", none.warnings);
}

#[test]
fn axes_that_are_not_space_have_one_entry() {
    let with_none = [
        ("sizes: 2 3 4", "sizes: 1 2 3 4"),
        ("dimension: 3", "dimension: 4"),
        ("directions: (", "directions: none ("),
    ];
    check(nrrd(&with_none), CORNER);
    let several = [("sizes: 2 3 4", "sizes: 2 1 3 4"), ("directions: (", "directions: none (")];
    assert!(matches!(nrrd(&several), Err(VolumeError::SeveralVolumes { count: 2, .. })));
    // The position of a sample is its center, for cells and for nodes.
    check(nrrd(&[("kinds: domain domain domain", "centerings: node node node")]), CORNER);
    let spacings = [("space directions: (2,0,0) (0,3,0) (0,0,4)", "spacings: 2 3 4")];
    check(nrrd(&spacings), CORNER);
    check(
        nrrd(&[
            ("space origin: (10,20,30)", "space origin: (1,2,3)\nspace units: \"cm\" \"cm\" \"cm\""),
            ("(2,0,0) (0,3,0) (0,0,4)", "(0.2, 0, 0) (0, 0.3, 0) (0,0,.4)"),
        ]),
        CORNER,
    );
}

#[test]
fn the_matrix_of_a_metaimage_holds_one_axis_after_the_other() {
    // The first axis runs along z, the second along x, the third along y.
    let turned = [("1 0 0 0 1 0 0 0 1", "0 0 1 1 0 0 0 1 0"), ("= RAI", "= IRA")];
    let loaded = check(mha(&turned), [-16.0, -32.0, 32.0]);
    assert_eq!(loaded.volume.grid().affine.orientation(), ['S', 'L', 'P']);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    // A contradiction warns, and the matrix counts.
    let loaded = check(mha(&[("= RAI", "= LPS")]), CORNER);
    assert!(loaded.warnings[0].contains("AnatomicalOrientation is LPS"), "{:?}", loaded.warnings);
}

#[test]
fn byte_order_compression_and_detached_voxels_are_read() {
    let gzip = |bytes: &[u8]| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let zlib = |bytes: &[u8]| {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let big = voxels(true);
    check(read_files(&[("v.nrrd", &changed(NRRD, &[("little", "big")], &big))]), CORNER);
    check(read_files(&[("v.nrrd", &changed(NRRD, &[("raw", "gzip")], &gzip(&voxels(false))))]), CORNER);
    check(read_files(&[("v.mha", &changed(MHA, &[("MSB = False", "MSB = True")], &big))]), CORNER);
    let order = [("BinaryDataByteOrderMSB = False", "ElementByteOrderMSB = True")];
    check(read_files(&[("v.mha", &changed(MHA, &order, &big))]), CORNER);
    let packed = zlib(&voxels(false));
    let size = format!("CompressedData = True\nCompressedDataSize = {}", packed.len());
    check(read_files(&[("v.mha", &changed(MHA, &[("CompressedData = False", &size)], &packed))]), CORNER);
    // In a file of their own, after bytes that are skipped, and at its end.
    let after = [&[7u8; 5], &voxels(false)[..]].concat();
    for skip in ["5", "-1"] {
        let fields = format!("encoding: raw\ndata file: v.raw\nbyte skip: {skip}");
        let header = changed(NRRD, &[("encoding: raw", &fields)], b"");
        check(read_files(&[("v.nhdr", &header), ("v.raw", &after)]), CORNER);
        let fields = format!("HeaderSize = {skip}\nElementDataFile = v.raw");
        let header = changed(MHA, &[("ElementDataFile = LOCAL", &fields)], b"");
        check(read_files(&[("v.mhd", &header), ("v.raw", &after)]), CORNER);
    }
    // Raw voxels that begin with the magic of gzip are not compressed.
    let mut magic = voxels(false);
    magic[..2].copy_from_slice(&[0x1f, 0x8b]);
    let header = changed(NRRD, &[("encoding: raw", "encoding: raw\ndata file: v.raw")], b"");
    let loaded = read_files(&[("v.nhdr", &header), ("v.raw", &magic)]).unwrap();
    assert_eq!(loaded.volume.voxels()[..2], [0x8b1fu16 as i16, 1]);
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    for (change, field) in [
        (("encoding: raw", "encoding: bzip2"), "encoding is bzip2"),
        (("encoding: raw", "encoding: txt"), "encoding is txt"),
        (("encoding: raw\n", ""), "encoding is missing"),
        (("type: short", "type: block"), "type is block"),
        (("endian: little\n", ""), "endian is missing"),
        (("sizes: 2 3 4", "sizes: 2 3"), "space directions"),
        (("sizes: 2 3 4", "sizes: 2 0 4"), "sizes is 2 0 4"),
        (("(0,0,4)", "(0,0,0)"), "space directions"),
        (("(0,0,4)", "(0,0,nan)"), "space directions"),
        (("(0,0,4)", "(0,0"), "space directions"),
        (("(10,20,30)", "(10,20)"), "space origin is (10,20)"),
        (("key:=value", "data file: slice%03d.raw 1 4 1"), "data file"),
        (("key:=value", "data file: LIST"), "data file is LIST"),
        (("key:=value", "data file: a\0b"), "data file is ab"),
        (("key:=value", "byte skip: -2"), "byte skip is -2"),
        (("key:=value", "line skip: 3"), "line skip is 3"),
        (("key:=value", "space units: \"furlong\""), "space units"),
        (("NRRD0004", "NRRD0009"), "magic is NRRD0009"),
    ] {
        let error = nrrd(&[change]).unwrap_err();
        assert!(matches!(error, VolumeError::Header { .. }), "{field}: {error}");
        assert!(
            error.to_string().contains(field) && error.to_string().contains("v.nrrd"),
            "{field}: {error}"
        );
    }
    for (change, field) in [
        (("NDims = 3", "NDims = 2"), "NDims is 2"),
        (("ObjectType = Image", "ObjectType = Tube"), "ObjectType is Tube"),
        (("MET_SHORT", "MET_SHORT_ARRAY"), "ElementType is MET_SHORT_ARRAY"),
        (("DimSize = 2 3 4", "DimSize = 2 3 -4"), "DimSize is 2 3 -4"),
        (("ElementSpacing = 2 3 4", "ElementSpacing = 2 0 4"), "ElementSpacing is 2 0 4"),
        (("1 0 0 0 1 0 0 0 1", "1 0 0 1 0 0 0 0 1"), "TransformMatrix"),
        (("= LOCAL", "= LIST"), "ElementDataFile is LIST"),
        (("= LOCAL", "= v%d.raw 1 4 1"), "ElementDataFile"),
        (("BinaryData = True", "BinaryData = False"), "BinaryData is False"),
        (("CompressedData = False", "CompressedData = maybe"), "CompressedData is maybe"),
        (("= RAI", "= RAI\nElementNumberOfChannels = 3"), "ElementNumberOfChannels is 3"),
        (("= RAI", "= RAI\nElementToIntensityFunctionSlope = 2"), "Slope is 2"),
    ] {
        let error = mha(&[change]).unwrap_err();
        assert!(matches!(error, VolumeError::Header { .. }), "{field}: {error}");
        assert!(error.to_string().contains(field) && error.to_string().contains("v.mha"), "{field}: {error}");
    }
    let missing =
        read_files(&[("v.nhdr", &changed(NRRD, &[("encoding: raw", "encoding: raw\ndata file: x")], b""))]);
    assert!(matches!(missing, Err(VolumeError::Io { .. })));
}

#[test]
fn truncated_files_are_refused() {
    for (name, header) in [("v.nrrd", NRRD), ("v.mha", MHA)] {
        let whole = changed(header, &[], &voxels(false));
        for end in 0..whole.len() {
            assert!(read_files(&[(name, &whole[..end])]).is_err(), "{name} {end}");
        }
    }
    let error = nrrd(&[("sizes: 2 3 4", "sizes: 2000 3000 40000")]).unwrap_err();
    assert!(matches!(error, VolumeError::Truncated { .. }), "{error}");
    let size = [("CompressedData = False", "CompressedData = True\nCompressedDataSize = 999999")];
    assert!(matches!(mha(&size), Err(VolumeError::Truncated { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn every_volume_is_read_back_exactly(
        shape in [1usize..9, 1usize..9, 1usize..9],
        angles in [-3.2f64..3.2, -1.6f64..1.6, -3.2f64..3.2],
        spacing in [0.05f64..9.0, 0.05f64..9.0, 0.05f64..9.0],
        origin in [-900.0f64..900.0, -900.0f64..900.0, -900.0f64..900.0],
        mirrored: bool,
        seed: u16,
        scaling in prop::sample::select(vec![(1.0f32, 0.0f32), (1.0, -24.0), (0.5, 3.0)]),
    ) {
        let rotation = nalgebra::Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let sign = [1.0, 1.0, if mirrored { -1.0 } else { 1.0 }];
        let line = |r: usize| -> [f64; 4] {
            std::array::from_fn(|c| if c < 3 { rotation[(r, c)] * spacing[c] * sign[c] } else { origin[r] })
        };
        let affine = Affine::from_rows([line(0), line(1), line(2), [0.0, 0.0, 0.0, 1.0]]).unwrap();
        let grid = Grid { shape, affine };
        let voxels: Vec<i16> = (0..grid.len()).map(|n| ((n as u16).wrapping_mul(seed) >> 1) as i16).collect();
        let volume = Volume::new(grid, voxels, scaling.0, scaling.1).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for name in NAMES {
            let path = folder.path().join(name);
            cutis_volume::write(&path, &volume).unwrap();
            let back = cutis_volume::read(&path, &ReadOptions::default()).unwrap();
            let corner = shape.map(|n| n - 1);
            let moved = back.volume.grid().mm(corner) - grid.mm(corner);
            prop_assert!(back.volume.grid().shape == shape && moved.norm() < 1e-9, "{} {:?}", name, moved);
            // Real numbers are read as whole HU.
            let whole = |volume: &Volume| volume.voxels().iter().map(|&v| volume.hu(v).round()).collect::<Vec<_>>();
            prop_assert_eq!(whole(&back.volume), whole(&volume));
        }
        let names = fs::read_dir(folder.path()).unwrap().count();
        prop_assert_eq!(names, 6);
    }

    #[test]
    fn changed_bytes_never_panic(changes in prop::collection::vec((0usize..400, any::<u8>()), 1..6), format in 0usize..2) {
        let (name, header) = [("v.nrrd", NRRD), ("v.mha", MHA)][format];
        let mut bytes = changed(header, &[], &voxels(false));
        for (at, value) in changes {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        if let Err(error) = read_files(&[(name, &bytes)]) {
            // A changed name of the file of voxels is the name in the message.
            let message = error.to_string();
            prop_assert!(message.contains("v.") || message.starts_with("cannot read /"), "{}", message);
        }
    }
}

#[test]
fn refused_writes_leave_no_file() {
    let mut rows = Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap().rows();
    rows[1][2] = 0.3;
    let grid = Grid { shape: [2, 2, 2], affine: Affine::from_rows(rows).unwrap() };
    let volume = Volume::new(grid, vec![0; 8], 1.0, 0.0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for name in NAMES {
        let error = cutis_volume::write(folder.path().join(name), &volume).unwrap_err();
        assert!(matches!(error, VolumeError::Sheared { .. }), "{error}");
    }
    let error = cutis_volume::write(folder.path().join("v.png"), &volume).unwrap_err();
    assert!(matches!(error, VolumeError::Extension { .. }) && error.to_string().contains(".nrrd"), "{error}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn sheared_volumes_are_resampled_on_request() {
    let directions = ("(2,0,0) (0,3,0) (0,0,4)", "(2,0,0) (0,3,0) (0,1,4)");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("v.nrrd");
    fs::write(&path, changed(NRRD, &[directions], &voxels(false))).unwrap();
    let plain = cutis_volume::read(&path, &ReadOptions::default()).unwrap();
    assert!(plain.volume.grid().affine.is_sheared());
    let options = ReadOptions { series: None, resample: true };
    let upright = cutis_volume::read(&path, &options).unwrap();
    let grid = upright.volume.grid();
    assert!(!grid.affine.is_sheared() && grid.shape == [2, 4, 4], "{grid:?}");
    assert!(upright.warnings[0].contains("resampled"), "{:?}", upright.warnings);
    // The value of a voxel within the scan: 1/3 of a row from its neighbor.
    assert_eq!(upright.volume.voxels()[upright.volume.grid().index([0, 1, 1])], 7);
    assert_eq!(grid.mm([0, 1, 1]), plain.volume.grid().affine.to_mm(Point3::new(0.0, 2.0 / 3.0, 1.0)));
}
