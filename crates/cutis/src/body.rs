//! From the CT to a body that is ready to be simulated: lattice, tissue, skin, incisions, what is fixed.

use cutis_mesh::{
    Cut, HalfSpace, Incision, Lattice, SkinMode, SkinOptions, SkinReport, TetMesh, Tissue, skin,
};
use cutis_volume::{TableKind, Volume, sample};

use crate::Error;
use crate::scene::{Keep, LoadedScene, PlaneSection, SkinChoice, StcSection};

/// The cut body. Vertices keep their numbers through the cut; `mesh` and `skin` hold what the incisions left.
pub(crate) struct Body {
    pub(crate) mesh: TetMesh,
    /// Skin triangles in mesh vertices, outward oriented; empty if nothing asks for the skin.
    pub(crate) skin: Vec<[u32; 3]>,
    pub(crate) skin_report: Option<SkinReport>,
    pub(crate) cut: Cut,
    /// Tetrahedra that the incisions took.
    pub(crate) taken: Vec<[u32; 4]>,
    /// Lumped masses before the cut, kg.
    masses: Vec<f32>,
    /// Per lattice point: no tissue.
    pub(crate) air: Vec<bool>,
    pub(crate) warnings: Vec<String>,
}

/// Skin parameters at one triangle, relative to the general ones.
pub(crate) struct Nearness {
    pub(crate) rest_area_factor: f64,
    pub(crate) stiffness_factor: f64,
}

impl Body {
    /// Builds the body of a scene from its CT.
    pub(crate) fn build(loaded: &LoadedScene, volume: &Volume) -> Result<Self, Error> {
        let scene = &loaded.scene;
        let grid =
            sample::lattice_grid(volume.grid(), scene.lattice.size()).map_err(loaded.blame("lattice"))?;
        let lattice = Lattice::new(grid, scene.lattice.split.into()).map_err(loaded.blame("lattice"))?;
        let hu = sample::to_grid(volume, &grid);
        let air: Vec<bool> = hu.iter().map(|&hu| hu < scene.tissue.air_below_hu).collect();
        let cut_away: Vec<HalfSpace> = scene.tissue.cut_planes.iter().map(HalfSpace::from).collect();
        let largest_component = scene.tissue.keep == Keep::Largest;
        let tissue = Tissue { air: &air, cut_away: &cut_away, largest_component };
        let mut mesh = TetMesh::build(&lattice, &hu, &tissue).map_err(loaded.blame("tissue"))?;
        drop(hu);
        let mut warnings = Vec::new();
        if mesh.dropped_tets > 0 {
            warnings.push(format!(
                "{} of {} tissue tetrahedra lie apart from the largest part and were left out (tissue.keep = \"largest\")",
                mesh.dropped_tets,
                mesh.dropped_tets + mesh.tets.len()
            ));
        }
        let density = scene.tissue.density.table(TableKind::Density, &loaded.file, "tissue.density")?;
        let masses = mesh.masses(&|hu| density.at(hu));
        let (mut triangles, mut report) = (Vec::new(), None);
        if needs_skin(loaded) {
            let options = SkinOptions { cut_away, ..SkinOptions::default() };
            let found = skin::detect(&lattice, &air, scene.skin.mode.into(), &options)
                .map_err(loaded.blame("skin"))?;
            let (on_mesh, dropped) = found.on_mesh(&mesh);
            if dropped > 0 {
                warnings.push(format!(
                    "{dropped} skin triangles have no tissue tetrahedron behind them and were left out"
                ));
            }
            triangles = on_mesh;
            report = Some(found.report);
        }
        let incisions: Vec<Incision> = scene
            .incision
            .iter()
            .map(|i| Incision {
                from_mm: i.from_mm,
                to_mm: i.to_mm,
                depth_mm: i.depth_mm,
                width_mm: i.width_mm,
            })
            .collect();
        let cut = Cut::plan(&mesh, &triangles, &incisions).map_err(loaded.blame("incision"))?;
        let taken = cut.apply(&mut mesh, &mut triangles).tets;
        Ok(Self { mesh, skin: triangles, skin_report: report, cut, taken, masses, air, warnings })
    }

    /// True if an incision took the vertex out of all constraints.
    pub(crate) fn removed(&self, vertex: u32) -> bool {
        self.cut.removed[vertex as usize]
    }

    /// Inverse masses, 1/kg; 0 for what is fixed or removed.
    pub(crate) fn inverse_masses(&self, loaded: &LoadedScene) -> Result<Vec<f32>, Error> {
        let fixed = self.fixed(loaded)?;
        if let Some(vertex) = self.masses.iter().position(|m| !(m.is_finite() && *m > 0.0)) {
            return Err(Error::SceneKey {
                file: loaded.file.clone(),
                key: "tissue.density".into(),
                value: String::new(),
                why: format!(
                    "gives a vertex of {} HU a mass of {} kg; densities must be above 0 wherever there is tissue",
                    self.mesh.hu[vertex], self.masses[vertex]
                ),
            });
        }
        let still = |v: usize| fixed[v] || self.cut.removed[v];
        Ok((0..self.masses.len()).map(|v| if still(v) { 0.0 } else { 1.0 / self.masses[v] }).collect())
    }

    /// Which vertices the scene fixes.
    pub(crate) fn fixed(&self, loaded: &LoadedScene) -> Result<Vec<bool>, Error> {
        let (mesh, section) = (&self.mesh, &loaded.scene.fixed);
        let mut fixed = vec![false; mesh.positions.len()];
        let mut add =
            |which: Vec<bool>| fixed.iter_mut().zip(which).for_each(|(fixed, other)| *fixed |= other);
        if let Some(hu) = section.bone_above_hu {
            add(mesh.hu.iter().map(|&value| value > hu).collect());
        }
        for b in &section.boxes {
            add(mesh.vertices_in_box_mm(b.min_mm, b.max_mm));
        }
        for plane in &section.planes {
            add(mesh.vertices_beyond(&plane.into()).map_err(loaded.blame("fixed.planes"))?);
        }
        for axis in section.end_layers.iter().map(|axis| axis.index()) {
            let last = mesh.lattice.grid().shape[axis] - 1;
            let at_end = |v| [0, last].contains(&mesh.point(v)[axis]);
            add((0..mesh.positions.len() as u32).map(at_end).collect());
        }
        Ok(fixed)
    }

    /// Skin parameters of a triangle by its distance from the nearest incision.
    pub(crate) fn nearness(&self, stc: &StcSection, triangle: &[u32; 3]) -> Nearness {
        let Some(near) = &stc.near_incision else {
            return Nearness { rest_area_factor: 1.0, stiffness_factor: 1.0 };
        };
        let center =
            triangle.iter().map(|&v| self.mesh.positions[v as usize].coords).sum::<nalgebra::Vector3<f32>>()
                / 3.0;
        let weight = (1.0 - self.cut.distance_mm(center.into()) / near.radius_mm).max(0.0);
        let blend = |factor: f64| 1.0 + weight * (factor - 1.0);
        Nearness {
            rest_area_factor: blend(near.rest_area_factor),
            stiffness_factor: blend(near.stiffness_factor),
        }
    }
}

/// The skin is detected only if something of the scene refers to it.
pub(crate) fn needs_skin(loaded: &LoadedScene) -> bool {
    let scene = &loaded.scene;
    scene.constraints.stc.is_some()
        || !scene.incision.is_empty()
        || scene.output.surface
        || scene.output.pictures
}

impl From<&PlaneSection> for HalfSpace {
    fn from(plane: &PlaneSection) -> Self {
        Self { point_mm: plane.point_mm, normal: plane.normal }
    }
}

impl From<SkinChoice> for SkinMode {
    fn from(choice: SkinChoice) -> Self {
        match choice {
            SkinChoice::Paper => Self::Paper,
            SkinChoice::Boundary => Self::Boundary,
            SkinChoice::Exterior => Self::Exterior,
        }
    }
}
