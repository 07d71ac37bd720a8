//! The readers under test. Each gets the path of a file with the input, and its bytes.

use std::path::Path;

use anyhow::Result;
use cutis::{Checkpoint, LoadedScene, Override, Scene};
use cutis_skin::{DrawnPath, Strokes};
use cutis_volume::{LabelMap, ReadOptions};
use sha2::{Digest, Sha256};

use crate::campaign::ACCEPTED;
use crate::seeds;

/// Longest message of an error, bytes.
const LONGEST_MESSAGE: usize = 4096;
/// Bytes of the checksum at the end of a checkpoint.
const SEAL: usize = 32;

/// A reader of one format.
pub struct Target {
    /// Name for the command line.
    pub name: &'static str,
    /// Name of the file with the input.
    pub(crate) file: &'static str,
    /// Valid inputs.
    pub(crate) seeds: fn() -> Vec<Vec<u8>>,
    /// Words of the format, and of attacks on it.
    pub(crate) words: &'static [&'static [u8]],
    /// Writes the files that lie next to the input.
    pub(crate) prepare: fn(&Path) -> Result<()>,
    /// Reads the input. Returns what the reader said, or what it must not do.
    pub(crate) read: fn(&Path, &[u8]) -> Result<String, String>,
    /// Memory that a byte of the input may take, bytes.
    pub(crate) memory_per_byte: usize,
}

/// Names of files outside the folder of the input, and of none.
const PATHS: [&[u8]; 6] =
    [b"../outside.raw", b"/etc/passwd", b"/dev/zero", b"link.raw", b"voxels.raw", b"./voxels.raw"];

/// All readers.
pub const TARGETS: &[Target] = &[
    Target {
        name: "nifti",
        file: "input.nii",
        seeds: seeds::nifti,
        words: &[b"n+1\0", b"ni1\0", b"n+2\0", b"\x1f\x8b\x08", b"\0\0\x80\x7f", b"\0\0\xc0\x7f"],
        prepare: |_| Ok(()),
        read: volume,
        memory_per_byte: 16,
    },
    Target {
        name: "nrrd",
        file: "input.nrrd",
        seeds: seeds::nrrd,
        words: &[
            PATHS[0],
            PATHS[1],
            PATHS[2],
            PATHS[3],
            PATHS[4],
            PATHS[5],
            b"data file: ",
            b"data file: LIST\n",
            b"byte skip: -1\n",
            b"encoding: gzip\n",
            b"encoding: raw\n",
            b"\n\n",
            b"none ",
            b"(1,0,0) ",
            b" 2",
            b"NRRD0005\n",
        ],
        prepare: neighbors,
        read: volume,
        memory_per_byte: 64,
    },
    Target {
        name: "metaimage",
        file: "input.mha",
        seeds: seeds::metaimage,
        words: &[
            PATHS[0],
            PATHS[1],
            PATHS[2],
            PATHS[3],
            PATHS[4],
            PATHS[5],
            b"ElementDataFile = ",
            b"HeaderSize = -1\n",
            b"CompressedData = True\n",
            b"CompressedDataSize = 7\n",
            b"DimSize = 1 1 1\n",
            b" 1",
            b"\n",
            b"=",
        ],
        prepare: neighbors,
        read: volume,
        memory_per_byte: 64,
    },
    Target {
        name: "dicom",
        file: "input.dcm",
        seeds: seeds::dicom,
        words: &[
            b"DICM",
            b"SQ",
            b"OB",
            b"UN",
            b"\xff\xff\xff\xff",
            b"\xfe\xff\x00\xe0\xff\xff\xff\xff",
            b"\xfe\xff\x0d\xe0\0\0\0\0",
            b"\xfe\xff\xdd\xe0\0\0\0\0",
            b"\xe0\x7f\x10\x00",
            b"1.2.840.10008.1.2.4.70",
            b"1.2.840.10008.1.2.4.90",
            b"\x08\x00\x60\x00CS\0\0",
        ],
        prepare: |_| Ok(()),
        read: dicom,
        memory_per_byte: 128,
    },
    Target {
        name: "scene",
        file: "input.toml",
        seeds: seeds::scenes,
        words: SCENE_WORDS,
        prepare: |_| Ok(()),
        read: scene,
        memory_per_byte: 1000,
    },
    Target {
        name: "steps",
        file: "input.toml",
        seeds: seeds::steps,
        words: SCENE_WORDS,
        prepare: |_| Ok(()),
        read: scene,
        memory_per_byte: 1000,
    },
    Target {
        name: "set",
        file: "input.txt",
        seeds: seeds::overrides,
        words: SCENE_WORDS,
        prepare: |_| Ok(()),
        read: overrides,
        memory_per_byte: 1000,
    },
    Target {
        name: "checkpoint",
        file: "checkpoint.bin",
        seeds: seeds::checkpoints,
        words: &[b"CUTISCP5", b"CUTISCP4"],
        prepare: |_| Ok(()),
        read: checkpoint,
        memory_per_byte: 16,
    },
    Target {
        name: "markups",
        file: "input.mrk.json",
        seeds: seeds::markups,
        words: &[
            b"{",
            b"[",
            b"\"markups\": [",
            b"\"controlPoints\": [",
            b"\"position\": [1, 2, 3]",
            b"\"type\": \"Curve\"",
            b"\"coordinateSystem\": \"RAS\"",
            b"null",
            b"\\u0000",
            b"1e999",
            b"\n\n",
            b"#",
        ],
        prepare: |_| Ok(()),
        read: strokes,
        memory_per_byte: 64,
    },
];

const SCENE_WORDS: &[&[u8]] = &[
    b"[",
    b"]",
    b"[[",
    b"{",
    b"a.",
    b"[a]\n",
    b"[[step]]\n",
    b"kind = \"incise\"\n",
    b"at_s = 0.5\n",
    b"'''",
    b"\"",
    b"nan",
    b"-inf",
    b"9223372036854775807",
    b"\n",
    b"#",
    b"\0",
    b"\xff",
];

/// The reader with this name.
pub fn find(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}

/// Files that a header with a file of voxels may name: one in the folder, and a link out of it.
fn neighbors(folder: &Path) -> Result<()> {
    std::fs::write(folder.join("voxels.raw"), [0; 48])?;
    #[cfg(unix)]
    std::os::unix::fs::symlink("../outside.raw", folder.join("link.raw"))?;
    Ok(())
}

/// What a reader said. An error must name the file and must not be long.
fn said<T>(result: Result<T, impl std::fmt::Display>, name: &str) -> Result<String, String> {
    let Err(error) = result else { return Ok(ACCEPTED.into()) };
    let text = error.to_string();
    match text.len() {
        0 => Err("an error without a message".into()),
        LONGEST_MESSAGE.. => Err(format!("a message of {} bytes", text.len())),
        _ if !text.contains(name) => Err(format!("the message does not name the file {name}: {text}")),
        _ => Ok(text),
    }
}

fn volume(path: &Path, _: &[u8]) -> Result<String, String> {
    let folder = path.parent().and_then(|folder| folder.canonicalize().ok()).ok_or("no folder")?;
    let mut outside = None;
    let read = cutis_volume::read_observed(path, &ReadOptions::default(), |file, _| {
        if !file.canonicalize().is_ok_and(|file| file.starts_with(&folder)) {
            outside = Some(file.to_owned());
        }
    });
    if let Some(file) = outside {
        return Err(format!("{} was read, which is outside the folder of the input", file.display()));
    }
    if let Ok(loaded) = &read {
        let (grid, voxels) = (loaded.volume.grid(), loaded.volume.voxels().len());
        if grid.len() != voxels {
            return Err(format!("{voxels} voxels on a grid of {:?}", grid.shape));
        }
        let resampled = cutis_volume::read(path, &ReadOptions { resample: true, ..ReadOptions::default() });
        if let Err(error) = &resampled
            && error.to_string().is_empty()
        {
            return Err("resampling gave an error without a message".into());
        }
    }
    // Labels have a reader of their own.
    if let Ok((labels, _)) = LabelMap::read(path)
        && labels.bytes().len() != labels.grid().len() * labels.voxel_bytes()
    {
        return Err("labels do not fill their grid".into());
    }
    // An error names the header or its file of voxels.
    said(read, &path.with_file_name("").display().to_string())
}

fn dicom(path: &Path, _: &[u8]) -> Result<String, String> {
    let listed = path.parent().map(cutis_volume::dicom::list);
    if let Some(Err(error)) = listed {
        return Err(format!("the folder cannot be listed: {error}"));
    }
    let read = cutis_volume::read(path, &ReadOptions::default());
    if let Ok(loaded) = &read
        && loaded.volume.grid().len() != loaded.volume.voxels().len()
    {
        return Err("voxels do not fill the grid".into());
    }
    said(read, "input.dcm")
}

fn scene(path: &Path, _: &[u8]) -> Result<String, String> {
    ends_well(Scene::load(path, &[]), "input.toml")
}

/// An accepted scene can be written to a report and read back. An error must blame the input.
fn ends_well(loaded: Result<LoadedScene, cutis::Error>, name: &str) -> Result<String, String> {
    match &loaded {
        Ok(loaded) => {
            let text = serde_json::to_string(&loaded.scene).map_err(|error| error.to_string())?;
            serde_json::from_str::<Scene>(&text)
                .map_err(|error| format!("a report cannot be read: {error}"))?;
        }
        Err(error) if !error.is_bad_input() => return Err(format!("the input is not blamed: {error}")),
        Err(_) => {}
    }
    said(loaded, name)
}

/// Each line is one `--set`.
fn overrides(_: &Path, input: &[u8]) -> Result<String, String> {
    let text = String::from_utf8_lossy(input);
    let parsed: Result<Vec<Override>, String> = text.lines().map(str::parse).collect();
    match parsed {
        Err(message) if message.is_empty() => Err("an error without a message".into()),
        // The message of an argument holds it, and the shell limits its length.
        Err(_) => Ok("refused".into()),
        Ok(overrides) => {
            let scene = Scene::parse(seeds::SCENE, Path::new("input.toml"), Path::new(""), &overrides);
            ends_well(scene, "input.toml")
        }
    }
}

fn checkpoint(path: &Path, input: &[u8]) -> Result<String, String> {
    let _ = said(Checkpoint::parse(path, input), "checkpoint.bin")?;
    // Lengths are only reached with the right checksum.
    let (content, _) = input.split_at(input.len().saturating_sub(SEAL));
    let sealed = [content, &Sha256::digest(content)].concat();
    let parsed = Checkpoint::parse(path, &sealed);
    if let Ok(saved) = &parsed
        && saved.words.len() < 3 * saved.positions.len()
    {
        return Err("fewer than three words for each vertex".into());
    }
    said(parsed, "checkpoint.bin")
}

fn strokes(path: &Path, input: &[u8]) -> Result<String, String> {
    if let Ok(drawn) = DrawnPath::parse(path, input)
        && !(2..=DrawnPath::MAX_POINTS).contains(&drawn.points_mm().len())
    {
        return Err(format!("a path of {} points", drawn.points_mm().len()));
    }
    said(Strokes::parse(path, input), "input.mrk.json")
}
