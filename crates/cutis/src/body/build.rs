//! From the CT to a body that is ready to be simulated: lattice, tissue, skin, incisions, what is fixed.

use cutis_mesh::{
    Cut, HalfSpace, InactiveSkin, Incision, Removed, SkinMode, SkinOptions, SkinReport, Slit, TetMesh,
    Tissue, TissueMask, skin,
};
use cutis_volume::{TableKind, Volume};

use crate::Error;
use crate::body::region;
use crate::scene::{IncisionSection, Keep, LoadedScene, PlaneSection, SkinChoice, StcSection};

/// The cut body. Vertices keep their numbers through the cut; `mesh` and `skin` hold what the incisions left.
pub(crate) struct Body {
    pub(crate) mesh: TetMesh,
    /// Skin triangles in mesh vertices, outward oriented; empty if nothing asks for the skin.
    pub(crate) skin: Vec<[u32; 3]>,
    /// The skin that a region left out.
    pub(crate) inactive_skin: InactiveSkin,
    /// HU at its positions.
    pub(crate) inactive_hu: Vec<f32>,
    pub(crate) skin_report: Option<SkinReport>,
    pub(crate) cut: Cut,
    /// What the incisions took.
    pub(crate) removed: Removed,
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
        let lattice = region::lattice(loaded, volume)?;
        let hu = lattice.sample(volume)?;
        let air: Vec<bool> = hu.iter().map(|&hu| hu < scene.tissue.air_below_hu).collect();
        let cut_away: Vec<HalfSpace> = scene.tissue.cut_planes.iter().map(HalfSpace::from).collect();
        let largest_component = scene.tissue.keep == Keep::Largest;
        let tissue = Tissue { air: &air, cut_away: &cut_away, largest_component };
        let whole = TissueMask::find(&lattice, &tissue).map_err(loaded.blame("tissue"))?;
        let mut warnings = Vec::new();
        let (mut skin, mut report) = (Vec::new(), None);
        if needs_skin(loaded) {
            let options = SkinOptions { cut_away, ..SkinOptions::default() };
            let found = skin::detect(&lattice, &air, scene.skin.mode.into(), &options)
                .map_err(loaded.blame("skin"))?;
            let (on_body, dropped) = whole.skin(&found);
            if dropped > 0 {
                warnings.push(format!(
                    "{dropped} skin triangles have no tissue tetrahedron behind them and were left out"
                ));
            }
            skin = on_body;
            report = Some(found.report);
        }
        let incisions: Vec<Incision> = scene.incision.iter().map(Incision::from).collect();
        let slits = Slit::on_lattice(&lattice, &skin, &incisions).map_err(loaded.blame("incision"))?;
        let mut mesh = region::mesh(loaded, &whole, &hu, &slits)?;
        let (mut triangles, inactive_skin) = mesh.divide_skin(&skin);
        let inactive_hu = inactive_skin.lattice_index.iter().map(|&point| hu[point as usize]).collect();
        drop(hu);
        if mesh.dropped_tets > 0 {
            let frozen = mesh.inactive.as_ref().map_or(0, |frozen| frozen.tets);
            warnings.push(format!(
                "{} of {} tissue tetrahedra lie apart from the largest part and were left out (tissue.keep = \"largest\")",
                mesh.dropped_tets,
                mesh.dropped_tets + mesh.tets.len() + frozen
            ));
        }
        let density = scene.tissue.density.table(TableKind::Density, &loaded.file, "tissue.density")?;
        let masses = mesh.masses(&|hu| density.at(hu));
        region::check_handles(loaded, &mesh)?;
        let cut = Cut::of_slits(&mesh, &triangles, slits).map_err(|e| region::name(loaded, e))?;
        let removed = cut.apply(&mut mesh, &mut triangles);
        Ok(Self {
            mesh,
            skin: triangles,
            inactive_skin,
            inactive_hu,
            skin_report: report,
            cut,
            removed,
            masses,
            air,
            warnings,
        })
    }

    /// True if an incision took the vertex out of all constraints.
    pub(crate) fn is_removed(&self, vertex: u32) -> bool {
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

    /// Which vertices the scene fixes, those on the border of its region included.
    pub(crate) fn fixed(&self, loaded: &LoadedScene) -> Result<Vec<bool>, Error> {
        let (mesh, section) = (&self.mesh, &loaded.scene.fixed);
        let beyond = mesh.inactive.as_ref().map(|frozen| frozen.border.clone());
        let mut fixed = beyond.unwrap_or_else(|| vec![false; mesh.positions.len()]);
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

impl From<&IncisionSection> for Incision {
    fn from(section: &IncisionSection) -> Self {
        let IncisionSection { from_mm, to_mm, depth_mm, width_mm, at_s: _ } = *section;
        Self { from_mm, to_mm, depth_mm, width_mm }
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
