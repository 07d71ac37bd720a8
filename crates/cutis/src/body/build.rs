//! Builds a body from its CT.

use cutis_mesh::{
    Cut, HalfSpace, Incision, SkinOptions, SkinReport, Slit, TetMesh, Tissue, TissueMask, skin,
};
use cutis_volume::{TableKind, Volume};

use super::lattice::lattice;
use super::{Body, BodySections, air, handles, region};
use crate::Error;
use crate::scene::Keep;

impl Body {
    /// Builds the body of a scene from its CT.
    ///
    /// # Errors
    /// [`Error`] for a section that does not work with this CT.
    pub(crate) fn build(sections: &BodySections<'_>, volume: &Volume) -> Result<Self, Error> {
        let BodySections { file, tissue, incisions, .. } = *sections;
        let lattice = lattice(sections, volume)?;
        let hu = lattice.sample(volume)?;
        let air = air(&hu, tissue.air_below_hu);
        let cut_away: Vec<HalfSpace> = tissue.cut_planes.iter().map(HalfSpace::from).collect();
        let largest_component = tissue.keep == Keep::Largest;
        let found = Tissue { air: &air, cut_away: &cut_away, largest_component };
        let whole = TissueMask::find(&lattice, &found).map_err(file.blame("tissue"))?;
        let mut warnings = Vec::new();
        let (skin, skin_report) = find_skin(sections, &whole, &air, &cut_away, &mut warnings)?;
        let incisions: Vec<Incision> = incisions.iter().map(Incision::from).collect();
        let slits = Slit::on_lattice(&lattice, &skin, &incisions).map_err(file.blame("incision"))?;
        let mut mesh = region::mesh(sections, &whole, &hu, &slits)?;
        let (mut skin, inactive_skin) = mesh.divide_skin(&skin);
        let inactive_hu = inactive_skin.lattice_index.iter().map(|&point| hu[point as usize]).collect();
        drop(hu);
        warnings.extend(dropped_tets(&mesh));
        let density = tissue.density.table(TableKind::Density, file, "tissue.density")?;
        let masses = mesh.masses(&|hu| density.at(hu));
        region::check_handles(sections, &mesh)?;
        let cut = Cut::of_slits(&mesh, &skin, slits).map_err(|e| region::incision_error(sections, e))?;
        let removed = cut.apply(&mut mesh, &mut skin);
        let grabbed = handles::grabbed(sections, &mesh, &cut)?;
        warnings.extend(region::warning(&mesh));
        Ok(Self {
            mesh,
            skin,
            inactive_skin,
            inactive_hu,
            skin_report,
            cut,
            removed,
            grabbed,
            masses,
            air,
            warnings,
        })
    }
}

/// Skin triangles of the body in lattice points, and their report; empty if the scene does not need
/// the skin.
fn find_skin(
    sections: &BodySections<'_>,
    whole: &TissueMask,
    air: &[bool],
    cut_away: &[HalfSpace],
    warnings: &mut Vec<String>,
) -> Result<(Vec<[u32; 3]>, Option<SkinReport>), Error> {
    let Some(mode) = sections.skin else { return Ok((Vec::new(), None)) };
    let options = SkinOptions { cut_away: cut_away.to_vec(), ..SkinOptions::default() };
    let found =
        skin::detect(whole.lattice(), air, mode.into(), &options).map_err(sections.file.blame("skin"))?;
    let (on_body, dropped) = whole.skin(&found);
    if dropped > 0 {
        warnings.push(format!(
            "{dropped} skin triangles have no tissue tetrahedron behind them and were left out"
        ));
    }
    Ok((on_body, Some(found.report)))
}

/// Warning about tissue that is not connected with the largest part.
fn dropped_tets(mesh: &TetMesh) -> Option<String> {
    let inactive = mesh.inactive.as_ref().map_or(0, |inactive| inactive.tets);
    (mesh.dropped_tets > 0).then(|| {
        format!(
            "{} of {} tissue tetrahedra lie apart from the largest part and were left out \
             (tissue.keep = \"largest\")",
            mesh.dropped_tets,
            mesh.dropped_tets + mesh.tets.len() + inactive
        )
    })
}
