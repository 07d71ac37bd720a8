//! Valid inputs of each format, made here byte by byte, from which the generator starts.

use std::io::Write;

use flate2::Compression;
use flate2::write::{DeflateEncoder, GzEncoder, ZlibEncoder};
use sha2::{Digest, Sha256};

/// A scene with most kinds of sections.
pub(crate) const SCENE: &str = r#"materials = "trunk"
[volume]
phantom = { size = [24, 24, 16], seed = 1 }
[lattice]
spacing_mm = 12.0
region = { around_mm = 60 }
[constraints]
distance = {}
volume = {}
membrane = { preset = "trunk" }
[fixed]
bone_above_hu = 250.0
end_layers = ["k"]
planes = [{ point_mm = [0.0, -40.0, 0.0], normal = [0.0, -1.0, 0.0] }]
[[incision]]
path_mm = [[30, 110, -50], [30, 112, 0], [30, 110, 50]]
depth_mm = 20.0
[[handle]]
at_mm = [0, 110, 0]
radius_mm = 20.0
move_mm = [0, 10, 0]
over_s = 1.0
[solver]
formulation = "vbd"
substeps = 2
[run]
frames = 2
[output]
report = true
"#;

/// Voxels of 2 x 3 x 4 values of two bytes.
fn voxels() -> Vec<u8> {
    (0..24i16).flat_map(|n| (40 * n - 500).to_le_bytes()).collect()
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes any number of bytes")
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes any number of bytes")
}

fn deflate(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("memory takes any number of bytes")
}

/// NIfTI-1 with a data type and its voxels.
fn nifti1(datatype: i16, voxels: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    let mut put = |at: usize, part: &[u8]| bytes[at..at + part.len()].copy_from_slice(part);
    put(0, &348i32.to_le_bytes());
    [3i16, 2, 3, 4].iter().enumerate().for_each(|(n, size)| put(40 + 2 * n, &size.to_le_bytes()));
    put(70, &datatype.to_le_bytes());
    [1f32, 2.0, 3.0, 4.0].iter().enumerate().for_each(|(n, size)| put(76 + 4 * n, &size.to_le_bytes()));
    put(108, &352f32.to_le_bytes());
    put(112, &1f32.to_le_bytes());
    put(123, &[2]);
    put(252, &1i16.to_le_bytes());
    put(254, &1i16.to_le_bytes());
    for (at, value) in [(280, 2f32), (300, 3.0), (320, 4.0)] {
        put(at, &value.to_le_bytes());
    }
    put(344, b"n+1\0");
    bytes.extend(voxels);
    bytes
}

/// NIfTI-2 with 16-bit voxels.
fn nifti2() -> Vec<u8> {
    let mut bytes = vec![0; 544];
    let mut put = |at: usize, part: &[u8]| bytes[at..at + part.len()].copy_from_slice(part);
    put(0, &540i32.to_le_bytes());
    put(4, b"n+2\0\r\n\x1a\n");
    put(12, &4i16.to_le_bytes());
    [3i64, 2, 3, 4].iter().enumerate().for_each(|(n, size)| put(16 + 8 * n, &size.to_le_bytes()));
    [1f64, 2.0, 3.0, 4.0].iter().enumerate().for_each(|(n, size)| put(104 + 8 * n, &size.to_le_bytes()));
    put(168, &544i64.to_le_bytes());
    put(176, &1f64.to_le_bytes());
    put(348, &1i32.to_le_bytes());
    for (at, value) in [(400, 2f64), (440, 3.0), (480, 4.0)] {
        put(at, &value.to_le_bytes());
    }
    put(500, &2i32.to_le_bytes());
    bytes.extend(voxels());
    bytes
}

pub(crate) fn nifti() -> Vec<Vec<u8>> {
    let int16 = nifti1(4, &voxels());
    let floats: Vec<u8> = (0..24).flat_map(|n| (n as f32 * 40.0 - 500.0).to_le_bytes()).collect();
    let two = [gzip(&int16[..200]), gzip(&int16[200..])].concat();
    vec![gzip(&int16), int16, nifti1(2, &[9; 24]), nifti1(16, &floats), nifti2(), gzip(&nifti2()), two]
}

const NRRD: &str = "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 3 4\n\
                    space directions: (2,0,0) (0,3,0) (0,0,4)\nkinds: domain domain domain\n\
                    endian: little\nencoding: raw\nspace origin: (1,2,3)\n\n";

fn nrrd_with(changes: &[(&str, &str)], voxels: &[u8]) -> Vec<u8> {
    let header = changes.iter().fold(NRRD.to_owned(), |text, (from, to)| text.replace(from, to));
    [header.as_bytes(), voxels].concat()
}

pub(crate) fn nrrd() -> Vec<Vec<u8>> {
    let four = [
        ("sizes: 2 3 4", "sizes: 1 2 3 4"),
        ("dimension: 3", "dimension: 4"),
        ("directions: ", "directions: none "),
    ];
    let plain = [
        ("space: left-posterior-superior\n", ""),
        ("space directions: (2,0,0) (0,3,0) (0,0,4)", "spacings: 2 3 4"),
        ("space origin: (1,2,3)\n", ""),
    ];
    vec![
        nrrd_with(&[], &voxels()),
        nrrd_with(&[("encoding: raw", "encoding: gzip")], &gzip(&voxels())),
        nrrd_with(&[("encoding: raw", "encoding: raw\ndata file: voxels.raw")], b""),
        nrrd_with(&[("(0,0,4)", "(0,1,4)"), ("encoding: raw", "encoding: raw\nbyte skip: -1")], &voxels()),
        nrrd_with(&four, &voxels()),
        nrrd_with(&plain, &voxels()),
    ]
}

const META: &str = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n\
                    CompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 1 2 3\n\
                    AnatomicalOrientation = RAI\nElementSpacing = 2 3 4\nDimSize = 2 3 4\n\
                    ElementType = MET_SHORT\nElementDataFile = LOCAL\n";

pub(crate) fn metaimage() -> Vec<Vec<u8>> {
    let packed = zlib(&voxels());
    let size = format!("CompressedData = True\nCompressedDataSize = {}", packed.len());
    vec![
        [META.as_bytes(), &voxels()].concat(),
        [META.replace("CompressedData = False", &size).as_bytes(), &packed].concat(),
        META.replace("LOCAL", "voxels.raw").into_bytes(),
        [META.replace("ElementType", "HeaderSize = -1\nElementType").as_bytes(), &voxels()].concat(),
    ]
}

/// An element of an explicit encoding, little-endian.
fn element(tag: [u16; 2], vr: &[u8; 2], value: &[u8]) -> Vec<u8> {
    let mut bytes = tag.map(u16::to_le_bytes).concat();
    bytes.extend(vr);
    let mut value = value.to_vec();
    if value.len() % 2 == 1 {
        value.push(if vr == b"UI" { 0 } else { b' ' });
    }
    if matches!(vr, b"OB" | b"OW" | b"SQ" | b"UN") {
        bytes.extend([0, 0]);
        bytes.extend((value.len() as u32).to_le_bytes());
    } else {
        bytes.extend((value.len() as u16).to_le_bytes());
    }
    bytes.extend(value);
    bytes
}

const RAW: &str = "1.2.840.10008.1.2.1";

/// A slice of 4 columns and 3 rows. `pixels` is the last element.
fn slice(syntax: &str, size: [u16; 2], pixels: &[u8]) -> Vec<u8> {
    let meta = element([2, 0x10], b"UI", syntax.as_bytes());
    let mut bytes = vec![0; 128];
    bytes.extend(b"DICM");
    bytes.extend(element([2, 0], b"UL", &(meta.len() as u32).to_le_bytes()));
    bytes.extend(meta);
    let mut data = Vec::new();
    let mut add = |tag, vr: &[u8; 2], value: &[u8]| data.extend(element(tag, vr, value));
    add([8, 8], b"CS", b"ORIGINAL\\PRIMARY\\AXIAL");
    add([8, 0x16], b"UI", b"1.2.840.10008.5.1.4.1.1.2");
    add([8, 0x18], b"UI", b"1.2.3");
    add([8, 0x60], b"CS", b"CT");
    add([8, 0x1140], b"SQ", b"\xfe\xff\x00\xe0\x0a\0\0\0\x08\x00\x60\x00CS\x02\x00CT");
    add([0x20, 0x0e], b"UI", b"1.2.3.4");
    add([0x20, 0x11], b"IS", b"7");
    add([0x20, 0x32], b"DS", b"10\\20\\30");
    add([0x20, 0x37], b"DS", b"1\\0\\0\\0\\1\\0");
    add([0x28, 2], b"US", &1u16.to_le_bytes());
    add([0x28, 4], b"CS", b"MONOCHROME2");
    add([0x28, 0x10], b"US", &size[1].to_le_bytes());
    add([0x28, 0x11], b"US", &size[0].to_le_bytes());
    add([0x28, 0x30], b"DS", b"2\\1.5");
    for (tag, value) in [(0x100, 16u16), (0x101, 12), (0x102, 11), (0x103, 0)] {
        add([0x28, tag], b"US", &value.to_le_bytes());
    }
    add([0x28, 0x1052], b"DS", b"-1024");
    add([0x28, 0x1053], b"DS", b"1");
    data.extend(pixels);
    bytes.extend(if syntax.ends_with(".99") { deflate(&data) } else { data });
    bytes
}

/// A sequence of items with these data sets.
fn sequence(tag: [u16; 2], items: &[Vec<u8>]) -> Vec<u8> {
    let item = |data: &Vec<u8>| {
        let length = (data.len() as u32).to_le_bytes();
        [b"\xfe\xff\x00\xe0".as_slice(), &length, data].concat()
    };
    element(tag, b"SQ", &items.iter().flat_map(item).collect::<Vec<u8>>())
}

/// An enhanced CT with two frames of 4 columns and 3 rows.
fn enhanced() -> Vec<u8> {
    let group = |tag, elements: &[Vec<u8>]| sequence(tag, &[elements.concat()]);
    let frame = |position: &[u8]| {
        let place = group([0x20, 0x9113], &[element([0x20, 0x32], b"DS", position)]);
        let scaling = [([0x28, 0x1052], b"-1024".as_slice()), ([0x28, 0x1053], b"1")];
        let scaling = scaling.map(|(tag, value)| element(tag, b"DS", value));
        [place, group([0x28, 0x9145], &scaling)].concat()
    };
    let shared = group([0x20, 0x9116], &[element([0x20, 0x37], b"DS", b"1\\0\\0\\0\\1\\0")]);
    let stored: Vec<u8> = (1000..1024u16).flat_map(u16::to_le_bytes).collect();
    let data = [
        element([0x28, 8], b"IS", b"2"),
        sequence([0x5200, 0x9229], &[shared]),
        sequence([0x5200, 0x9230], &[frame(b"10\\20\\30"), frame(b"10\\20\\32")]),
        element([0x7fe0, 0x10], b"OW", &stored),
    ];
    slice(RAW, [4, 3], &data.concat())
}

/// Pixels in one fragment, after an empty table of offsets.
fn fragment(stream: &[u8]) -> Vec<u8> {
    let mut bytes =
        b"\xe0\x7f\x10\x00OB\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\0\0\0\0\xfe\xff\x00\xe0".to_vec();
    let even = stream.len().next_multiple_of(2);
    bytes.extend((even as u32).to_le_bytes());
    bytes.extend(stream);
    bytes.resize(bytes.len() + even - stream.len(), 0);
    bytes.extend(b"\xfe\xff\xdd\xe0\0\0\0\0");
    bytes
}

/// Twelve pixels of one value in run length encoding.
fn runs() -> Vec<u8> {
    let mut stream = vec![0u8; 64];
    stream[..12].copy_from_slice(&[2, 0, 0, 0, 64, 0, 0, 0, 66, 0, 0, 0]);
    stream.extend([245, 0x03, 245, 0xe8]);
    stream
}

/// The header of a lossless JPEG of this size, with a table of one code, and no more pixels than a
/// few bytes hold.
fn jpeg(size: [u16; 2]) -> Vec<u8> {
    let mut stream = vec![0xff, 0xd8, 0xff, 0xc3, 0, 11, 12];
    stream.extend(size[1].to_be_bytes());
    stream.extend(size[0].to_be_bytes());
    stream.extend([1, 1, 0x11, 0, 0xff, 0xc4, 0, 20, 0, 1]);
    stream.extend([0; 15]);
    stream.extend([0, 0xff, 0xda, 0, 8, 1, 1, 0, 1, 0, 0]);
    stream.extend([0; 8]);
    stream.extend([0xff, 0xd9]);
    stream
}

/// The main header of a JPEG 2000 codestream of this size in one tile, and the start of the tile.
fn jpeg2000(size: [u32; 2]) -> Vec<u8> {
    let mut stream = vec![0xff, 0x4f, 0xff, 0x51, 0, 41, 0, 0];
    for number in [size[0], size[1], 0, 0, size[0], size[1], 0, 0] {
        stream.extend(number.to_be_bytes());
    }
    stream.extend([0, 1, 11, 1, 1]);
    stream.extend([0xff, 0x52, 0, 12, 0, 0, 0, 1, 0, 0, 4, 4, 0, 1]);
    stream.extend([0xff, 0x5c, 0, 4, 0x40, 0x60]);
    stream.extend([0xff, 0x90, 0, 10, 0, 0, 0, 0, 0, 15, 0, 1, 0xff, 0x93, 0x80, 0xff, 0xd9]);
    stream
}

pub(crate) fn dicom() -> Vec<Vec<u8>> {
    let stored: Vec<u8> = (1000..1012u16).flat_map(u16::to_le_bytes).collect();
    let raw = element([0x7fe0, 0x10], b"OW", &stored);
    let size = [4, 3];
    vec![
        slice(RAW, size, &raw),
        enhanced(),
        slice("1.2.840.10008.1.2.1.99", size, &raw),
        slice("1.2.840.10008.1.2.5", size, &fragment(&runs())),
        slice("1.2.840.10008.1.2.4.70", size, &fragment(&jpeg(size))),
        slice("1.2.840.10008.1.2.4.70", [65535; 2], &fragment(&jpeg([65535; 2]))),
        slice("1.2.840.10008.1.2.4.90", size, &fragment(&jpeg2000([4, 3]))),
        slice("1.2.840.10008.1.2.4.90", [65535; 2], &fragment(&jpeg2000([65535; 2]))),
    ]
}

pub(crate) fn scenes() -> Vec<Vec<u8>> {
    vec![SCENE.into(), b"[volume]\nphantom = { size = [8, 8, 8] }\n".to_vec()]
}

pub(crate) fn steps() -> Vec<Vec<u8>> {
    let steps = r#"[volume]
phantom = { size = [24, 24, 16] }
[lattice]
spacing_mm = 12.0
[constraints]
distance = { youngs_modulus_pa = 5.0e3 }
volume = { bulk_modulus_pa = 5.0e4 }
[[step]]
kind = "incise"
path_mm = [[30, 110, -50], [30, 110, 50]]
depth_mm = 20.0
at_s = 0.1
speed_mm_s = 500
[[step]]
kind = "hook"
at_mm = [0, 110, 0]
radius_mm = 20.0
move_mm = [0, 10, 0]
at_s = 0.3
[solver]
formulation = "xpbd"
[run]
frames = 30
"#;
    vec![steps.into()]
}

pub(crate) fn overrides() -> Vec<Vec<u8>> {
    let lines = "run.frames=3\nincision[0].depth_mm=5\noutput.volume=true\nsolver.gravity_m_s2=[0, 0, -9.8]";
    let table = "incision=[{ from_mm = [0, 0, 0], to_mm = [9, 0, 0], depth_mm = 3 }]\nmaterials=\"trunk\"";
    vec![lines.into(), table.into()]
}

/// Checkpoints of two vertices after two frames, with one wound: without states of rest, and with
/// one.
pub(crate) fn checkpoints() -> Vec<Vec<u8>> {
    let rest = r#"{"stops":[{"time_s":0.2,"done":[],"mean_mm":[1.0],"mid_mm":[2.0],"sutures_n":[],"handles_n":[],
        "error":0.001,"steps":3,"cycles":20,"ms":0.0}],"last":{"error":0.001,"force":1e-6,"ms":0.0,"steps":[
        {"force":0.1,"moved_mm":1.0,"cycles":7,"error":null}]}}"#;
    ["", rest].map(checkpoint).into()
}

fn checkpoint(rest: &str) -> Vec<u8> {
    let mut bytes = b"CUTISCP5".to_vec();
    bytes.extend([5; 32]);
    bytes.extend(2u32.to_le_bytes());
    bytes.extend(2u64.to_le_bytes());
    (0..6).for_each(|n| bytes.extend((n as f32).to_le_bytes()));
    [1u32, 0, 0, 3].iter().for_each(|count| bytes.extend(count.to_le_bytes()));
    for row in 0..3 {
        [f64::from(row), 0.1, 1.0, 2.0, 3.0, 4.0, 5.0]
            .iter()
            .for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    let length = rest.len().next_multiple_of(4);
    bytes.extend((length as u32).to_le_bytes());
    bytes.extend(rest.bytes());
    bytes.extend(vec![b' '; length - rest.len()]);
    (0..8u32).for_each(|word| bytes.extend(word.to_le_bytes()));
    let seal = Sha256::digest(&bytes);
    bytes.extend(seal);
    bytes
}

pub(crate) fn markups() -> Vec<Vec<u8>> {
    let curve = r#"{"@schema": "https://example.org/markups-schema-v1.0.3.json#", "markups": [
        {"type": "Curve", "coordinateSystem": "LPS", "coordinateUnits": ["mm", "UCUM", "millimeter"],
         "controlPoints": [{"id": "1", "position": [-30, -110, -50], "positionStatus": "defined"},
                           {"position": [-30, -110.5, 5e1], "orientation": [1,0,0,0,1,0,0,0,1]}]},
        {"type": "ROI", "center": [0, 0, 0], "measurements": [{"name": "a", "enabled": false}]}]}"#;
    let closed = r#"{"markups": [{"type": "ClosedCurve", "coordinateSystem": 1, "controlPoints": [
        {"position": [0, 0, 0]}, {"position": [9, 0, 0]}, {"position": [9, 9, 0]}]}]}"#;
    vec![curve.into(), closed.into(), b"# one\nx y z\n0 0 0\n10 0 0\n20 5 0\n\n0 30 0\n10 30 0\n".to_vec()]
}
