//! NIfTI-1 files with 16-bit voxels, written and read byte by byte.

use std::io::{Read, Write};

use flate2::{Compression, read::GzDecoder, write::GzEncoder};

/// A volume of 16-bit voxels and its map from indices to world millimeters (RAS+).
pub struct Nifti {
    pub shape: [usize; 3],
    /// Three rows of the map; the last column is the position of voxel (0, 0, 0).
    pub rows: [[f64; 4]; 3],
    /// The first index runs fastest.
    pub voxels: Vec<i16>,
    /// Slope and intercept from stored value to HU.
    pub scaling: [f64; 2],
    /// Codes of the qform and the sform.
    pub codes: [i16; 2],
}

/// The rows of a qform: rotation by the quaternion (b, c, d), voxel sizes, direction of the third
/// axis, and offset.
fn qform([b, c, d]: [f64; 3], spacing: [f64; 3], third: f64, offset: [f64; 3]) -> [[f64; 4]; 3] {
    let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
    let quaternion = nalgebra::Quaternion::new(a, b, c, d);
    let rotation = nalgebra::UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix();
    let scale = [spacing[0], spacing[1], third * spacing[2]];
    [0, 1, 2].map(|row| {
        let column = |n: usize| if n < 3 { rotation[(row, n)] * scale[n] } else { offset[row] };
        [0, 1, 2, 3].map(column)
    })
}

impl Nifti {
    /// World position of a voxel in mm.
    pub fn at(&self, voxel: usize) -> [f64; 3] {
        let [nx, ny, _] = self.shape;
        let index = [voxel % nx, voxel / nx % ny, voxel / nx / ny].map(|i| i as f64);
        self.rows.map(|row| row[0] * index[0] + row[1] * index[1] + row[2] * index[2] + row[3])
    }

    /// HU of a voxel.
    pub fn hu(&self, voxel: usize) -> f64 {
        f64::from(self.voxels[voxel]) * self.scaling[0] + self.scaling[1]
    }

    /// The file, gzip-compressed.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut header = vec![0_u8; 352];
        let mut put =
            |offset: usize, value: &[u8]| header[offset..offset + value.len()].copy_from_slice(value);
        put(0, &348_i32.to_le_bytes());
        for (n, size) in [3, self.shape[0], self.shape[1], self.shape[2], 1, 1, 1, 1].into_iter().enumerate()
        {
            put(40 + 2 * n, &(size as i16).to_le_bytes());
        }
        put(70, &4_i16.to_le_bytes());
        put(72, &16_i16.to_le_bytes());
        for axis in 0..3 {
            let spacing = self.rows.iter().map(|row| row[axis] * row[axis]).sum::<f64>().sqrt();
            put(80 + 4 * axis, &(spacing as f32).to_le_bytes());
            for column in 0..4 {
                put(280 + 16 * axis + 4 * column, &(self.rows[axis][column] as f32).to_le_bytes());
            }
        }
        put(108, &352_f32.to_le_bytes());
        put(112, &(self.scaling[0] as f32).to_le_bytes());
        put(116, &(self.scaling[1] as f32).to_le_bytes());
        put(123, &[2]);
        put(252, &self.codes[0].to_le_bytes());
        put(254, &self.codes[1].to_le_bytes());
        put(344, b"n+1\0");
        header.extend(self.voxels.iter().flat_map(|voxel| voxel.to_le_bytes()));
        let mut file = GzEncoder::new(Vec::new(), Compression::fast());
        file.write_all(&header).unwrap();
        file.finish().unwrap()
    }

    /// Reads a gzip-compressed file with 16-bit voxels and an sform.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let mut raw = Vec::new();
        GzDecoder::new(bytes).read_to_end(&mut raw).unwrap();
        let short = |offset: usize| i16::from_le_bytes(raw[offset..offset + 2].try_into().unwrap());
        let float = |offset: usize| f32::from_le_bytes(raw[offset..offset + 4].try_into().unwrap());
        assert_eq!((&raw[344..348], short(40), short(70)), (&b"n+1\0"[..], 3, 4), "NIfTI-1, 3 axes, int16");
        assert_eq!(raw[123] & 7, 2, "lengths are in mm");
        let shape = [0, 1, 2].map(|axis| short(42 + 2 * axis) as usize);
        let rows = [0, 1, 2].map(|row| [0, 1, 2, 3].map(|n| f64::from(float(280 + 16 * row + 4 * n))));
        let spacing: [f32; 3] = [0, 1, 2].map(|axis| float(80 + 4 * axis));
        for axis in 0..3 {
            let length = rows.iter().map(|row| row[axis] * row[axis]).sum::<f64>().sqrt();
            assert!((length - f64::from(spacing[axis])).abs() < 1e-4, "pixdim and sform differ");
        }
        let codes = [short(252), short(254)];
        if codes[0] > 0 {
            let [quaternion, offset] = [256, 268].map(|at| [0, 1, 2].map(|n| f64::from(float(at + 4 * n))));
            let found = qform(quaternion, spacing.map(f64::from), f64::from(float(76)), offset);
            for (q, s) in found.iter().flatten().zip(rows.iter().flatten()) {
                assert!((q - s).abs() < 1e-3, "qform {found:?} and sform {rows:?}");
            }
        }
        let start = float(108) as usize;
        let voxels: Vec<i16> =
            raw[start..].chunks_exact(2).map(|pair| i16::from_le_bytes([pair[0], pair[1]])).collect();
        assert_eq!(voxels.len(), shape.iter().product::<usize>());
        Self { shape, rows, voxels, scaling: [float(112), float(116)].map(f64::from), codes }
    }
}
