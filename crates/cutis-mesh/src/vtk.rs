//! Writes VTU files (tets or triangles) and VTP files (triangles) for ParaView, PyVista and 3D
//! Slicer.
//!
//! The files are XML with appended raw little-endian data: `Float32` points in world mm, `UInt32`
//! connectivity and `UInt64` block lengths. The field data `SPACE` names the world frame of the
//! coordinates. 3D Slicer reads it.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use cutis_volume::PartialFile;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::{Frame, MeshError};

/// World frame of the coordinates in a mesh file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Space {
    /// Left, posterior, superior: the frame of 3D Slicer and DICOM. The first two coordinates are
    /// the negatives of those in RAS.
    #[default]
    Lps,
    /// Right, anterior, superior: the frame of NIfTI and of Cutis.
    Ras,
}

impl Space {
    /// The name in mesh files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Lps => "LPS",
            Self::Ras => "RAS",
        }
    }

    /// A vector in RAS axes in the axes of this frame.
    pub(crate) fn of_ras(self, v: [f32; 3]) -> [f32; 3] {
        if self == Self::Lps { [-v[0], -v[1], v[2]] } else { v }
    }
}

/// A named array with one value per position or per cell. The name should include the unit: `hu`,
/// `displacement_mm`.
#[derive(Clone, Copy, Debug)]
pub struct DataArray<'a> {
    /// Name of the array: letters, digits, `_`, `-` and `.`.
    pub name: &'a str,
    /// The values.
    pub values: Values<'a>,
}

/// One number or vector per position or per cell.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Numbers.
    Scalars(&'a [f32]),
    /// Vectors in RAS+ axes. They are converted to the space of the file.
    Vectors(&'a [[f32; 3]]),
}

impl DataArray<'_> {
    fn len(&self) -> usize {
        match self.values {
            Values::Scalars(values) => values.len(),
            Values::Vectors(vectors) => vectors.len(),
        }
    }

    /// Numbers per value.
    fn components(&self) -> usize {
        match self.values {
            Values::Scalars(_) => 1,
            Values::Vectors(_) => 3,
        }
    }
}

/// The cells of a mesh file, as indices of positions.
#[derive(Clone, Copy, Debug)]
pub enum Cells<'a> {
    /// Tetrahedra.
    Tets(&'a [[u32; 4]]),
    /// Triangles.
    Triangles(&'a [[u32; 3]]),
}

/// The content of a mesh file. Positions that no cell uses are not written, nor are their values.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'a> {
    /// Frame of the positions.
    pub frame: &'a Frame,
    /// Positions in local meters.
    pub positions: &'a [Point3<f32>],
    /// The cells.
    pub cells: Cells<'a>,
    /// Values at the positions.
    pub data: &'a [DataArray<'a>],
    /// Values of the cells.
    pub cell_data: &'a [DataArray<'a>],
}

/// Writes an unstructured grid (`.vtu`) of tets or triangles.
///
/// The file appears under its name when it is complete.
///
/// ```
/// use cutis_mesh::{Frame, vtk};
/// use nalgebra::Point3;
/// let folder = tempfile::tempdir()?;
/// let piece = vtk::Piece {
///     frame: &Frame { origin_mm: Point3::origin() },
///     positions: &[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]].map(Point3::from),
///     cells: vtk::Cells::Triangles(&[[0, 1, 2]]),
///     data: &[vtk::DataArray { name: "hu", values: vtk::Values::Scalars(&[40.0, 50.0, 60.0]) }],
///     cell_data: &[vtk::DataArray { name: "normal", values: vtk::Values::Vectors(&[[0.0, 0.0, 1.0]]) }],
/// };
/// vtk::write_vtu(&folder.path().join("skin.vtu"), vtk::Space::Lps, &piece)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`MeshError::VertexIndex`], [`MeshError::ArrayLength`] or [`MeshError::ArrayName`] if the piece
/// is not consistent. [`MeshError::TooManyCells`] if the offsets exceed 32 bits.
/// [`MeshError::Volume`] or [`MeshError::Write`] if the file cannot be written.
pub fn write_vtu(path: &Path, space: Space, piece: &Piece<'_>) -> Result<(), MeshError> {
    MeshFile::new(path, space, piece, Format::UnstructuredGrid)?.write()
}

/// Writes a surface (`.vtp`) of triangles.
///
/// # Errors
/// The errors of [`write_vtu`], and [`MeshError::NotASurface`] if the cells are tets.
pub fn write_vtp(path: &Path, space: Space, piece: &Piece<'_>) -> Result<(), MeshError> {
    if let Cells::Tets(_) = piece.cells {
        return Err(MeshError::NotASurface { path: path.to_path_buf() });
    }
    MeshFile::new(path, space, piece, Format::PolyData)?.write()
}

/// Returns an error for an array with a name that is not valid, or without one value per point or
/// cell.
fn check_arrays(
    path: &Path,
    arrays: &[DataArray<'_>],
    elements: &'static str,
    expected: usize,
) -> Result<(), MeshError> {
    for data in arrays {
        let plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        if data.name.is_empty() || !data.name.chars().all(plain) {
            return Err(MeshError::ArrayName { path: path.to_path_buf(), name: data.name.to_owned() });
        }
        let found = data.len();
        if found != expected {
            let (path, array) = (path.to_path_buf(), data.name.to_owned());
            return Err(MeshError::ArrayLength { path, array, elements, expected, found });
        }
    }
    Ok(())
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    UnstructuredGrid,
    PolyData,
}

/// A checked piece that is ready to be written.
struct MeshFile<'a> {
    path: &'a Path,
    space: Space,
    piece: &'a Piece<'a>,
    format: Format,
    connectivity: &'a [u32],
    corners: usize,
    /// Indices of the positions to write, ascending.
    used: Vec<u32>,
}

impl<'a> MeshFile<'a> {
    fn new(path: &'a Path, space: Space, piece: &'a Piece<'a>, format: Format) -> Result<Self, MeshError> {
        let (connectivity, corners) = match piece.cells {
            Cells::Tets(tets) => (bytemuck::cast_slice(tets), 4),
            Cells::Triangles(triangles) => (bytemuck::cast_slice(triangles), 3),
        };
        let points = piece.positions.len();
        check_arrays(path, piece.data, "points", points)?;
        check_arrays(path, piece.cell_data, "cells", connectivity.len() / corners)?;
        if connectivity.len() > u32::MAX as usize {
            let cells = connectivity.len() / corners;
            return Err(MeshError::TooManyCells { path: path.to_path_buf(), cells });
        }
        let mut is_used = vec![false; points];
        for (position, &vertex) in connectivity.iter().enumerate() {
            match is_used.get_mut(vertex as usize) {
                Some(used) => *used = true,
                None => {
                    let position = position / corners;
                    return Err(MeshError::VertexIndex {
                        array: "cells",
                        position,
                        vertex,
                        vertices: points,
                    });
                }
            }
        }
        let used = (0..points as u32).filter(|&point| is_used[point as usize]).collect();
        Ok(Self { path, space, piece, format, connectivity, corners, used })
    }

    fn write(&self) -> Result<(), MeshError> {
        let mut file = PartialFile::create(self.path)?;
        let failed = |source| MeshError::Write { path: self.path.to_path_buf(), source };
        let mut out = BufWriter::with_capacity(1 << 16, &mut file);
        self.header(&mut out)
            .and_then(|()| self.blocks(&mut out))
            .and_then(|()| out.flush())
            .map_err(failed)?;
        drop(out);
        Ok(file.commit()?)
    }

    fn header(&self, out: &mut impl Write) -> io::Result<()> {
        let (points, cells) = (self.used.len(), self.connectivity.len() / self.corners);
        let (element, name) = match self.format {
            Format::UnstructuredGrid => ("UnstructuredGrid", "Cells"),
            Format::PolyData => ("PolyData", "Polys"),
        };
        let space = self.space.name();
        let codes: Vec<String> = space.bytes().chain([0]).map(|byte| byte.to_string()).collect();
        let mut offset = 0usize;
        let mut array = |data_type: &str, name: &str, components: usize, count: usize, size: usize| {
            let tag = format!(
                r#"<DataArray type="{data_type}" Name="{name}" NumberOfComponents="{components}" format="appended" offset="{offset}"/>"#
            );
            offset += 8 + count * components * size;
            tag
        };
        writeln!(out, r#"<?xml version="1.0"?>"#)?;
        writeln!(
            out,
            r#"<VTKFile type="{element}" version="1.0" byte_order="LittleEndian" header_type="UInt64">"#
        )?;
        writeln!(out, "<{element}>\n<FieldData>")?;
        writeln!(
            out,
            r#"<Array type="String" Name="SPACE" NumberOfTuples="1" format="ascii">{}</Array>"#,
            codes.join(" ")
        )?;
        writeln!(out, "</FieldData>")?;
        match self.format {
            Format::UnstructuredGrid => {
                writeln!(out, r#"<Piece NumberOfPoints="{points}" NumberOfCells="{cells}">"#)?;
            }
            Format::PolyData => writeln!(
                out,
                r#"<Piece NumberOfPoints="{points}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{cells}">"#
            )?,
        }
        writeln!(out, "<PointData>")?;
        for data in self.piece.data {
            writeln!(out, "{}", array("Float32", data.name, data.components(), points, 4))?;
        }
        writeln!(out, "</PointData>")?;
        if !self.piece.cell_data.is_empty() {
            writeln!(out, "<CellData>")?;
            for data in self.piece.cell_data {
                writeln!(out, "{}", array("Float32", data.name, data.components(), cells, 4))?;
            }
            writeln!(out, "</CellData>")?;
        }
        writeln!(out, "<Points>\n{}\n</Points>", array("Float32", "Points", 3, points, 4))?;
        writeln!(out, "<{name}>\n{}", array("UInt32", "connectivity", 1, self.connectivity.len(), 4))?;
        writeln!(out, "{}", array("UInt32", "offsets", 1, cells, 4))?;
        if self.format == Format::UnstructuredGrid {
            writeln!(out, "{}", array("UInt8", "types", 1, cells, 1))?;
        }
        write!(out, "</{name}>\n</Piece>\n</{element}>\n<AppendedData encoding=\"raw\">\n_")
    }

    /// Writes the arrays in the order of the header, each after its length in bytes.
    fn blocks(&self, out: &mut impl Write) -> io::Result<()> {
        let (points, cells) = (self.used.len(), self.connectivity.len() / self.corners);
        let length = |out: &mut dyn Write, bytes: usize| out.write_all(&(bytes as u64).to_le_bytes());
        let vector = |out: &mut dyn Write, v: [f32; 3]| {
            self.space.of_ras(v).iter().try_for_each(|c| out.write_all(&c.to_le_bytes()))
        };
        let used = || self.used.iter().map(|&point| point as usize);
        for data in self.piece.data {
            match data.values {
                Values::Scalars(values) => {
                    length(out, 4 * points)?;
                    used().try_for_each(|point| out.write_all(&values[point].to_le_bytes()))?;
                }
                Values::Vectors(vectors) => {
                    length(out, 12 * points)?;
                    used().try_for_each(|point| vector(out, vectors[point]))?;
                }
            }
        }
        for data in self.piece.cell_data {
            length(out, 4 * data.components() * cells)?;
            match data.values {
                Values::Scalars(values) => {
                    values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))?;
                }
                Values::Vectors(vectors) => vectors.iter().try_for_each(|&v| vector(out, v))?,
            }
        }
        length(out, 12 * points)?;
        used().try_for_each(|point| {
            let mm = self.piece.frame.to_mm(self.piece.positions[point]);
            vector(out, [mm.x as f32, mm.y as f32, mm.z as f32])
        })?;
        let mut number = vec![0u32; self.piece.positions.len()];
        self.used.iter().enumerate().for_each(|(n, &point)| number[point as usize] = n as u32);
        length(out, 4 * self.connectivity.len())?;
        self.connectivity
            .iter()
            .try_for_each(|&point| out.write_all(&number[point as usize].to_le_bytes()))?;
        length(out, 4 * cells)?;
        (1..=cells).try_for_each(|cell| out.write_all(&((cell * self.corners) as u32).to_le_bytes()))?;
        if self.format == Format::UnstructuredGrid {
            // VTK_TRIANGLE is 5, VTK_TETRA is 10.
            let code = if self.corners == 3 { 5 } else { 10 };
            length(out, cells)?;
            (0..cells).try_for_each(|_| out.write_all(&[code]))?;
        }
        out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }
}
