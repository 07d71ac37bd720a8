//! Checkpoints: the exact state from which `--resume` continues.
//!
//! Layout, little-endian: magic (8 bytes), fingerprint of scene and volume (32), frame (u32),
//! vertex count (u64), positions (3 × f32 per vertex, m, local frame), history, states of rest,
//! three words of 32 bits per vertex, further words, SHA-256 of all that (32). The history is that
//! of [`history`](super::history), and the states of rest are those of [`rests`](super::rests).
//! With the model `pbd` the words are velocities (f32, m/s), the distance at which each thread
//! began to pull (f32, m), and the positions at which handles with an `at_s` grabbed their vertices
//! (f32, m); what has not happened is NaN. With `chainmail` they are coordinates (i32, units of the
//! chain), the energy after the last drag (f64, mm², two words), the coordinates at which the
//! handles grabbed their elements (0 before that), and the elements that
//! [`Chain::strained`](cutis_chainmail::Chain::strained) lists.

use std::path::Path;

use nalgebra::Point3;
use sha2::{Digest, Sha256};

use super::frames::FrameRow;
use super::history;
use super::rests::{self, Rests};
use crate::run::files;
use crate::{Error, Scene};

/// Why the checkpoint of another scene is refused.
pub(crate) const OTHER_SCENE: &str = "scene, volume or program version differ from those that wrote it; give the same \
                                      --set as for the run";

const MAGIC: &[u8; 8] = b"CUTISCP5";
const HEADER: usize = 8 + 32 + 4 + 8;
const SEAL: usize = 32;

/// State after a whole number of frames, or a state of rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Number of frames that have passed.
    pub frame: u32,
    /// Positions of the vertices, local meters.
    pub positions: Vec<Point3<f32>>,
    /// The rest of the state, as the model defines it; at least three words per vertex.
    pub words: Vec<u32>,
    /// The state before the first frame and one row per computed frame, without their wall times.
    pub(crate) history: Vec<FrameRow>,
    /// The states of rest up to this one. None for a state after a frame.
    pub(crate) rests: Option<Rests>,
}

/// Identifies scene and volume. It ignores the keys that a resumed run may change: number of
/// frames, outputs, threads, backend.
pub(crate) fn fingerprint(scene: &Scene, volume_sha256: &str) -> [u8; 32] {
    let mut scene = scene.clone();
    scene.run = crate::scene::RunSection::default();
    scene.output = crate::scene::OutputSection::default();
    scene.solver = crate::scene::SolverSection {
        backend: crate::scene::BackendChoice::default(),
        adapter: None,
        threads: 0,
        ..scene.solver
    };
    scene.volume.path = None;
    let text = serde_json::to_string(&scene).unwrap_or_default();
    Sha256::new()
        .chain_update(env!("CARGO_PKG_VERSION"))
        .chain_update(volume_sha256)
        .chain_update(text)
        .finalize()
        .into()
}

impl Checkpoint {
    /// A state without what came before it.
    pub(crate) fn of(frame: u32, positions: Vec<Point3<f32>>, words: Vec<u32>) -> Self {
        Self { frame, positions, words, history: Vec::new(), rests: None }
    }

    /// The frame that began last, in which cuts were made. A state of rest has the cuts of the
    /// frame that would come next. None before the first frame.
    pub(crate) fn last_begun(&self) -> Option<u32> {
        if self.rests.is_some() { Some(self.frame) } else { self.frame.checked_sub(1) }
    }

    /// Writes the checkpoint as a file.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be written.
    pub(crate) fn write(&self, path: &Path, fingerprint: &[u8; 32]) -> Result<(), Error> {
        let mut bytes = Vec::with_capacity(HEADER + 12 * self.positions.len() + 4 * self.words.len() + SEAL);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(fingerprint);
        bytes.extend_from_slice(&self.frame.to_le_bytes());
        bytes.extend_from_slice(&(self.positions.len() as u64).to_le_bytes());
        let positions = self.positions.iter().flat_map(|p| [p.x, p.y, p.z]).map(f32::to_bits);
        positions.for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()));
        history::encode(&self.history, &mut bytes);
        rests::encode(self.rests.as_ref(), &mut bytes);
        self.words.iter().for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()));
        let seal = Sha256::digest(&bytes);
        bytes.extend_from_slice(&seal);
        files::write(path, &bytes)
    }

    /// Whether there is a checkpoint.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] if there is no such file.
    pub(crate) fn find(path: &Path) -> Result<(), Error> {
        let why = match path.parent() {
            _ if path.exists() => return Ok(()),
            Some(folder) if !folder.exists() => format!("there is no folder {}", folder.display()),
            _ => "there is no such file; a run with run.checkpoint_every above 0 writes it".into(),
        };
        Err(Error::Checkpoint { path: path.into(), why })
    }

    /// Reads a checkpoint of a scene with `vertices` vertices.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read, [`Error::Checkpoint`] if it is missing, damaged or of
    /// another scene.
    pub(crate) fn read(path: &Path, fingerprint: &[u8; 32], vertices: usize) -> Result<Self, Error> {
        let fail = |why: String| Error::Checkpoint { path: path.into(), why };
        Self::find(path)?;
        let bytes = files::read(path)?;
        let saved = Self::parse(path, &bytes)?;
        if bytes[8..40] != fingerprint[..] {
            return Err(fail(OTHER_SCENE.into()));
        }
        match saved.positions.len() == vertices {
            true => Ok(saved),
            false => Err(fail(format!("it has {} vertices, and the body {vertices}", saved.positions.len()))),
        }
    }

    /// Reads a checkpoint from the bytes of a file. `path` names it in messages. Which scene wrote
    /// it is not checked.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] for a file of another kind or version, for one that is truncated or
    /// changed, and for lengths that contradict each other.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let fail = |why: String| Error::Checkpoint { path: path.into(), why };
        let (kind, version) = MAGIC.split_at(MAGIC.len() - 1);
        if !bytes.starts_with(kind) {
            return Err(fail("it does not begin as one".into()));
        }
        match bytes.get(kind.len()) {
            Some(found) if version == [*found] => {}
            Some(found) if found.is_ascii_digit() => {
                let [found, own] = [*found, version[0]].map(char::from);
                let why = format!(
                    "it has version {found}, and this program reads version {own}; begin again without --resume"
                );
                return Err(fail(why));
            }
            _ => return Err(fail("it does not begin as one".into())),
        }
        let damaged = || fail("its checksum is wrong: the file is damaged or truncated".into());
        let (content, seal) = bytes.split_last_chunk::<SEAL>().ok_or_else(damaged)?;
        if content.len() < HEADER || Sha256::digest(content)[..] != seal[..] {
            return Err(damaged());
        }
        // The checksum is no proof of a good writer, so that the lengths are checked too.
        let (header, rest) = content.split_at(HEADER);
        let frame = u32::from_le_bytes([header[40], header[41], header[42], header[43]]);
        let count = header[44..].iter().rev().fold(0, |count, &byte| count << 8 | u64::from(byte));
        let vertices = usize::try_from(count).ok().filter(|&count| count <= rest.len() / 24);
        let vertices =
            vertices.ok_or_else(|| fail(format!("it holds fewer bytes than {count} vertices need")))?;
        let (positions, rest) = rest.split_at(12 * vertices);
        let (history, rest) = history::decode(rest).ok_or_else(|| fail("its history is damaged".into()))?;
        let (rests, rest) =
            rests::decode(rest).ok_or_else(|| fail("its states of rest are damaged".into()))?;
        let words = |bytes: &[u8]| -> Vec<u32> {
            bytes.as_chunks::<4>().0.iter().map(|&word| u32::from_le_bytes(word)).collect()
        };
        let (positions, words) = (words(positions), words(rest));
        if words.len() < 3 * vertices || rest.len() % 4 != 0 {
            return Err(fail(format!(
                "it holds {} bytes after the states of rest of {vertices} vertices",
                rest.len()
            )));
        }
        let positions = positions.as_chunks::<3>().0.iter().map(|p| Point3::from(p.map(f32::from_bits)));
        Ok(Self { frame, positions: positions.collect(), words, history, rests })
    }
}
