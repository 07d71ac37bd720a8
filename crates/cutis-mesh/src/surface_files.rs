//! Writes triangles as PLY and STL, for 3D Slicer and other programs.
//!
//! Both files are binary and little-endian, with positions in world mm. A comment in the header
//! names the frame as `SPACE=LPS` or `SPACE=RAS`, as 3D Slicer writes and reads it.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use cutis_volume::PartialFile;
use nalgebra::Point3;

use crate::vtk::Space;
use crate::{Frame, MeshError};

/// Triangles of a surface file. Positions that no triangle uses are not written to PLY.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Frame of the positions.
    pub frame: &'a Frame,
    /// Positions in local meters.
    pub positions: &'a [Point3<f32>],
    /// Triangles as indices of positions, counterclockwise from outside.
    pub triangles: &'a [[u32; 3]],
}

/// Writes a PLY file.
///
/// The file appears under its name when it is complete.
///
/// ```
/// use cutis_mesh::{Frame, Surface, vtk::Space, write_ply};
/// use nalgebra::Point3;
/// let folder = tempfile::tempdir()?;
/// let surface = Surface {
///     frame: &Frame { origin_mm: Point3::origin() },
///     positions: &[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]].map(Point3::from),
///     triangles: &[[0, 1, 2]],
/// };
/// write_ply(&folder.path().join("skin.ply"), Space::Lps, &surface)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`MeshError::VertexIndex`] for a triangle without its corners, [`MeshError::TooManyCells`] for
/// more triangles than fit into 32 bits, [`MeshError::Volume`] or [`MeshError::Write`] if the file
/// cannot be written.
pub fn write_ply(path: &Path, space: Space, surface: &Surface<'_>) -> Result<(), MeshError> {
    surface.check(path)?;
    let used = surface.used();
    let mut numbers = vec![0_u32; surface.positions.len()];
    used.iter().enumerate().for_each(|(n, &point)| numbers[point as usize] = n as u32);
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment written by Cutis\ncomment SPACE={}\n\
         comment positions in mm\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        space.name(),
        used.len(),
        surface.triangles.len()
    );
    write(path, |out| {
        out.write_all(header.as_bytes())?;
        for &point in &used {
            put(out, surface.corner(space, point))?;
        }
        for triangle in surface.triangles {
            out.write_all(&[3])?;
            triangle.iter().try_for_each(|&point| out.write_all(&numbers[point as usize].to_le_bytes()))?;
        }
        Ok(())
    })
}

/// Writes an STL file.
///
/// The normal of a triangle follows from its corners. The file appears under its name when it is
/// complete.
///
/// # Errors
/// The errors of [`write_ply`].
pub fn write_stl(path: &Path, space: Space, surface: &Surface<'_>) -> Result<(), MeshError> {
    surface.check(path)?;
    // A header of 80 bytes that must not begin with `solid`, the mark of the text format.
    let mut header = format!("Cutis, mm. SPACE={}", space.name()).into_bytes();
    header.resize(80, b' ');
    write(path, |out| {
        out.write_all(&header)?;
        out.write_all(&(surface.triangles.len() as u32).to_le_bytes())?;
        for triangle in surface.triangles {
            let corners = triangle.map(|point| surface.corner(space, point));
            let [a, b, c] = corners.map(|corner| Point3::from(corner).map(f64::from));
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
            put(out, normal.map(|n| n as f32).into())?;
            corners.into_iter().try_for_each(|corner| put(out, corner))?;
            out.write_all(&[0; 2])?;
        }
        Ok(())
    })
}

impl Surface<'_> {
    fn check(&self, path: &Path) -> Result<(), MeshError> {
        let (cells, vertices) = (self.triangles.len(), self.positions.len());
        if cells > i32::MAX as usize / 3 {
            return Err(MeshError::TooManyCells { path: path.to_path_buf(), cells });
        }
        for (position, triangle) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = triangle.iter().find(|&&point| point as usize >= vertices) {
                return Err(MeshError::VertexIndex { array: "triangles", position, vertex, vertices });
            }
        }
        Ok(())
    }

    /// Indices of the positions that a triangle uses, ascending.
    fn used(&self) -> Vec<u32> {
        let mut is_used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&point| is_used[point as usize] = true);
        (0..self.positions.len() as u32).filter(|&point| is_used[point as usize]).collect()
    }

    /// A position in the frame of the file, mm.
    fn corner(&self, space: Space, point: u32) -> [f32; 3] {
        let mm = self.frame.to_mm(self.positions[point as usize]);
        space.of_ras([mm.x as f32, mm.y as f32, mm.z as f32])
    }
}

fn put(out: &mut dyn Write, vector: [f32; 3]) -> io::Result<()> {
    vector.iter().try_for_each(|c| out.write_all(&c.to_le_bytes()))
}

/// Writes a file that appears when it is complete.
fn write(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), MeshError> {
    let mut file = PartialFile::create(path)?;
    let mut out = BufWriter::with_capacity(1 << 16, &mut file);
    let written = content(&mut out).and_then(|()| out.flush());
    written.map_err(|source| MeshError::Write { path: path.to_path_buf(), source })?;
    drop(out);
    Ok(file.commit()?)
}
