//! The material of each vertex: the first row of the scene's table that holds its HU and its depth.

use cutis_mesh::{TetMesh, TissueMask};
use cutis_skin::{BodySkin, depth_mm};
use rayon::prelude::*;

use super::BodySections;
use crate::Error;
use crate::output::report::MaterialRow;
use crate::scene::{MATERIALS_KEY, SceneFile, TissueMaterialSection};

/// The scene's table of materials, and the row of each vertex of the mesh.
pub(crate) struct BodyMaterials {
    pub(crate) rows: Vec<TissueMaterialSection>,
    /// Number of the row of each vertex.
    pub(crate) row_of_vertex: Vec<u8>,
}

impl BodyMaterials {
    /// Finds the row of each vertex of a mesh that is not cut yet. None if the scene has no table.
    ///
    /// Depths are computed only if a row names a depth. They are those of the whole uncut body, so
    /// a vertex of a region of interest has the depth that it has in the whole body. `hu` has one
    /// value per lattice point. `skin` is in lattice points.
    ///
    /// # Errors
    /// [`Error::SceneKey`] for a vertex that no row holds, and for a depth without a skin.
    pub(super) fn assign(
        sections: &BodySections<'_>,
        whole: &TissueMask,
        hu: &[f32],
        mesh: &TetMesh,
        skin: &[[u32; 3]],
    ) -> Result<Option<Self>, Error> {
        let Some(materials) = sections.materials else { return Ok(None) };
        let (file, rows) = (sections.file, materials.rows(sections.file)?);
        let depths = depths_mm(file, &rows, whole, hu, skin)?;
        let depth_mm = |vertex: usize| Some(depths.as_ref()?[mesh.lattice_index[vertex] as usize]);
        let row_of = |vertex: usize| {
            let (hu, depth_mm) = (mesh.hu[vertex], depth_mm(vertex).unwrap_or(0.0));
            rows.iter().position(|row| row.holds(hu, depth_mm)).map(|row| row as u8)
        };
        let found: Vec<Option<u8>> = (0..mesh.hu.len()).into_par_iter().map(row_of).collect();
        if let Some(vertex) = found.iter().position(Option::is_none) {
            let count = found.iter().filter(|row| row.is_none()).count();
            let why = not_held(&rows, mesh, vertex, depth_mm(vertex), count);
            return Err(file.bad_key(MATERIALS_KEY, "", &why));
        }
        Ok(Some(Self { rows, row_of_vertex: found.into_iter().flatten().collect() }))
    }

    /// Adds the virtual nodes of cuts, each with the material of the vertex at its place.
    pub(super) fn add_nodes(&mut self, twins: &[u32]) {
        let rows: Vec<u8> = twins.iter().map(|&vertex| self.row_of_vertex[vertex as usize]).collect();
        self.row_of_vertex.extend(rows);
    }

    /// The rows with the number of vertices of each, and of tetrahedra that lie wholly in it.
    pub(crate) fn report(&self, mesh: &TetMesh) -> Vec<MaterialRow> {
        let (mut vertices, mut tets) = (vec![0; self.rows.len()], vec![0; self.rows.len()]);
        self.row_of_vertex.iter().for_each(|&row| vertices[usize::from(row)] += 1);
        for tet in &mesh.tets {
            let [first, others @ ..] = tet.map(|vertex| self.row_of_vertex[vertex as usize]);
            tets[usize::from(first)] += usize::from(others == [first; 3]);
        }
        let counts = vertices.into_iter().zip(tets);
        let row = |(row, (vertices, tets)): (&TissueMaterialSection, (usize, usize))| MaterialRow {
            name: row.name.clone(),
            hu: row.hu,
            depth_mm: row.depth_mm,
            youngs_modulus_pa: row.youngs_modulus_pa,
            bulk_modulus_pa: row.bulk_modulus_pa,
            vertices,
            tets,
            source: row.source.clone(),
        };
        self.rows.iter().zip(counts).map(row).collect()
    }

    /// Warnings about layers that are thinner than a step of the lattice.
    pub(super) fn warnings(&self, mesh: &TetMesh) -> Vec<String> {
        let step = mesh.lattice.longest_step_mm();
        let thickness = |row: &TissueMaterialSection| row.depth_mm.map(|[low, high]| high - low);
        let thin = self.rows.iter().enumerate().filter(|(_, row)| thickness(row).is_some_and(|mm| mm < step));
        let warning = |(n, row): (usize, &TissueMaterialSection)| {
            format!(
                "{MATERIALS_KEY}[{n}] (`{}`) is a layer thinner than the lattice step of {step:.2} mm: it acts \
                 like a layer of about half a step, or is missed. Use a lattice.spacing_mm of {:.1} or less, or \
                 leave the layer to the skin (constraints.membrane)",
                row.name,
                thickness(row).unwrap_or_default()
            )
        };
        thin.map(warning).collect()
    }
}

/// Depth of each lattice point below the skin, mm; infinite beyond the depths of the table. None if
/// no row names a depth.
fn depths_mm(
    file: SceneFile<'_>,
    rows: &[TissueMaterialSection],
    whole: &TissueMask,
    hu: &[f32],
    skin: &[[u32; 3]],
) -> Result<Option<Vec<f32>>, Error> {
    let bounds = rows.iter().filter_map(|row| row.depth_mm).flatten();
    let Some(limit_mm) = bounds.reduce(f64::max) else { return Ok(None) };
    if skin.is_empty() {
        let why = "names a depth below the skin, but the body has no skin (skin.mode)";
        return Err(file.bad_key(MATERIALS_KEY, "", why));
    }
    let found = BodySkin::new(whole.lattice(), hu, whole.vertices(), skin);
    let depths = found.and_then(|skin| depth_mm(&skin, limit_mm));
    depths.map(Some).map_err(file.blame(MATERIALS_KEY))
}

/// Text about a vertex that no row holds: its HU, its depth, and the nearest rows. `depth_mm` is
/// infinite beyond the depths of the table, and none if no row names a depth.
fn not_held(
    rows: &[TissueMaterialSection],
    mesh: &TetMesh,
    vertex: usize,
    depth_mm: Option<f32>,
    count: usize,
) -> String {
    let deepest = rows.iter().filter_map(|row| row.depth_mm).map(|[_, high]| high as f32).fold(0.0, f32::max);
    let (hu, depth) = (mesh.hu[vertex], depth_mm.unwrap_or(0.0).min(deepest));
    let shown = match depth_mm {
        Some(depth) if depth.is_finite() => format!(", {depth} mm below the skin"),
        Some(_) => ", deeper below the skin than all layers".to_owned(),
        None => String::new(),
    };
    let least = |holds: &dyn Fn(&TissueMaterialSection) -> bool,
                 gap: &dyn Fn(&TissueMaterialSection) -> f32| {
        let candidates = rows.iter().enumerate().filter(|(_, row)| holds(row));
        candidates.min_by(|(_, a), (_, b)| gap(a).total_cmp(&gap(b))).map(|(n, row)| described(n, row))
    };
    let by_hu = least(&|row| row.depth_gap_mm(depth) == 0.0, &|row| row.hu_gap(hu));
    let by_depth = least(&|row| row.hu_gap(hu) == 0.0, &|row| row.depth_gap_mm(depth));
    let mut nearest: Vec<String> = [by_hu, by_depth].into_iter().flatten().collect();
    nearest.dedup();
    let nearest = if nearest.is_empty() { "none".to_owned() } else { nearest.join(" and ") };
    let mm: [f64; 3] = mesh.frame.to_mm(mesh.positions[vertex]).into();
    format!(
        "no row holds the vertex at {mm:.1?} mm with {hu} HU{shown} ({count} vertices in all); nearest rows: \
         {nearest}; the last row can hold the rest if it has neither `hu` nor `depth_mm`"
    )
}

/// A row with its ranges, for messages.
fn described(number: usize, row: &TissueMaterialSection) -> String {
    let range = |range: Option<[f64; 2]>, unit: &str| {
        range.map_or(format!("any {unit}"), |[low, high]| format!("{low} to {high} {unit}"))
    };
    let (hu, depth) = (range(row.hu, "HU"), range(row.depth_mm, "mm"));
    format!("{MATERIALS_KEY}[{number}] (`{}`: {hu}, {depth})", row.name)
}
