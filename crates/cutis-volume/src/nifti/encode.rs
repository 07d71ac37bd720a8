//! Encodes the 348 bytes of a NIfTI-1 header and the four bytes after it.

use std::path::Path;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

use crate::voxels::VoxelType;
use crate::{Affine, Grid, VolumeError};

/// Offset of the first voxel: after the header and an empty list of extensions.
const VOXEL_OFFSET: usize = 352;
const MILLIMETER: u8 = 2;
/// The code `NIFTI_XFORM_SCANNER_ANAT`.
const SCANNER: i16 = 1;

/// Encodes the header for voxels of a type on `grid`, with slope and intercept. `path` appears in
/// error messages.
pub(super) fn encode(
    path: &Path,
    grid: &Grid,
    dtype: VoxelType,
    [slope, intercept]: [f32; 2],
) -> Result<Vec<u8>, VolumeError> {
    let shape = grid.shape;
    if shape.iter().any(|&n| n == 0 || n > i16::MAX as usize) {
        return Err(VolumeError::WriteShape { path: path.into(), shape });
    }
    if grid.affine.is_sheared() {
        return Err(VolumeError::Sheared { path: path.into(), cosine: grid.affine.shear() });
    }
    let mut header = Fields(vec![0; VOXEL_OFFSET]);
    header.i32(0, &[348]);
    header.0[38] = b'r';
    header.i16(40, &[3, shape[0] as i16, shape[1] as i16, shape[2] as i16, 1, 1, 1, 1]);
    header.i16(70, &[dtype.code(), 8 * dtype.bytes() as i16]);
    let [dx, dy, dz] = grid.affine.spacing_mm();
    let (quaternion, handedness) = rotation(&grid.affine);
    header.f32(76, &[handedness, dx, dy, dz, 1.0, 1.0, 1.0, 1.0]);
    header.f32(108, &[VOXEL_OFFSET as f64, f64::from(slope), f64::from(intercept)]);
    header.0[123] = MILLIMETER;
    header.0[148..153].copy_from_slice(b"Cutis");
    header.i16(252, &[SCANNER, SCANNER]);
    let rows = grid.affine.rows();
    let origin: [f64; 3] = std::array::from_fn(|r| rows[r][3]);
    header.f32(256, &quaternion);
    header.f32(268, &origin);
    header.f32(280, rows[..3].as_flattened());
    header.0[344..348].copy_from_slice(b"n+1\0");
    Ok(header.0)
}

/// The quaternion (b, c, d), with a ≥ 0, of the rotation nearest to the affine, and `qfac`: −1 if
/// the third axis is mirrored, else 1.
fn rotation(affine: &Affine) -> ([f64; 3], f64) {
    let mut axes = Matrix3::from_fn(|r, c| affine.step_mm(c)[r] / affine.spacing_mm()[c]);
    let handedness = axes.determinant().signum();
    axes.column_mut(2).scale_mut(handedness);
    let nearest = match axes.svd(true, true) {
        nalgebra::SVD { u: Some(u), v_t: Some(v_t), .. } => u * v_t,
        _ => axes,
    };
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(nearest)).into_inner();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    ([q.i * sign, q.j * sign, q.k * sign], handedness)
}

/// Header bytes with little-endian fields.
struct Fields(Vec<u8>);

impl Fields {
    fn put(&mut self, at: usize, bytes: impl Iterator<Item = u8>) {
        self.0[at..].iter_mut().zip(bytes).for_each(|(slot, byte)| *slot = byte);
    }

    fn i32(&mut self, at: usize, values: &[i32]) {
        self.put(at, values.iter().flat_map(|v| v.to_le_bytes()));
    }

    fn i16(&mut self, at: usize, values: &[i16]) {
        self.put(at, values.iter().flat_map(|v| v.to_le_bytes()));
    }

    fn f32(&mut self, at: usize, values: &[f64]) {
        self.put(at, values.iter().flat_map(|&v| (v as f32).to_le_bytes()));
    }
}
