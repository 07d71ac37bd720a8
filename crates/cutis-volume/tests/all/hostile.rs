//! Damaged, hostile and unusual files, built byte by byte.

use std::fs;
use std::io::Write;

use cutis_volume::{Loaded, VolumeError, nifti};
use flate2::{Compression, write::GzEncoder};
use proptest::prelude::*;

/// The bytes of a NIfTI-1 file with 2 × 3 × 4 voxels by default.
#[derive(Clone)]
struct Image {
    bytes: Vec<u8>,
}

impl Image {
    fn new(datatype: i16, voxels: &[u8]) -> Self {
        let mut image = Self { bytes: vec![0; 352] };
        image.put(0, &348i32.to_le_bytes());
        image.dim(&[3, 2, 3, 4]);
        image.put(70, &datatype.to_le_bytes());
        for (n, size) in [1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
            image.f32(76 + 4 * n, size);
        }
        image.f32(108, 352.0);
        image.f32(112, 1.0);
        image.put(123, &[2]);
        image.put(254, &1i16.to_le_bytes());
        for (at, value) in [(280, 2.0), (300, 3.0), (320, 4.0)] {
            image.f32(at, value);
        }
        image.put(344, b"n+1\0");
        image.bytes.extend(voxels);
        image
    }

    fn int16() -> Self {
        Self::new(4, &[0; 48])
    }

    fn put(&mut self, at: usize, bytes: &[u8]) -> &mut Self {
        self.bytes[at..at + bytes.len()].copy_from_slice(bytes);
        self
    }

    fn f32(&mut self, at: usize, value: f32) -> &mut Self {
        self.put(at, &value.to_le_bytes())
    }

    fn dim(&mut self, dim: &[i16]) -> &mut Self {
        for (n, size) in dim.iter().enumerate() {
            self.put(40 + 2 * n, &size.to_le_bytes());
        }
        self
    }

    fn read(&self) -> Result<Loaded, VolumeError> {
        read("scan.nii", &self.bytes)
    }

    /// Reads the file, which must fail with an error that names it.
    fn refused(&self) -> VolumeError {
        let error = self.read().unwrap_err();
        assert!(error.to_string().contains("scan.nii"), "{error}");
        error
    }
}

fn read(name: &str, bytes: &[u8]) -> Result<Loaded, VolumeError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    nifti::read(path)
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn invalid_headers_are_refused_with_the_name_of_the_field() {
    assert!(Image::int16().read().is_ok());
    type Change = fn(&mut Image) -> &mut Image;
    let cases: [(&str, Change); 15] = [
        ("dim[0]", |i| i.dim(&[0])),
        ("dim[0]", |i| i.dim(&[8])),
        ("dim[1]", |i| i.dim(&[3, -2])),
        ("dim[3]", |i| i.dim(&[3, 2, 3, 0])),
        ("dim[4]", |i| i.dim(&[4, 2, 3, 4, 0])),
        ("vox_offset", |i| i.f32(108, 0.0)),
        ("vox_offset", |i| i.f32(108, -352.0)),
        ("vox_offset", |i| i.f32(108, f32::NAN)),
        ("vox_offset", |i| i.f32(108, 352.5)),
        ("vox_offset", |i| i.f32(108, 1e30)),
        ("scl_inter", |i| i.f32(116, f32::INFINITY)),
        ("srow", |i| i.f32(280, 0.0)),
        ("srow", |i| i.f32(280, f32::NAN)),
        ("pixdim[2]", |i| i.put(252, &[1, 0, 0, 0]).f32(84, 0.0)),
        ("magic", |i| i.put(344, b"ni1\0")),
    ];
    for (field, change) in cases {
        let error = change(&mut Image::int16()).refused();
        assert!(
            matches!(error, VolumeError::Header { .. }) && error.to_string().contains(field),
            "{field}: {error}"
        );
    }
    for bytes in [&b""[..], b"348", b"not a NIfTI file", &Image::int16().bytes[..300]] {
        assert!(matches!(read("scan.nii", bytes), Err(VolumeError::NotNifti { .. })));
    }
    assert!(matches!(Image::int16().put(344, &[0; 4]).refused(), VolumeError::NotNifti { .. }));
    for code in [0, 1, 32, 128, 1536, 1792, 2048, 2304, -7] {
        let error = Image::int16().put(70, &i16::to_le_bytes(code)).refused();
        assert!(matches!(error, VolumeError::VoxelType { .. }), "{error}");
    }
}

#[test]
fn small_files_with_headers_of_large_volumes_are_refused() {
    let mut image = Image::int16();
    image.dim(&[3, 32767, 32767, 32767]);
    assert!(matches!(image.refused(), VolumeError::Truncated { .. }));
    let packed = gzip(&image.bytes);
    assert!(packed.len() < 1024);
    // The error gives the most that a file of this length can hold. The 48 bytes of voxels are not
    // decompressed.
    let most = packed.len() as u64 * 1032 - 352;
    assert!(
        matches!(read("scan.nii.gz", &packed), Err(VolumeError::Truncated { found_bytes, .. }) if found_bytes == most)
    );
    // The product of the shape can overflow only in NIfTI-2.
    let mut large = vec![0; 600];
    large[..4].copy_from_slice(&540i32.to_le_bytes());
    large[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
    large[12..14].copy_from_slice(&4i16.to_le_bytes());
    for (n, size) in [3, i64::MAX, i64::MAX, 9].into_iter().enumerate() {
        large[16 + 8 * n..24 + 8 * n].copy_from_slice(&size.to_le_bytes());
    }
    for n in 0..4 {
        large[104 + 8 * n..112 + 8 * n].copy_from_slice(&1f64.to_le_bytes());
    }
    large[168..176].copy_from_slice(&544i64.to_le_bytes());
    large[344] = 1;
    assert!(matches!(read("scan.nii", &large), Err(VolumeError::TooLarge { .. })));
}

#[test]
fn a_gzip_bomb_is_unpacked_only_up_to_the_size_in_the_header() {
    let mut bytes = Image::int16().bytes;
    bytes.resize(4 << 20, 0);
    let mut packed = gzip(&bytes);
    // The checksum is wrong, so that decompression to the end would fail.
    let checksum = packed.len() - 8;
    packed[checksum] ^= 1;
    let loaded = read("scan.nii.gz", &packed).unwrap();
    assert_eq!(loaded.volume.voxels().len(), 24);
    assert!(
        loaded.warnings.iter().any(|warning| warning.contains("after the last voxel")),
        "{:?}",
        loaded.warnings
    );
}

/// Zeros after the last member are padding. Other bytes are ignored with a warning, as nibabel and
/// ITK ignore them.
#[test]
fn bytes_after_the_last_gzip_member_are_ignored() {
    let voxels: Vec<u8> = (0..48).map(|n| n * 5).collect();
    let packed = gzip(&Image::new(4, &voxels).bytes);
    let whole = read("scan.nii.gz", &packed).unwrap();
    let behind = |bytes: &[u8]| read("scan.nii.gz", &[&packed, bytes].concat()).unwrap();
    for (bytes, warns) in [(vec![0; 1000], false), (b"no member".to_vec(), true), (vec![0, 0, 7], true)] {
        let loaded = behind(&bytes);
        assert_eq!(loaded.volume, whole.volume);
        let warned = loaded.warnings.iter().any(|line| line.contains("after the last gzip member"));
        assert_eq!((warned, loaded.warnings.len()), (warns, usize::from(warns)), "{:?}", loaded.warnings);
    }
}

#[test]
fn damaged_gzip_files_are_refused() {
    let voxels: Vec<u8> = (0..48).map(|n| n * 5).collect();
    let packed = gzip(&Image::new(4, &voxels).bytes);
    let whole = read("scan.nii.gz", &packed).unwrap();
    assert!(whole.warnings.is_empty());
    for cut in 1..packed.len() - 2 {
        assert!(read("scan.nii.gz", &packed[..packed.len() - cut]).is_err(), "{cut} bytes short");
    }
    // Trailing bytes do not make up for bytes that are missing.
    for cut in [1, 9, packed.len() / 2] {
        let short = [&packed[..packed.len() - cut], &[7; 64]].concat();
        assert!(read("scan.nii.gz", &short).is_err(), "{cut} bytes short, with others behind");
    }
    let mut wrong_checksum = packed.clone();
    let at = packed.len() - 7;
    wrong_checksum[at] ^= 1;
    assert!(matches!(read("scan.nii.gz", &wrong_checksum), Err(VolumeError::Io { .. })));
    // The content decides, not the extension of the name.
    assert_eq!(read("scan.nii", &packed).unwrap().volume, whole.volume);
}

#[test]
fn pairs_need_both_files() {
    let folder = tempfile::tempdir().unwrap();
    let mut image = Image::new(4, &[7; 48]);
    image.put(344, b"ni1\0").f32(108, 0.0);
    let [header, voxels] = ["Scan.HDR", "Scan.IMG"].map(|name| folder.path().join(name));
    fs::write(&header, &image.bytes[..348]).unwrap();
    let error = nifti::read(&header).unwrap_err();
    assert!(
        matches!(error, VolumeError::MissingPartner { .. }) && error.to_string().contains("Scan.IMG"),
        "{error}"
    );
    fs::write(&voxels, &image.bytes[352..]).unwrap();
    let loaded = nifti::read(&voxels).unwrap();
    assert_eq!(loaded.volume, nifti::read(&header).unwrap().volume);
    assert_eq!(loaded.volume.voxels(), [0x0707; 24]);
    fs::write(&voxels, &image.bytes[353..]).unwrap();
    assert!(matches!(
        nifti::read(&header),
        Err(VolumeError::Truncated { expected_bytes: 48, found_bytes: 47, .. })
    ));
    fs::remove_file(&header).unwrap();
    assert!(matches!(nifti::read(&voxels), Err(VolumeError::MissingPartner { .. })));
    assert!(matches!(nifti::read(folder.path().join("none.hdr")), Err(VolumeError::Io { .. })));
    let error = nifti::read(folder.path()).unwrap_err();
    assert!(
        matches!(error, VolumeError::NotNifti { .. }) && error.to_string().contains("dcm2niix"),
        "{error}"
    );
}

#[test]
fn the_observer_receives_every_byte_of_each_file() {
    let folder = tempfile::tempdir().unwrap();
    let observed = |name: &str| {
        let mut files: Vec<(String, Vec<u8>)> = Vec::new();
        nifti::read_observed(folder.path().join(name), |file, bytes| {
            let file = file.file_name().unwrap().to_string_lossy().into_owned();
            if files.last().is_none_or(|(last, _)| *last != file) {
                files.push((file, Vec::new()));
            }
            files.last_mut().unwrap().1.extend(bytes);
        })
        .unwrap();
        files
    };
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let mut long = Image::int16().bytes;
    // Many more bytes after the last voxel than the reader decodes.
    long.extend((0..3_000_000u32).flat_map(|n| n.wrapping_mul(2_654_435_761).to_le_bytes()));
    for (name, bytes) in [("long.nii", long.clone()), ("long.nii.gz", gzip(&long))] {
        write(name, &bytes);
        assert!(observed(name) == [(name.into(), bytes)], "{name}");
    }
    let mut pair = Image::int16();
    pair.put(344, b"ni1\0").f32(108, 0.0);
    let header = gzip(&pair.bytes);
    write("pair.hdr.gz", &header);
    write("pair.img", &long[352..]);
    let expected = [("pair.hdr.gz".into(), header), ("pair.img".into(), long[352..].to_vec())];
    assert!(observed("pair.hdr.gz") == expected);
    assert!(observed("pair.img") == expected);
}

fn bytes_of<const N: usize, T: Copy>(values: &[T], encode: fn(T) -> [u8; N]) -> Vec<u8> {
    (0..24).flat_map(|n| encode(values[n % values.len()])).collect()
}

#[test]
fn uint16_values_above_int16_are_shifted() {
    let loaded = Image::new(512, &bytes_of(&[0u16, 65535, 1024, 40000], u16::to_le_bytes)).read().unwrap();
    let volume = &loaded.volume;
    let hu: Vec<f32> = volume.voxels()[..4].iter().map(|&stored| volume.hu(stored)).collect();
    assert_eq!(hu, [0.0, 65535.0, 1024.0, 40000.0]);
    assert_eq!((volume.slope(), volume.intercept()), (1.0, 32768.0));
    assert_eq!((loaded.stats.min, loaded.stats.max, loaded.stats.sum), (0.0, 65535.0, 6.0 * 106559.0));
    assert_eq!(loaded.dtype, "uint16");
}

#[test]
fn wide_types_are_rounded_to_whole_hu() {
    let mut image = Image::new(16, &bytes_of(&[-1000.25f32, 40.5, f32::NAN, 3000.0], f32::to_le_bytes));
    let loaded = image.read().unwrap();
    assert_eq!(loaded.volume.voxels()[..4], [-1000, 41, -1024, 3000]);
    assert_eq!(loaded.stats.nan_count, 6);
    assert_eq!(loaded.stats.sum, 6.0 * 2040.25);
    assert!(loaded.warnings[0].contains("5.000e-1 HU"), "{:?}", loaded.warnings);
    assert!(loaded.warnings[1].contains("6 voxels are NaN"), "{:?}", loaded.warnings);

    image.put(352 + 4 * 7, &f32::NEG_INFINITY.to_le_bytes());
    assert!(matches!(
        image.refused(),
        VolumeError::Infinite { index: [1, 0, 1], value: f64::NEG_INFINITY, .. }
    ));
    image.put(352 + 4 * 7, &40000f32.to_le_bytes());
    assert!(matches!(image.refused(), VolumeError::Range { max: 40000.0, .. }));

    let all_nan = Image::new(16, &bytes_of(&[f32::NAN], f32::to_le_bytes)).read().unwrap();
    assert!(all_nan.stats.min.is_nan() && all_nan.stats.nan_count == 24);

    for (code, bytes) in [
        (8, bytes_of(&[-1024i32, 3071], i32::to_le_bytes)),
        (1024, bytes_of(&[-1024i64, 3071], i64::to_le_bytes)),
        (64, bytes_of(&[-1024f64, 3071.0], f64::to_le_bytes)),
    ] {
        let loaded = Image::new(code, &bytes).read().unwrap();
        assert_eq!(loaded.volume.voxels()[..2], [-1024, 3071]);
        assert!(loaded.warnings.is_empty());
    }
    for (code, bytes) in [
        (768, bytes_of(&[5u32, u32::MAX], u32::to_le_bytes)),
        (1280, bytes_of(&[u64::MAX], u64::to_le_bytes)),
    ] {
        assert!(matches!(Image::new(code, &bytes).refused(), VolumeError::Range { .. }));
    }
    let loaded = Image::new(256, &bytes_of(&[-128i8, 127], i8::to_le_bytes)).read().unwrap();
    assert_eq!((loaded.stats.min, loaded.stats.max, loaded.dtype), (-128.0, 127.0, "int8"));
}

#[test]
fn units_missing_axes_and_mirrored_axes_are_handled() {
    let spacing = |image: &mut Image| image.read().unwrap().volume.grid().affine.spacing_mm();
    assert_eq!(spacing(Image::int16().put(123, &[0])), [2.0, 3.0, 4.0]);
    assert_eq!(spacing(Image::int16().put(123, &[1 | 8])), [2000.0, 3000.0, 4000.0]);
    assert_eq!(spacing(Image::int16().put(123, &[3])), [0.002, 0.003, 0.004]);
    assert!(Image::int16().put(123, &[5]).read().unwrap().warnings[0].contains("xyzt_units"));
    let flat = Image::int16().dim(&[2, 6, 4, -9]).read().unwrap();
    assert_eq!(flat.volume.grid().shape, [6, 4, 1]);
    let mirrored = Image::int16().put(252, &[1, 0, 0, 0]).f32(76, -1.0).read().unwrap();
    assert!(mirrored.volume.grid().affine.voxel_volume_mm3() < 0.0);
}

#[test]
fn forms_that_disagree_give_warnings() {
    let both = || Image::int16().put(252, &[1, 0, 2, 0]).clone();
    let warnings = |image: &Image| image.read().unwrap().warnings;
    assert_eq!(warnings(&both()), Vec::<String>::new());
    let moved = warnings(both().f32(292, 5.0));
    assert!(moved.len() == 1 && moved[0].contains("sform and qform disagree by up to 5.000 mm"), "{moved:?}");
    let resized = warnings(Image::int16().f32(80, 2.5));
    assert!(resized.len() == 1 && resized[0].contains("pixdim[1] says 2.5 mm"), "{resized:?}");
    let broken = warnings(both().f32(268, f32::NAN));
    assert!(broken.len() == 1 && broken[0].contains("the qform is not valid"), "{broken:?}");
    let neither = warnings(Image::int16().put(254, &[0]));
    assert!(neither.len() == 1 && neither[0].contains("neither sform nor qform"), "{neither:?}");
    let negative = warnings(Image::int16().put(252, &[1, 0, 0, 0]).f32(84, -3.0));
    assert!(negative.len() == 1 && negative[0].contains("pixdim[2] is -3"), "{negative:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..700), magic in 0usize..4) {
        let mut bytes = bytes;
        let start: &[u8] = [&[][..], &[0x5c, 1, 0, 0], &[0, 0, 2, 0x1c], &[0x1f, 0x8b, 8]][magic];
        let len = start.len().min(bytes.len());
        bytes[..len].copy_from_slice(&start[..len]);
        let _ = read("scan.nii", &bytes);
        let _ = read("scan.nii.gz", &gzip(&bytes));
    }

    #[test]
    fn mutated_headers_never_panic(
        changes in prop::collection::vec((0usize..352, any::<u8>()), 1..12),
        datatype in prop::sample::select(vec![2i16, 4, 8, 16, 64, 256, 512, 768, 1024, 1280]),
        gz: bool,
    ) {
        let mut image = Image::new(datatype, &[3; 24 * 8]);
        for (at, byte) in changes {
            image.bytes[at] = byte;
        }
        let bytes = if gz { gzip(&image.bytes) } else { image.bytes };
        if let Ok(loaded) = read("scan.nii", &bytes) {
            prop_assert!(loaded.volume.voxels().len() <= 24 * 8);
        }
    }
}
