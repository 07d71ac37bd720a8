//! From the cut body to a system that a solver can step: constraints, compliances, colors, handles.

use std::collections::BTreeMap;

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{
    Constraint, Distance, DistanceMaterial, MaterialError, SkinTension, SkinTensionMaterial,
    SkinTensionPaper, SkinTensionPaperMaterial, Volume, VolumeMaterial,
};
use cutis_mesh::TetMesh;
use cutis_solver::{Formulation, Handle, Settings, Stiffness, System, SystemBuilder, Values};
use cutis_volume::TableKind;
use nalgebra::{Point3, Vector3};

use crate::Error;
use crate::body::Body;
use crate::scene::{
    DistanceSection, FormulationChoice, LoadedScene, SolverSection, StcForm, StcSection,
    VolumeConstraintSection,
};

/// A system, its settings, and the number of colors of each kind in it.
pub(crate) struct Dynamics {
    pub(crate) system: System<f32>,
    pub(crate) settings: Settings,
    pub(crate) colors: BTreeMap<String, usize>,
    /// Mean over the skin of √(Σ w|∇A|²/α), 1/s: how fast a skin element alone would swing. None without XPBD skin tension.
    pub(crate) skin_rate: Option<f64>,
}

impl SolverSection {
    /// In the terms of `cutis-solver`.
    pub(crate) fn settings(&self) -> Settings {
        Settings {
            formulation: match self.formulation {
                FormulationChoice::Pbd => Formulation::Pbd,
                FormulationChoice::Xpbd => Formulation::Xpbd,
                FormulationChoice::Vbd => Formulation::Vbd,
            },
            dt_s: self.dt_s,
            substeps: self.substeps,
            iterations: self.iterations,
            gravity_m_s2: self.gravity_m_s2,
            damping_per_s: self.damping_per_s,
            relaxation: self.relaxation,
        }
    }
}

/// Builds what the scene names and nothing else.
pub(crate) fn build(loaded: &LoadedScene, body: &Body) -> Result<Dynamics, Error> {
    let scene = &loaded.scene;
    let formulation = scene.solver.formulation;
    let compliant = formulation != FormulationChoice::Pbd;
    let mesh = &body.mesh;
    let mut colors = BTreeMap::new();
    let inverse_masses = body.inverse_masses(loaded)?;
    // The frame's origin is in the middle of the CT; a part of the body that a region holds is stepped as in the whole one.
    let mut builder = SystemBuilder::<f32>::in_place(&mesh.positions, &inverse_masses)?;

    if let Some(distance) = &scene.constraints.distance {
        let groups = Groups::from_colors(&mesh.edge_colors(&mesh.edges))?;
        builder = add_distance(builder, distance, compliant, mesh, &groups)
            .map_err(loaded.blame("constraints.distance"))?;
        colors.insert(Distance::NAME.into(), groups.len());
    }
    if let Some(volume) = &scene.constraints.volume {
        let groups = Groups::from_colors(&mesh.tet_colors(&mesh.tets))?;
        builder = add_volume(builder, volume, compliant, mesh, &groups)
            .map_err(loaded.blame("constraints.volume"))?;
        colors.insert(Volume::NAME.into(), groups.len());
    }
    if let Some(stc) = &scene.constraints.stc {
        let groups = greedy(&body.skin, mesh.positions.len())?;
        builder =
            add_skin_tension(builder, loaded, stc, body, &groups).map_err(loaded.blame("constraints.stc"))?;
        colors.insert("stc".into(), groups.len());
    }
    let skin_rate = scene
        .constraints
        .stc
        .as_ref()
        .filter(|_| formulation == FormulationChoice::Xpbd && !body.skin.is_empty());
    let skin_rate = skin_rate.map(|stc| skin_rate_of(body, stc, &inverse_masses));
    if formulation == FormulationChoice::Vbd {
        builder = builder.vertex_groups(Groups::from_colors(&mesh.vertex_colors())?);
    }
    for (n, handle) in scene.handle.iter().enumerate() {
        let radius_m = handle.radius_mm / 1000.0;
        let center = mesh.frame.to_local(Point3::from(handle.at_mm)).map(f64::from);
        let vertices: Vec<u32> = (0..mesh.positions.len() as u32)
            .filter(|&v| !body.is_removed(v) && nalgebra::distance(&at(mesh, v), &center) <= radius_m)
            .collect();
        if vertices.is_empty() {
            return Err(Error::SceneKey {
                file: loaded.file.clone(),
                key: format!("handle[{n}].at_mm"),
                value: format!("{:?}", handle.at_mm),
                why: format!("there is no tissue within radius_mm = {} of it", handle.radius_mm),
            });
        }
        let move_m = (Vector3::from(handle.move_mm) / 1000.0).into();
        builder = builder
            .handle(Handle { vertices, move_m, over_s: handle.over_s })
            .map_err(loaded.blame(&format!("handle[{n}]")))?;
    }
    Ok(Dynamics { system: builder.build(), settings: scene.solver.settings(), colors, skin_rate })
}

/// Adds a spring along each edge.
fn add_distance(
    builder: SystemBuilder<f32>,
    distance: &DistanceSection,
    compliant: bool,
    mesh: &TetMesh,
    groups: &Groups,
) -> Result<SystemBuilder<f32>, Error> {
    let stiffness = if compliant {
        let volumes = mesh.edge_volumes();
        compliances(&mesh.edges, |n, [a, b]| {
            let length = nalgebra::distance(&at(mesh, a), &at(mesh, b));
            cutis_constraints::distance_compliance(length, distance.youngs_modulus_pa, f64::from(volumes[n]))
        })?
    } else {
        Stiffness::pbd(distance.stiffness as f32)
    };
    let rest = DistanceMaterial { rest_scale: 1.0 };
    Ok(builder.add_from_rest::<Distance, 2>(&mesh.edges, &rest, stiffness, groups)?)
}

/// Adds the volume of each tetrahedron.
fn add_volume(
    builder: SystemBuilder<f32>,
    volume: &VolumeConstraintSection,
    compliant: bool,
    mesh: &TetMesh,
    groups: &Groups,
) -> Result<SystemBuilder<f32>, Error> {
    let stiffness = if compliant {
        let volumes = mesh.tet_volumes();
        compliances(&mesh.tets, |n, _| {
            cutis_constraints::volume_compliance(f64::from(volumes[n]), volume.bulk_modulus_pa)
        })?
    } else {
        Stiffness::pbd(volume.stiffness as f32)
    };
    let rest = VolumeMaterial { rest_scale: 1.0 };
    Ok(builder.add_from_rest::<Volume, 4>(&mesh.tets, &rest, stiffness, groups)?)
}

/// Adds the skin: per-triangle rest areas and stiffness, by HU and by distance from the incisions.
fn add_skin_tension(
    builder: SystemBuilder<f32>,
    loaded: &LoadedScene,
    stc: &StcSection,
    body: &Body,
    groups: &Groups,
) -> Result<SystemBuilder<f32>, Error> {
    let mesh = &body.mesh;
    let key = "constraints.stc.stiffness_table";
    let table = stc.stiffness_table.table(TableKind::Stiffness, &loaded.file, key)?;
    let (mut rest_scale, mut factor) = (Vec::new(), Vec::new());
    for triangle in &body.skin {
        let mean_hu = triangle.iter().map(|&v| mesh.hu[v as usize]).sum::<f32>() / 3.0;
        let near = body.nearness(stc, triangle);
        rest_scale.push(stc.rest_area_scale * near.rest_area_factor);
        factor.push(f64::from(table.at(mean_hu)) * near.stiffness_factor);
    }
    let corners = |n: usize| body.skin[n].map(|v| mesh.positions[v as usize]);
    if let Some(n) = factor.iter().position(|f| !(f.is_finite() && *f > 0.0)) {
        return Err(Error::SceneKey {
            file: loaded.file.clone(),
            key: key.into(),
            value: String::new(),
            why: format!(
                "gives {} for a skin triangle; it must be above 0 at every HU of the skin",
                factor[n]
            ),
        });
    }
    let share = |n: usize| (stc.stiffness * factor[n]).min(1.0) as f32;
    let shares = || Stiffness::Pbd(Values::Each((0..factor.len()).map(share).collect()));
    match stc.form {
        StcForm::Energy => {
            let params: Vec<_> = (0..body.skin.len())
                .map(|n| {
                    let rest = SkinTensionMaterial {
                        rest_area_scale: rest_scale[n],
                        amplification: stc.amplification,
                    };
                    SkinTension::from_rest(&corners(n), &rest)
                })
                .collect();
            let stiffness = match loaded.scene.solver.formulation {
                FormulationChoice::Pbd => shares(),
                FormulationChoice::Xpbd | FormulationChoice::Vbd => compliances(&body.skin, |n, _| {
                    cutis_constraints::skin_compliance(
                        f64::from(params[n][0]),
                        stc.area_modulus_n_per_m * factor[n],
                    )
                })?,
            };
            Ok(builder.add::<SkinTension, 3>(&body.skin, &params, stiffness, groups)?)
        }
        StcForm::Paper => {
            let params: Result<Vec<_>, Error> = (0..body.skin.len())
                .map(|n| {
                    let share = f64::from(share(n));
                    let rest =
                        SkinTensionPaperMaterial::for_stiffness(share, rest_scale[n], stc.amplification)?;
                    Ok(SkinTensionPaper::from_rest(&corners(n), &rest))
                })
                .collect();
            let params = params?;
            Ok(builder.add::<SkinTensionPaper, 3>(&body.skin, &params, shares(), groups)?)
        }
    }
}

/// Mean over the triangles of √(Σ w|∇A|²/α) with the scene's general modulus, 1/s.
fn skin_rate_of(body: &Body, stc: &StcSection, inverse_masses: &[f32]) -> f64 {
    let material = SkinTensionMaterial { rest_area_scale: stc.rest_area_scale, amplification: 0.0 };
    let rate = |triangle: &[u32; 3]| {
        let x = triangle.map(|v| at(&body.mesh, v));
        let params = SkinTension::from_rest(&x, &material);
        let gradients = SkinTension::eval(&x, &params).grad;
        let weighted = |(v, gradient): (&u32, &Vector3<f64>)| {
            f64::from(inverse_masses[*v as usize]) * gradient.norm_squared()
        };
        let sum: f64 = triangle.iter().zip(&gradients).map(weighted).sum();
        (sum * stc.area_modulus_n_per_m / params[0]).sqrt()
    };
    body.skin.iter().map(rate).sum::<f64>() / body.skin.len() as f64
}

/// One compliance per element.
fn compliances<const N: usize>(
    elements: &[[u32; N]],
    compliance: impl Fn(usize, [u32; N]) -> Result<f64, MaterialError>,
) -> Result<Stiffness<f32>, MaterialError> {
    let each: Result<Vec<f32>, _> =
        elements.iter().enumerate().map(|(n, &element)| Ok(compliance(n, element)? as f32)).collect();
    Ok(Stiffness::Compliance(Values::Each(each?)))
}

fn at(mesh: &TetMesh, vertex: u32) -> Point3<f64> {
    mesh.positions[vertex as usize].map(f64::from)
}
