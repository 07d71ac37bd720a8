//! VTU files: points, cells, and data of points and cells, read from the bytes.

use std::collections::BTreeMap;

/// A mesh file. Coordinates and vectors are not converted.
pub struct Vtu {
    /// Frame of the coordinates: `LPS` or `RAS`.
    pub space: String,
    pub points: Vec<[f64; 3]>,
    /// Corners per cell: 3 for triangles, 4 for tetrahedra.
    pub corners: usize,
    pub cells: Vec<Vec<usize>>,
    /// Values of each array, flat.
    arrays: BTreeMap<String, Vec<f64>>,
}

impl Vtu {
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let marker = b"<AppendedData encoding=\"raw\">\n_";
        let start = bytes.windows(marker.len()).position(|window| window == marker).unwrap();
        let header = std::str::from_utf8(&bytes[..start]).unwrap();
        let data = &bytes[start + marker.len()..];
        let mut arrays = BTreeMap::new();
        for tag in header.split("<DataArray ").skip(1) {
            let offset: usize = attribute(tag, "offset").parse().unwrap();
            let length = u64::from_le_bytes(data[offset..offset + 8].try_into().unwrap()) as usize;
            let block = &data[offset + 8..offset + 8 + length];
            arrays.insert(attribute(tag, "Name").to_owned(), numbers(attribute(tag, "type"), block));
        }
        let space = header.split("Name=\"SPACE\"").nth(1).unwrap();
        let codes = space.split('>').nth(1).unwrap().split('<').next().unwrap();
        let letters = codes.split(' ').map(|code| code.parse::<u8>().unwrap()).filter(|code| *code != 0);
        let kinds = arrays.remove("types").unwrap();
        let corners = if kinds[0] == 10.0 { 4 } else { 3 };
        assert!(kinds.iter().all(|kind| *kind == [5.0, 10.0][corners - 3]), "one type of cell");
        let connectivity = arrays.remove("connectivity").unwrap();
        arrays.remove("offsets").unwrap();
        let cell = |cell: &[f64]| cell.iter().map(|n| *n as usize).collect();
        Self {
            space: letters.map(char::from).collect(),
            points: arrays.remove("Points").unwrap().chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(),
            corners,
            cells: connectivity.chunks_exact(corners).map(cell).collect(),
            arrays,
        }
    }

    /// Names of the arrays of points and cells, ascending.
    pub fn names(&self) -> Vec<&str> {
        self.arrays.keys().map(String::as_str).collect()
    }

    /// Numbers of the cells.
    pub fn cell_scalars(&self, name: &str) -> &[f64] {
        let values = &self.arrays[name];
        assert_eq!(values.len(), self.cells.len(), "{name}");
        values
    }

    /// Vectors of the cells.
    pub fn cell_vectors(&self, name: &str) -> Vec<[f64; 3]> {
        let values: Vec<[f64; 3]> = self.arrays[name].chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect();
        assert_eq!(values.len(), self.cells.len(), "{name}");
        values
    }

    pub fn scalars(&self, name: &str) -> &[f64] {
        let values = &self.arrays[name];
        assert_eq!(values.len(), self.points.len(), "{name}");
        values
    }

    pub fn vectors(&self, name: &str) -> Vec<[f64; 3]> {
        let values: Vec<[f64; 3]> = self.arrays[name].chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect();
        assert_eq!(values.len(), self.points.len(), "{name}");
        values
    }
}

fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    tag.split(&format!("{name}=\"")).nth(1).unwrap().split('"').next().unwrap()
}

fn numbers(kind: &str, block: &[u8]) -> Vec<f64> {
    match kind {
        "Float32" => {
            block.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()).into()).collect()
        }
        "UInt32" => block.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap()).into()).collect(),
        "UInt8" => block.iter().map(|&b| b.into()).collect(),
        other => panic!("unexpected type {other}"),
    }
}
