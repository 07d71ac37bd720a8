//! Position and orientation of the voxels: from the sform, else the qform, else the voxel sizes.

use std::path::Path;

use nalgebra::Point3;

use super::header::Header;
use crate::{Affine, VolumeError};

/// The map from voxel index to RAS+ mm. Appends warnings about ambiguous or unusual headers.
///
/// # Errors
/// [`VolumeError::Header`] if the matrix of the form that applies is not invertible.
pub(super) fn affine(
    path: &Path,
    header: &Header,
    warnings: &mut Vec<String>,
) -> Result<Affine, VolumeError> {
    let scale = match header.units & 7 {
        0 | 2 => 1.0,
        1 => 1000.0,
        3 => 0.001,
        code => {
            warnings.push(format!("xyzt_units {code} is not a unit of length: lengths are read as mm"));
            1.0
        }
    };
    let sform = || build(path, "srow_x, srow_y, srow_z", header.rows, scale);
    let qform = |spacing| {
        build(
            path,
            "quatern_b, quatern_c, quatern_d, qoffset, pixdim",
            quaternion_rows(header, spacing),
            scale,
        )
    };
    let affine = match (header.sform_code > 0, header.qform_code > 0) {
        (true, true) => {
            let chosen = sform()?;
            match spacing(path, header, &mut Vec::new()).and_then(qform) {
                Ok(other) => {
                    let (distance_mm, voxels) = disagreement(&chosen, &other, header.shape);
                    if voxels > 0.1 {
                        warnings.push(format!(
                            "sform and qform disagree by up to {distance_mm:.3} mm: the sform is used"
                        ));
                    }
                }
                Err(error) => warnings.push(format!("the sform is used, the qform is not valid: {error}")),
            }
            chosen
        }
        (true, false) => sform()?,
        (false, true) => qform(spacing(path, header, warnings)?)?,
        (false, false) => {
            warnings.push(
                "neither sform nor qform is set, so position and orientation are unknown: the axes are assumed to run to the \
                 right, anterior and superior from the first voxel (other programs may assume otherwise)"
                    .into(),
            );
            let [dx, dy, dz] = spacing(path, header, warnings)?;
            let rows = [[dx, 0.0, 0.0, 0.0], [0.0, dy, 0.0, 0.0], [0.0, 0.0, dz, 0.0]];
            build(path, "pixdim", rows, scale)?
        }
    };
    if header.sform_code > 0 {
        for axis in 0..3 {
            let (form, pixdim) = (affine.spacing_mm()[axis], header.pixdim[axis + 1].abs() * scale);
            if (form - pixdim).abs() > 0.01 * form {
                warnings.push(format!(
                    "pixdim[{}] says {pixdim} mm, the sform {form} mm: the sform is used",
                    axis + 1
                ));
            }
        }
    }
    if affine.is_sheared() {
        warnings.push(format!(
            "the voxel axes are not perpendicular (the cosine between two of them is {:.5}): a deformed volume cannot be \
             written on this grid; resample the CT to an orthogonal grid first",
            affine.shear()
        ));
    }
    Ok(affine)
}

fn build(path: &Path, field: &'static str, rows: [[f64; 4]; 3], scale: f64) -> Result<Affine, VolumeError> {
    let [x, y, z] = rows.map(|row| row.map(|v| v * scale));
    Affine::from_rows([x, y, z, [0.0, 0.0, 0.0, 1.0]]).map_err(|_| VolumeError::Header {
        path: path.into(),
        field,
        value: format!("{rows:?}"),
        expected: "finite numbers that map voxels to distinct positions",
    })
}

/// Voxel sizes in the unit of the header. Negative sizes become positive. A size of 0 becomes 1
/// along an axis of one voxel.
fn spacing(path: &Path, header: &Header, warnings: &mut Vec<String>) -> Result<[f64; 3], VolumeError> {
    const FIELDS: [&str; 3] = ["pixdim[1]", "pixdim[2]", "pixdim[3]"];
    let mut spacing = [0.0; 3];
    for axis in 0..3 {
        let size = header.pixdim[axis + 1];
        if size < 0.0 {
            warnings.push(format!("{} is {size}: it is read as {}", FIELDS[axis], -size));
        }
        spacing[axis] = if size == 0.0 && header.shape[axis] == 1 { 1.0 } else { size.abs() };
        if !(spacing[axis] > 0.0 && spacing[axis].is_finite()) {
            return Err(VolumeError::Header {
                path: path.into(),
                field: FIELDS[axis],
                value: size.to_string(),
                expected: "a positive voxel size",
            });
        }
    }
    Ok(spacing)
}

/// Rows of the qform: the rotation of the unit quaternion (a, b, c, d) times the voxel sizes. The
/// third axis is mirrored if `pixdim[0]` (`qfac`) is negative (NIfTI-1 standard, method 2).
fn quaternion_rows(header: &Header, spacing: [f64; 3]) -> [[f64; 4]; 3] {
    let [b, c, d] = header.quaternion;
    let square = b * b + c * c + d * d;
    // A rotation by 180° has a = 0, which f32 can only approximate. The standard's library uses the
    // same limit of 1e-7.
    let (a, [b, c, d]) = if 1.0 - square < 1e-7 {
        (0.0, [b, c, d].map(|v| v / square.sqrt()))
    } else {
        ((1.0 - square).sqrt(), [b, c, d])
    };
    let rotation = [
        [a * a + b * b - c * c - d * d, 2.0 * (b * c - a * d), 2.0 * (b * d + a * c)],
        [2.0 * (b * c + a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d - a * b)],
        [2.0 * (b * d - a * c), 2.0 * (c * d + a * b), a * a + d * d - b * b - c * c],
    ];
    let handedness = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let [dx, dy, dz] = spacing;
    std::array::from_fn(|r| {
        let [x, y, z] = rotation[r];
        [x * dx, y * dy, z * dz * handedness, header.offset[r]]
    })
}

/// Largest distance between the positions that two affines give to a corner of the volume, in mm
/// and in units of the smallest voxel size.
fn disagreement(chosen: &Affine, other: &Affine, shape: [u64; 3]) -> (f64, f64) {
    let distance = (0..8).map(|corner| {
        let at: [f64; 3] =
            std::array::from_fn(|axis| if corner >> axis & 1 == 1 { (shape[axis] - 1) as f64 } else { 0.0 });
        (chosen.to_mm(Point3::from(at)) - other.to_mm(Point3::from(at))).norm()
    });
    let distance_mm = distance.fold(0.0, f64::max);
    (distance_mm, distance_mm / chosen.spacing_mm().into_iter().fold(f64::INFINITY, f64::min))
}
