//! Writes small DICOM files. Their patient has a name, an id, dates and identifiers that no output
//! may show.

use std::path::{Path, PathBuf};

use cutis_volume::{Loaded, ReadOptions, VolumeError, dicom::DicomError};
use dicom_core::{DataElement, PrimitiveValue, Tag, VR};
use dicom_object::{FileMetaTableBuilder, InMemDicomObject};

pub const EXPLICIT: &str = "1.2.840.10008.1.2.1";
pub const CT_IMAGE: &str = "1.2.840.10008.5.1.4.1.1.2";
/// Columns and rows of a slice.
pub const SIZE: [usize; 2] = [4, 3];
/// Parts of the patient's data. None may appear in a message.
pub const SECRETS: [&str; 6] =
    ["SECRET^NAME", "SECRET-ID", "19510203", "20240506", "424242", "SECRET HOSPITAL"];

/// A slice of 4 x 3 unsigned 16-bit pixels with HU = stored − 1024, 2 mm from the next one.
#[derive(Clone)]
pub struct Slice {
    pub object: InMemDicomObject,
    pub syntax: &'static str,
    pub sop_class: String,
}

impl Slice {
    /// The slice at this height, mm, with stored values that count up from 1000.
    pub fn at(z_mm: f64) -> Self {
        let mut slice =
            Self { object: InMemDicomObject::new_empty(), syntax: EXPLICIT, sop_class: CT_IMAGE.into() };
        for (tag, vr, text) in [
            (0x0008_0008, VR::CS, "ORIGINAL\\PRIMARY\\AXIAL"),
            (0x0008_0016, VR::UI, CT_IMAGE),
            (0x0008_0018, VR::UI, "1.2.3.424242.1"),
            (0x0008_0020, VR::DA, "20240506"),
            (0x0008_0060, VR::CS, "CT"),
            (0x0008_0080, VR::LO, "SECRET HOSPITAL"),
            (0x0008_103e, VR::LO, "thin slices"),
            (0x0010_0010, VR::PN, "SECRET^NAME"),
            (0x0010_0020, VR::LO, "SECRET-ID"),
            (0x0010_0030, VR::DA, "19510203"),
            (0x0018_0050, VR::DS, "2"),
            (0x0020_000d, VR::UI, "1.2.3.424242.2"),
            (0x0020_000e, VR::UI, "1.2.3.424242.3"),
            (0x0020_0011, VR::IS, "7"),
            (0x0020_0037, VR::DS, "1\\0\\0\\0\\1\\0"),
            (0x0028_0030, VR::DS, "2\\1.5"),
            (0x0028_1052, VR::DS, "-1024"),
            (0x0028_1053, VR::DS, "1"),
        ] {
            slice = slice.text(tag, vr, text);
        }
        for (tag, value) in [
            (0x0028_0002, 1),
            (0x0028_0010, SIZE[1] as u16),
            (0x0028_0011, SIZE[0] as u16),
            (0x0028_0100, 16),
            (0x0028_0101, 12),
            (0x0028_0102, 11),
            (0x0028_0103, 0),
        ] {
            slice = slice.number(tag, value);
        }
        slice = slice.text(0x0028_0004, VR::CS, "MONOCHROME2");
        slice.position([10.0, 20.0, z_mm]).pixels(&(1000..1012).collect::<Vec<u16>>())
    }

    /// The slices at these heights.
    pub fn stack(z_mm: &[f64]) -> Vec<Self> {
        z_mm.iter().map(|&z| Self::at(z)).collect()
    }

    pub fn element(mut self, tag: u32, vr: VR, value: PrimitiveValue) -> Self {
        self.object.put(DataElement::new(tag_of(tag), vr, value));
        self
    }

    pub fn text(mut self, tag: u32, vr: VR, text: &str) -> Self {
        if tag == 0x0008_0016 {
            self.sop_class = text.into();
        }
        self.element(tag, vr, PrimitiveValue::from(text))
    }

    pub fn number(self, tag: u32, value: u16) -> Self {
        self.element(tag, VR::US, PrimitiveValue::from(value))
    }

    pub fn without(mut self, tag: u32) -> Self {
        self.object.remove_element(tag_of(tag));
        self
    }

    pub fn position(self, mm: [f64; 3]) -> Self {
        self.text(0x0020_0032, VR::DS, &mm.map(|v| format!("{v:.6}")).join("\\"))
    }

    pub fn pixels(self, stored: &[u16]) -> Self {
        self.element(0x7fe0_0010, VR::OW, PrimitiveValue::U16(stored.to_vec().into()))
    }

    pub fn write(&self, path: impl AsRef<Path>) {
        let meta = FileMetaTableBuilder::new()
            .transfer_syntax(self.syntax)
            .media_storage_sop_class_uid(&self.sop_class)
            .media_storage_sop_instance_uid("1.2.3.424242.1");
        self.object.clone().with_meta(meta).unwrap().write_to_file(path).unwrap();
    }
}

fn tag_of(tag: u32) -> Tag {
    Tag((tag >> 16) as u16, tag as u16)
}

/// A folder of slices.
pub struct Folder(pub tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// Writes the slices as `0.dcm`, `1.dcm` and so on.
    pub fn of(slices: &[Slice]) -> Self {
        let folder = Self::new();
        for (n, slice) in slices.iter().enumerate() {
            slice.write(folder.path(&format!("{n}.dcm")));
        }
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn read(&self) -> Result<Loaded, VolumeError> {
        self.read_with(&ReadOptions::default())
    }

    pub fn read_with(&self, options: &ReadOptions) -> Result<Loaded, VolumeError> {
        let read = cutis_volume::read(self.0.path(), options);
        match &read {
            Ok(loaded) => loaded.warnings.iter().for_each(|warning| shows_no_patient(warning)),
            Err(error) => shows_no_patient(&format!("{error} {error:?}")),
        }
        read
    }

    /// Reads the folder, which must be refused.
    pub fn refused(&self) -> DicomError {
        match self.read() {
            Err(VolumeError::Dicom(error)) => *error,
            other => panic!("{other:?}"),
        }
    }
}

/// Fails if a text has data of the patient.
pub fn shows_no_patient(text: &str) {
    for secret in SECRETS {
        assert!(!text.contains(secret), "{secret} is in: {text}");
    }
}

/// The HU of a volume in flat order.
pub fn hu(loaded: &Loaded) -> Vec<f32> {
    loaded.volume.voxels().iter().map(|&stored| loaded.volume.hu(stored)).collect()
}
