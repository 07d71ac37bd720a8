//! Grids of lattices that cover a volume.

use std::str::FromStr;

use crate::{Affine, Grid, VolumeError};

/// Vertices are numbered in 32 bits.
const MOST_VERTICES: u64 = u32::MAX as u64;

/// Size of a lattice over a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LatticeSize {
    /// One vertex on every voxel center.
    Native,
    /// Spacing in mm. It is rounded to the nearest value that divides the extent of the volume
    /// evenly.
    SpacingMm(f64),
    /// Number of vertices along each axis.
    Vertices([usize; 3]),
}

impl FromStr for LatticeSize {
    type Err = VolumeError;

    /// Parses `native`, a spacing in mm such as `4.0`, or vertices per axis such as `129,107,118`.
    fn from_str(text: &str) -> Result<Self, VolumeError> {
        let wrong = || VolumeError::LatticeText { text: text.into() };
        if text.trim() == "native" {
            return Ok(Self::Native);
        }
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        match parts[..] {
            [spacing] => spacing.parse().map(Self::SpacingMm).map_err(|_| wrong()),
            [x, y, z] => match (x.parse(), y.parse(), z.parse()) {
                (Ok(x), Ok(y), Ok(z)) => Ok(Self::Vertices([x, y, z])),
                _ => Err(wrong()),
            },
            _ => Err(wrong()),
        }
    }
}

/// The grid of a lattice over `voxels`. It reaches from the first to the last voxel center along
/// each axis.
///
/// # Errors
/// [`VolumeError::LatticeSpacing`] if the spacing is not a positive length.
/// [`VolumeError::LatticeSize`] if an axis has fewer than two vertices or voxels, or the lattice
/// has more than 2³² − 1 vertices.
pub fn lattice_grid(voxels: &Grid, size: LatticeSize) -> Result<Grid, VolumeError> {
    let shape = voxels.shape;
    let vertices: [f64; 3] = match size {
        LatticeSize::Native => shape.map(|n| n as f64),
        LatticeSize::Vertices(vertices) => vertices.map(|n| n as f64),
        LatticeSize::SpacingMm(spacing_mm) if spacing_mm > 0.0 && spacing_mm.is_finite() => {
            let step = voxels.affine.spacing_mm();
            std::array::from_fn(|axis| {
                (shape[axis].saturating_sub(1) as f64 * step[axis] / spacing_mm).round() + 1.0
            })
        }
        LatticeSize::SpacingMm(spacing_mm) => return Err(VolumeError::LatticeSpacing { spacing_mm }),
    };
    let possible = shape.iter().all(|&n| n >= 2)
        && vertices.iter().all(|&n| n >= 2.0)
        && vertices.iter().product::<f64>() <= MOST_VERTICES as f64;
    if !possible {
        return Err(VolumeError::LatticeSize { vertices, shape, most: MOST_VERTICES });
    }
    let mut rows = voxels.affine.rows();
    for row in &mut rows[..3] {
        for axis in 0..3 {
            row[axis] *= (shape[axis] - 1) as f64 / (vertices[axis] - 1.0);
        }
    }
    Ok(Grid { shape: vertices.map(|n| n as usize), affine: Affine::from_rows(rows)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn voxels(shape: [usize; 3]) -> Grid {
        let rows = [[-2.0, 0.0, 0.0, 9.0], [0.0, 0.0, 3.0, -4.0], [0.0, 2.5, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]];
        Grid { shape, affine: Affine::from_rows(rows).unwrap() }
    }

    #[test]
    fn impossible_sizes_are_printed_as_counts() {
        let refused = |mm| lattice_grid(&voxels([101, 33, 48]), LatticeSize::SpacingMm(mm)).unwrap_err();
        let text = refused(0.001).to_string();
        assert!(text.contains("[200001, 80001, 141001] vertices"), "{text}");
        assert!(refused(1e-300).to_string().contains("e302"), "{}", refused(1e-300));
    }

    #[test]
    fn the_corners_of_lattice_and_volume_coincide() {
        let volume = voxels([101, 33, 48]);
        for text in ["native", "4.0", "51, 17 ,90", "7"] {
            let lattice = lattice_grid(&volume, text.parse().unwrap()).unwrap();
            assert_eq!(lattice.mm([0; 3]), volume.mm([0; 3]));
            let difference =
                lattice.mm(lattice.shape.map(|n| n - 1)) - volume.mm(volume.shape.map(|n| n - 1));
            assert!(difference.norm() < 1e-10, "{text}: {difference:?}");
        }
        assert_eq!(lattice_grid(&volume, LatticeSize::Native).unwrap(), volume);
        assert_eq!(lattice_grid(&volume, LatticeSize::SpacingMm(4.0)).unwrap().shape, [51, 21, 36]);
    }

    #[test]
    fn impossible_sizes_are_refused() {
        for text in ["", "four", "1,2", "1,2,x", "1,2,-3", "4mm", "1,2,3,4", "native,"] {
            assert!(matches!(text.parse::<LatticeSize>(), Err(VolumeError::LatticeText { .. })), "{text:?}");
        }
        for text in ["0", "-1", "nan", "inf"] {
            let size = text.parse().unwrap();
            assert!(
                matches!(lattice_grid(&voxels([9; 3]), size), Err(VolumeError::LatticeSpacing { .. })),
                "{text}"
            );
        }
        for text in
            ["1e-300", "1e300", "1,9,9", "4294967295,2,2", "18446744073709551615,18446744073709551615,9"]
        {
            let size = text.parse().unwrap();
            assert!(
                matches!(lattice_grid(&voxels([9; 3]), size), Err(VolumeError::LatticeSize { .. })),
                "{text}"
            );
        }
        assert!(matches!(
            lattice_grid(&voxels([9, 9, 1]), LatticeSize::Native),
            Err(VolumeError::LatticeSize { .. })
        ));
    }
}
