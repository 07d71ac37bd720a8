//! A header names a file of voxels. It cannot make a program read a file outside its folder, wait
//! for a pipe, or spend the time and memory of the machine.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use cutis_volume::{LabelMap, Loaded, ReadOptions, VolumeError};

const NRRD: &str = "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 3 4\n\
                    space directions: (2,0,0) (0,3,0) (0,0,4)\nendian: little\nencoding: raw\n\
                    data file: NAME\n\n";
const META: &str = "ObjectType = Image\nNDims = 3\nElementSpacing = 2 3 4\nDimSize = 2 3 4\n\
                    ElementType = MET_SHORT\nElementDataFile = NAME\n";

fn read(path: impl AsRef<Path>) -> Result<Loaded, VolumeError> {
    cutis_volume::read(path, &ReadOptions::default())
}

/// A folder with `in`, which has voxels and a folder `sub` with the same, and with voxels outside.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir_all(folder.path().join("in/sub")).unwrap();
    for name in ["outside.raw", "in/voxels.raw", "in/sub/voxels.raw"] {
        fs::write(folder.path().join(name), [7; 48]).unwrap();
    }
    folder
}

#[test]
fn a_file_of_voxels_lies_in_the_folder_of_its_header() {
    let here = folder();
    let outside = here.path().join("outside.raw");
    for (header, text) in [("in/v.nhdr", NRRD), ("in/v.mhd", META)] {
        let with = |name: &str| {
            fs::write(here.path().join(header), text.replace("NAME", name)).unwrap();
            read(here.path().join(header))
        };
        for name in ["voxels.raw", "./voxels.raw", "sub/voxels.raw"] {
            assert_eq!(with(name).unwrap().volume.voxels(), [0x0707; 24], "{name}");
        }
        for name in
            ["../outside.raw", "sub/../../outside.raw", outside.to_str().unwrap(), "/etc/passwd", "/dev/zero"]
        {
            let error = with(name).unwrap_err();
            assert!(matches!(error, VolumeError::Header { .. }), "{name}: {error}");
            assert!(error.to_string().contains("in the folder of the header"), "{error}");
        }
        for (name, words) in [("sub", "not a regular file"), ("missing.raw", "missing.raw")] {
            let error = with(name).unwrap_err();
            assert!(matches!(error, VolumeError::Io { .. }) && error.to_string().contains(words), "{error}");
        }
    }
}

#[cfg(unix)]
#[test]
fn a_link_does_not_lead_out_of_the_folder() {
    use std::os::unix::fs::symlink;
    let here = folder();
    let at = |name: &str| here.path().join(name);
    symlink("../outside.raw", at("in/out.raw")).unwrap();
    symlink("sub/voxels.raw", at("in/inside.raw")).unwrap();
    for (header, text) in [("v.nhdr", NRRD), ("v.mhd", META)] {
        let path = at("in").join(header);
        fs::write(&path, text.replace("NAME", "out.raw")).unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, VolumeError::Header { .. }) && error.to_string().contains("link"), "{error}");
        fs::write(&path, text.replace("NAME", "inside.raw")).unwrap();
        assert_eq!(read(&path).unwrap().volume.voxels(), [0x0707; 24]);
        // Links to both files of a volume elsewhere.
        fs::write(&path, text.replace("NAME", "voxels.raw")).unwrap();
        let links = at("links");
        fs::create_dir_all(&links).unwrap();
        symlink(&path, links.join(header)).unwrap();
        let _ = symlink(at("in/voxels.raw"), links.join("voxels.raw"));
        assert_eq!(read(links.join(header)).unwrap().volume.voxels(), [0x0707; 24]);
    }
}

/// Opening a pipe waits until somebody writes to it, which may be never.
#[cfg(unix)]
#[test]
fn a_pipe_is_refused_and_not_waited_for() {
    let here = folder();
    let at = |name: &str| here.path().join(name);
    for name in ["in/pipe.raw", "in/pipe.nii", "in/pipe.img"] {
        assert!(std::process::Command::new("mkfifo").arg(at(name)).status().unwrap().success());
    }
    fs::write(at("in/v.nhdr"), NRRD.replace("NAME", "pipe.raw")).unwrap();
    fs::write(at("in/v.mhd"), META.replace("NAME", "pipe.raw")).unwrap();
    fs::write(at("in/v.nii"), [0; 400]).unwrap();
    for name in ["in/v.nhdr", "in/v.mhd", "in/pipe.nii", "in/pipe.img"] {
        for error in [read(at(name)).unwrap_err(), LabelMap::read(at(name)).unwrap_err()] {
            assert!(error.to_string().contains("not a regular file"), "{name}: {error}");
        }
    }
}

/// A header of a megabyte once took time that grew with the square of its length.
#[test]
fn countless_axes_are_refused_at_once() {
    let here = folder();
    let many = format!("sizes: {}", "2 ".repeat(400_000));
    let path = here.path().join("v.nrrd");
    let text = NRRD.replace("sizes: 2 3 4", &many).replace("data file: NAME\n", "");
    fs::write(&path, text.replace("space directions: (2,0,0) (0,3,0) (0,0,4)\n", "")).unwrap();
    let start = Instant::now();
    let error = read(&path).unwrap_err().to_string();
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    assert!(error.contains("sizes") && error.len() < 1000, "{error}");
    let path = here.path().join("v.mha");
    fs::write(
        &path,
        META.replace("2 3 4\n", &format!("{}\n", "2 ".repeat(400_000))).replace("NAME", "LOCAL"),
    )
    .unwrap();
    assert!(read(&path).unwrap_err().to_string().len() < 1000);
}

/// A file of some megabytes of zeros in gzip unpacks to gigabytes. An uncompressed file cannot.
#[test]
fn a_small_file_that_unpacks_to_gigabytes_is_refused_before_it_is_unpacked() {
    use std::io::Write;
    let here = folder();
    let header = NRRD.replace("data file: NAME\n", "").replace("sizes: 2 3 4", "sizes: 1000 1000 1000");
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    // Two gigabytes would take long to pack. The claim is enough, if the file could hold it.
    packed.write_all(&[0; 1 << 16]).unwrap();
    let mut bytes = header.replace("encoding: raw", "encoding: gzip").into_bytes();
    bytes.extend(packed.finish().unwrap());
    bytes.resize(3 << 20, 0);
    let path = here.path().join("v.nrrd");
    fs::write(&path, &bytes).unwrap();
    let error = read(&path).unwrap_err();
    assert!(
        matches!(error, VolumeError::Expansion { file_bytes: 3_145_728, bytes: 2_000_000_000, .. }),
        "{error}"
    );
    // Control: a file that is long enough for the claim is unpacked, and then found to be short.
    bytes.resize(11 << 20, 0);
    fs::write(&path, &bytes).unwrap();
    assert!(matches!(read(&path), Err(VolumeError::Truncated { .. })));
}
