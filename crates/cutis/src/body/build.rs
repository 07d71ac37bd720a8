//! Builds a body from its CT.

use cutis_mesh::sever::Severed;
use cutis_mesh::{
    Cut, Excision, Incision, Lattice, MeshError, Piece, Pocket, Skin, Slit, TetMesh, Tissue, TissueMask,
};
use cutis_skin::{BodySkin, SkinMoves};
use cutis_volume::{Grid, TableKind, Volume};
use nalgebra::Point3;

use super::cut_error::cut_error;
use super::lattice::lattice;
use super::{
    AIR_BELOW_HU, Body, BodyMaterials, BodySections, GrowingCuts, Membrane, air, estimate, handles, memory,
    no_skin, region, sutures, thin,
};
use crate::Error;
use crate::scene::{Keep, TissueMaterials};

impl Body {
    /// Builds the body of a scene from its CT.
    ///
    /// # Errors
    /// [`Error`] for a section that does not work with this CT.
    pub(crate) fn build(sections: &BodySections<'_>, volume: &Volume) -> Result<Self, Error> {
        let BodySections { file, tissue, incisions, ref underminings, excisions, .. } = *sections;
        let no_skin = |why| file.blame("volume")(Error::NoSkin { ct: sections.ct.into(), why });
        if sections.skin.is_some() {
            no_skin::refuse_offset(volume, tissue.air_below_hu, "volume.offset_hu").map_err(no_skin)?;
        }
        let lattice = lattice(sections, volume)?;
        memory::check_points(sections, lattice.grid().len())?;
        memory::check_estimate(sections, estimate::tets(sections, volume, &lattice))?;
        refuse_deep_cuts(sections, volume.grid())?;
        let hu = lattice.sample(volume)?;
        let air = air(&hu, tissue.air_below_hu);
        memory::check_tissue(sections, air.iter().filter(|air| !**air).count())?;
        let largest_component = tissue.keep == Keep::Largest;
        let found = Tissue { air: &air, cut_away: &tissue.cut_planes, largest_component };
        let mut warnings = Vec::new();
        let tissue_error = |error| no_tissue(sections, volume, error);
        let (whole, skin) = find_tissue(sections, &lattice, &found, &mut warnings).map_err(tissue_error)?;
        if let Some(Skin { report, .. }) = skin.as_ref().filter(|skin| skin.triangles.is_empty()) {
            let why = no_skin::reason(volume, tissue.air_below_hu, report);
            match sections.cuts() || sections.smooth_skin {
                true => return Err(no_skin(why)),
                false => warnings.push(format!("there is no skin: {why}")),
            }
        }
        let (skin, skin_report) = skin.map(|skin| (skin.triangles, skin.report)).unzip();
        let skin: Vec<[u32; 3]> = skin.unwrap_or_default();
        let whole = if sections.smooth_skin { smooth(sections, whole, &hu, &skin)? } else { whole };
        let lattice = whole.lattice();
        let incisions: Vec<Incision> = incisions.iter().map(Incision::from).collect();
        let slits = Slit::on_lattice(lattice, &skin, &incisions).map_err(cut_error(file))?;
        warnings.extend(off_skin(&slits));
        let excisions: Vec<Excision> = excisions.iter().map(Excision::from).collect();
        let pieces = Piece::on_lattice(lattice, &skin, &excisions).map_err(cut_error(file))?;
        let pockets = Pocket::on_lattice(lattice, &skin, &slits, &pieces, underminings);
        let pockets = pockets.map_err(cut_error(file))?;
        let from_cuts_mm = |p: Point3<f32>| {
            let slits = slits.iter().map(|slit| slit.distance(p));
            let pockets = pockets.iter().map(|pocket| pocket.distance(p));
            let pieces = pieces.iter().map(|piece| piece.distance(p));
            slits.chain(pockets).chain(pieces).fold(f64::INFINITY, f64::min) * 1000.0
        };
        let membrane =
            sections.membrane.map(|section| Membrane::find(file, section, &whole, &hu, &skin)).transpose()?;
        warnings.extend(membrane.iter().flat_map(|membrane| membrane.warnings.iter().cloned()));
        let mut mesh = region::mesh(sections, &whole, &hu, &from_cuts_mm)?;
        warnings.extend(sections.has_tension.then(|| thin::warning(&whole, &mesh, &skin)).flatten());
        let mut materials = BodyMaterials::assign(sections, &whole, &hu, &mesh, &skin)?;
        // The skin of a preset is thinner than most lattices, and its membrane bears the tension.
        if !matches!(sections.materials, Some(TissueMaterials::Preset(_))) {
            warnings.extend(materials.iter().flat_map(|materials| materials.warnings(&mesh)));
        }
        let (mut skin, mut inactive_skin) = mesh.divide_skin(&skin);
        let inactive_hu = inactive_skin.lattice_index.iter().map(|&point| hu[point as usize]).collect();
        drop(hu);
        warnings.extend(dropped_tets(&mesh));
        let density = tissue.density.table(TableKind::Density, file, "tissue.density")?;
        let density = |hu: f32| density.at(hu);
        let mut masses = mesh.masses(&density);
        region::check_handles(sections, &mesh)?;
        let mut cut = Cut::of_slits(&mesh, &skin, slits).map_err(|e| region::incision_error(sections, e))?;
        cut = cut.with(&mesh, pockets, pieces).map_err(cut_error(file))?;
        let removed = cut.apply(&mut mesh, &mut skin);
        let skin_before_pieces = if cut.pieces.is_empty() { Vec::new() } else { skin.clone() };
        let (severed, growth) = match sections.cuts_grow {
            false => (cut.sever(&mut mesh, &mut skin).map_err(cut_error(file))?, None),
            true => cut.sever_growing(&mut mesh, &mut skin).map_err(cut_error(file))?.unzip(),
        };
        let growing = growth.map(|growth| GrowingCuts::new(growth, sections.times.clone(), &mesh, &density));
        if let Some(severed) = &severed {
            divide_masses(&mut masses, severed, &mesh, &density);
            materials.iter_mut().for_each(|materials| materials.add_nodes(&severed.virtual_nodes));
            inactive_skin.shift(mesh.real_vertices(), severed.virtual_nodes.len());
        }
        let free_pieces_ml = free_pieces_ml(severed.as_ref(), &mesh);
        warnings.extend(free_pieces(&free_pieces_ml));
        let grabbed = handles::grabbed(sections, &mesh, &cut)?;
        let copies = severed.as_ref().map_or(0, |severed| severed.copies.len());
        let stitches = sutures::stitches(sections, &mesh, &cut, &skin[..skin.len() - copies])?;
        warnings.extend(region::warning(sections.lattice, &mesh));
        Ok(Self {
            mesh,
            skin,
            skin_before_pieces,
            inactive_skin,
            inactive_hu,
            skin_report,
            cut,
            removed,
            severed,
            picked_region: region::picked(sections.lattice),
            adhering_blades: sections.adhering_blades.clone(),
            growing,
            stitches,
            free_pieces_ml,
            membrane,
            grabbed,
            materials,
            masses,
            air,
            warnings,
        })
    }
}

/// Refuses cuts that are deeper than the scan is large.
fn refuse_deep_cuts(sections: &BodySections<'_>, scan: &Grid) -> Result<(), Error> {
    let last = scan.shape.map(|count| count - 1);
    let most_mm = (scan.mm(last) - scan.mm([0; 3])).norm();
    let incisions = sections.incisions.iter().map(|cut| cut.depth_mm).enumerate();
    let excisions = sections.excisions.iter().map(|cut| cut.depth_mm).enumerate();
    let cuts = incisions.map(|cut| ("incision", cut)).chain(excisions.map(|cut| ("excision", cut)));
    for (list, (n, depth_mm)) in cuts {
        if depth_mm > most_mm {
            let why = format!("must be at most {most_mm:.0}, the diagonal of the scan in mm");
            return Err(sections.file.bad_key(&format!("{list}[{n}].depth_mm"), &depth_mm.to_string(), &why));
        }
    }
    Ok(())
}

/// The tissue of the body and, if the scene needs it, the skin of the body.
fn find_tissue(
    sections: &BodySections<'_>,
    lattice: &Lattice,
    tissue: &Tissue<'_>,
    warnings: &mut Vec<String>,
) -> Result<(TissueMask, Option<Skin>), MeshError> {
    let Some(mode) = sections.skin else { return Ok((TissueMask::find(lattice, tissue)?, None)) };
    let (whole, mut skin) = TissueMask::find_with_skin(lattice, tissue, mode, None)?;
    let (on_body, dropped) = whole.skin(&skin);
    if dropped > 0 {
        warnings.push(format!(
            "{dropped} skin triangles have no tissue tetrahedron behind them and were left out"
        ));
    }
    skin.triangles = on_body;
    Ok((whole, Some(skin)))
}

/// The error of a threshold of air that lies above all values of the CT names the key. Others name
/// the section.
fn no_tissue(sections: &BodySections<'_>, volume: &Volume, error: MeshError) -> Error {
    let key = "tissue.air_below_hu";
    let threshold = sections.tissue.air_below_hu;
    let most = volume.voxels().iter().map(|&stored| volume.hu(stored)).fold(f32::NEG_INFINITY, f32::max);
    match error {
        MeshError::NoTissue { .. } if most < threshold && threshold > AIR_BELOW_HU => {
            let why = format!(
                "makes all of the CT air: its values go up to {most} HU; the usual value is {AIR_BELOW_HU}"
            );
            sections.file.bad_key(key, &threshold.to_string(), &why)
        }
        other => sections.file.blame("tissue")(other),
    }
}

/// The body with the vertices of its skin on a smooth surface. `hu` has one value per lattice
/// point.
fn smooth(
    sections: &BodySections<'_>,
    whole: TissueMask,
    hu: &[f32],
    skin: &[[u32; 3]],
) -> Result<TissueMask, Error> {
    let on_planes = BodySkin::new(whole.lattice(), hu, whole.vertices(), skin);
    let SkinMoves { points, mm, .. } = SkinMoves::of(&on_planes.map_err(sections.file.blame("tissue"))?);
    whole.with_moves(points, mm).map_err(sections.file.blame("skin.smooth"))
}

/// Divides the masses of vertices along cuts of no width among the nodes of the copies. A node
/// without tissue, as in a piece that is taken out later, keeps the mass of its vertex.
fn divide_masses(masses: &mut Vec<f32>, severed: &Severed, mesh: &TetMesh, density: &dyn Fn(f32) -> f32) {
    let copies = &mesh.tets[mesh.whole_tets()..];
    let mut points: Vec<u32> = copies.iter().flatten().map(|&v| mesh.lattice_index[v as usize]).collect();
    points.sort_unstable();
    points.dedup();
    let divided = mesh.masses(density);
    let of_virtual: Vec<f32> = severed.virtual_nodes.iter().map(|&v| masses[v as usize]).collect();
    masses.extend(of_virtual);
    for (v, mass) in masses.iter_mut().enumerate() {
        if divided[v] > 0.0 && points.binary_search(&mesh.lattice_index[v]).is_ok() {
            *mass = divided[v];
        }
    }
}

/// Share of a path without skin above which it is reported.
const OFF_SKIN: f64 = 0.1;

/// Warnings about incisions that lie in part where there is no skin.
fn off_skin(slits: &[Slit]) -> Vec<String> {
    let sum = |slits: &[Slit], length: fn(&Slit) -> f64| slits.iter().map(length).sum::<f64>() * 1e3;
    let incisions = slits.chunk_by(|a, b| a.incision() == b.incision());
    let warning = |slits: &[Slit]| {
        let (length, on_skin) = (sum(slits, Slit::length), sum(slits, Slit::length_on_skin));
        (length - on_skin > OFF_SKIN * length).then(|| {
            format!(
                "incision[{}] has no skin along {:.0} of its {length:.0} mm: it leaves the scan, or passes over \
                 a gap in the skin, and cuts nothing there",
                slits[0].incision(),
                length - on_skin
            )
        })
    };
    incisions.filter_map(warning).collect()
}

/// Volumes in ml of the parts of the body that its cuts separate from the largest one.
fn free_pieces_ml(severed: Option<&Severed>, mesh: &TetMesh) -> Vec<f64> {
    let parts = severed.map(|_| mesh.part_volumes()).unwrap_or_default();
    parts.iter().skip(1).map(|volume| volume * 1e6).collect()
}

/// Warning about parts of the body that its cuts set free.
fn free_pieces(pieces_ml: &[f64]) -> Option<String> {
    let all: Vec<String> = pieces_ml.iter().map(|ml| format!("{ml:.2}")).collect();
    (!all.is_empty()).then(|| {
        format!(
            "the cuts separate {} pieces from the body, of {} ml: no tissue holds them in their place",
            all.len(),
            all.join(", ")
        )
    })
}

/// Share of the tetrahedra that lie apart above which they are reported. Fewer are noise of the CT.
const DROPPED: f64 = 1e-2;

/// Warning about tissue that is not connected with the largest part.
fn dropped_tets(mesh: &TetMesh) -> Option<String> {
    let inactive = mesh.inactive.as_ref().map_or(0, |inactive| inactive.tets);
    let all = mesh.dropped_tets + mesh.tets.len() + inactive;
    (mesh.dropped_tets as f64 > DROPPED * all as f64).then(|| {
        format!(
            "{} of {all} tissue tetrahedra lie apart from the largest part and were left out. If they belong to \
             the body, set tissue.keep = \"all\"",
            mesh.dropped_tets,
        )
    })
}
