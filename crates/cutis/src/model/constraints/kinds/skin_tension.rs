//! `constraints.stc`: skin tension over each skin triangle, by HU and by distance from the
//! incisions.

use cutis_coloring::Groups;
use cutis_constraints::{
    Constraint, SkinTension, SkinTensionMaterial, SkinTensionPaper, SkinTensionPaperMaterial,
};
use cutis_solver::{Formulation, Stiffness, SystemBuilder, Values};
use cutis_volume::TableKind;
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::freed::Strength;
use super::rounding::lost_in_rounding;
use super::too_stiff::too_stiff;
use super::{BodyParts, Coloring, ConstraintKind, KindFacts, ScanTension, coloring, compliances, one};
use crate::Error;
use crate::scene::validate::Check;
use crate::scene::{Scene, TableChoice};

/// Key of the table that scales the modulus.
const TABLE_KEY: &str = "constraints.stc.stiffness_table";

/// Skin tension over the skin triangles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StcSection {
    /// Area modulus of the skin, N/m (`xpbd`).
    pub area_modulus_n_per_m: f64,
    /// Share of the error that a projection removes, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
    /// Tensile amplification β of the restoring force, 0 or more.
    #[serde(default = "default_amplification")]
    pub amplification: f64,
    /// Rest area over area in the scan; below 1 the skin is under tension.
    #[serde(default = "default_rest_area_scale")]
    pub rest_area_scale: f64,
    /// Formula: `"energy"` is stable for any amplification; `"paper"` is the paper's clamped
    /// update, for `pbd` only.
    #[serde(default)]
    pub form: StcForm,
    /// HU → factor on the modulus (on the stiffness in `pbd`), at the mean HU of a triangle's
    /// vertices: preset `uniform` or `paper`, or points.
    #[serde(default = "uniform")]
    pub stiffness_table: TableChoice,
    /// Other values near the incisions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near_incision: Option<NearIncisionSection>,
}

/// Formula of the skin tension constraint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StcForm {
    /// Derived from an energy; stable for any amplification.
    #[default]
    Energy,
    /// The paper's update with the right gradient, clamped; `pbd` only.
    Paper,
}

/// Skin parameters near an incision, blended linearly to the general ones at `radius_mm`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearIncisionSection {
    /// Distance from the incision at which the general values hold, mm.
    pub radius_mm: f64,
    /// Factor on the rest area at the incision.
    #[serde(default = "one")]
    pub rest_area_factor: f64,
    /// Factor on the modulus (stiffness) at the incision.
    #[serde(default = "one")]
    pub stiffness_factor: f64,
}

fn default_amplification() -> f64 {
    2.0
}

fn default_rest_area_scale() -> f64 {
    0.9
}

fn uniform() -> TableChoice {
    TableChoice::Preset("uniform".into())
}

/// Skin parameters of one triangle.
struct TriangleMaterial {
    rest_area_scale: f64,
    /// Factor on the modulus, or on the stiffness in `pbd`.
    factor: f64,
}

impl StcSection {
    pub(super) const FACTS: KindFacts = KindFacts {
        solver_names: &[SkinTension::NAME, SkinTensionPaper::NAME],
        element: "skin triangle",
        needs_skin: true,
        counts: |body| [body.skin.len(), body.inactive_skin.triangles.len()],
    };

    /// Material of each of some skin triangles, with the tension of the scene.
    fn materials(&self, parts: &BodyParts<'_>, skin: &[[u32; 3]]) -> Result<Vec<TriangleMaterial>, Error> {
        let mesh = &parts.body.mesh;
        let table = self.stiffness_table.table(TableKind::Stiffness, parts.file, TABLE_KEY)?;
        let materials = skin.iter().map(|triangle| {
            let mean_hu = triangle.iter().map(|&v| mesh.hu[v as usize]).sum::<f32>() / 3.0;
            let [rest_area_factor, stiffness_factor] = self.near_incision_factors(parts, triangle);
            TriangleMaterial {
                rest_area_scale: self.rest_area_scale * rest_area_factor,
                factor: f64::from(table.at(mean_hu)) * stiffness_factor,
            }
        });
        let materials: Vec<_> = materials.collect();
        if let Some(bad) = materials.iter().find(|m| !(m.factor.is_finite() && m.factor > 0.0)) {
            let why = format!(
                "gives {} for a skin triangle; it must be above 0 at every HU of the skin",
                bad.factor
            );
            return Err(parts.file.bad_key(TABLE_KEY, "", &why));
        }
        Ok(materials)
    }

    /// Material of each triangle of the cut skin. In a scan at rest these triangles have the area
    /// of the scan as their rest area: their tension is balanced, and what a cut sets free is a
    /// load.
    fn kept_materials(&self, parts: &BodyParts<'_>) -> Result<Vec<TriangleMaterial>, Error> {
        let mut materials = self.materials(parts, parts.elements.skin())?;
        if parts.at_rest {
            materials.iter_mut().for_each(|material| material.rest_area_scale = 1.0);
        }
        Ok(materials)
    }

    /// Factors on rest area and stiffness of a triangle, by its distance from the nearest incision.
    fn near_incision_factors(&self, parts: &BodyParts<'_>, triangle: &[u32; 3]) -> [f64; 2] {
        let Some(near) = &self.near_incision else { return [1.0; 2] };
        let corner = |&v: &u32| parts.body.mesh.positions[v as usize].coords;
        let center = triangle.iter().map(corner).sum::<Vector3<f32>>() / 3.0;
        let distance_mm = parts.body.cut.distance_mm(center.into());
        let weight = (1.0 - distance_mm / near.radius_mm).max(0.0);
        [near.rest_area_factor, near.stiffness_factor].map(|factor| 1.0 + weight * (factor - 1.0))
    }

    /// Share of the error that a projection removes at a triangle (`pbd`).
    fn share(&self, material: &TriangleMaterial) -> f32 {
        (self.stiffness * material.factor).min(1.0) as f32
    }

    fn add_energy_form(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
        groups: &Groups,
    ) -> Result<SystemBuilder<f32>, Error> {
        let (skin, materials) = (parts.elements.skin(), self.kept_materials(parts)?);
        let params: Vec<_> = skin
            .iter()
            .zip(&materials)
            .map(|(triangle, material)| {
                let rest = SkinTensionMaterial {
                    rest_area_scale: material.rest_area_scale,
                    amplification: self.amplification,
                };
                SkinTension::from_rest(&corners(parts, triangle), &rest)
            })
            .collect();
        let stiffness = if parts.compliant() {
            compliances(skin, |n, _| {
                let modulus = self.area_modulus_n_per_m * materials[n].factor * parts.elements.skin_share(n);
                cutis_constraints::skin_compliance(f64::from(params[n][0]), modulus)
            })?
        } else {
            self.shares(&materials)
        };
        Ok(builder.add::<SkinTension, 3>(skin, &params, stiffness, groups)?)
    }

    fn add_paper_form(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
        groups: &Groups,
    ) -> Result<SystemBuilder<f32>, Error> {
        let (skin, materials) = (parts.elements.skin(), self.kept_materials(parts)?);
        let params: Result<Vec<_>, Error> = skin
            .iter()
            .zip(&materials)
            .map(|(triangle, material)| {
                let rest = SkinTensionPaperMaterial::for_stiffness(
                    f64::from(self.share(material)),
                    material.rest_area_scale,
                    self.amplification,
                )?;
                Ok(SkinTensionPaper::from_rest(&corners(parts, triangle), &rest))
            })
            .collect();
        Ok(builder.add::<SkinTensionPaper, 3>(skin, &params?, self.shares(&materials), groups)?)
    }

    /// Load at each corner of a triangle that an incision removed, N.
    fn freed_load(
        &self,
        parts: &BodyParts<'_>,
        triangle: &[u32; 3],
        material: &TriangleMaterial,
    ) -> Result<[Vector3<f64>; 3], Error> {
        let x = triangle.map(|v| parts.position(v));
        let TriangleMaterial { rest_area_scale, factor } = *material;
        let rest = SkinTensionMaterial { rest_area_scale, amplification: self.amplification };
        let params = SkinTension::from_rest(&x, &rest);
        if parts.compliant() {
            let modulus = self.area_modulus_n_per_m * factor;
            let compliance =
                cutis_constraints::skin_compliance(params[0], modulus).map_err(Error::Material)?;
            let strength = Strength::Compliance(compliance);
            return Ok(parts.freed_load::<SkinTension, 3>(triangle, &params, &strength));
        }
        let share = f64::from(self.share(material));
        let strength = Strength::Pbd(share);
        if self.form == StcForm::Energy {
            return Ok(parts.freed_load::<SkinTension, 3>(triangle, &params, &strength));
        }
        let rest = SkinTensionPaperMaterial::for_stiffness(share, rest_area_scale, self.amplification)?;
        let params = SkinTensionPaper::from_rest(&x, &rest);
        Ok(parts.freed_load::<SkinTensionPaper, 3>(triangle, &params, &strength))
    }

    fn shares(&self, materials: &[TriangleMaterial]) -> Stiffness<f32> {
        let each = materials.iter().map(|material| self.share(material));
        Stiffness::Pbd(Values::Each(each.collect()))
    }

    /// Mean over the triangles of √(Σ w|∇A|²/α) with the scene's general modulus, 1/s: the angular
    /// frequency at which a skin element alone would oscillate.
    fn frequency(&self, parts: &BodyParts<'_>) -> f64 {
        let material = SkinTensionMaterial { rest_area_scale: self.rest_area_scale, amplification: 0.0 };
        let frequency = |triangle: &[u32; 3]| {
            let x = triangle.map(|v| parts.position(v));
            let params = SkinTension::from_rest(&x, &material);
            let gradients = SkinTension::eval(&x, &params).grad;
            let weighted = |(v, gradient): (&u32, &Vector3<f64>)| {
                f64::from(parts.inverse_masses[*v as usize]) * gradient.norm_squared()
            };
            let sum: f64 = triangle.iter().zip(&gradients).map(weighted).sum();
            (sum * self.area_modulus_n_per_m / params[0]).sqrt()
        };
        let skin = &parts.body.skin;
        skin.iter().map(frequency).sum::<f64>() / skin.len() as f64
    }
}

impl ConstraintKind for StcSection {
    fn coloring(&self) -> Coloring {
        Coloring::GreedyCpu
    }

    fn validate(&self, scene: &Scene, check: &Check<'_>) -> Result<(), Error> {
        check.positive("constraints.stc.area_modulus_n_per_m", self.area_modulus_n_per_m)?;
        check.share("constraints.stc.stiffness", self.stiffness)?;
        check.not_negative("constraints.stc.amplification", self.amplification)?;
        check.positive("constraints.stc.rest_area_scale", self.rest_area_scale)?;
        let paper = self.form == StcForm::Paper;
        let pbd = scene.solver.formulation == Formulation::Pbd;
        let why = "works with solver.formulation = \"pbd\" only; use \"energy\" with xpbd and vbd";
        check.require(!paper || pbd, "constraints.stc.form", "paper", why)?;
        let why = "must be above 0 for the paper form, whose clamp is 1/stiffness";
        check.require(!paper || self.stiffness > 0.0, "constraints.stc.stiffness", self.stiffness, why)?;
        if let Some(near) = &self.near_incision {
            check.positive("constraints.stc.near_incision.radius_mm", near.radius_mm)?;
            check.positive("constraints.stc.near_incision.rest_area_factor", near.rest_area_factor)?;
            check.positive("constraints.stc.near_incision.stiffness_factor", near.stiffness_factor)?;
        }
        Ok(())
    }

    fn add(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
    ) -> Result<(SystemBuilder<f32>, usize), Error> {
        let groups = coloring::of_mesh(parts.elements.skin(), parts.body.mesh.positions.len())?;
        let builder = match self.form {
            StcForm::Energy => self.add_energy_form(builder, parts, &groups)?,
            StcForm::Paper => self.add_paper_form(builder, parts, &groups)?,
        };
        Ok((builder, groups.len()))
    }

    fn add_loads(&self, parts: &BodyParts<'_>, loads: &mut [Vector3<f64>]) -> Result<(), Error> {
        let mut add = |triangles: &[[u32; 3]], share: &dyn Fn(usize) -> f64| -> Result<(), Error> {
            for (n, (triangle, material)) in
                triangles.iter().zip(self.materials(parts, triangles)?).enumerate()
            {
                for (&v, load) in triangle.iter().zip(self.freed_load(parts, triangle, &material)?) {
                    loads[v as usize] += load * share(n);
                }
            }
            Ok(())
        };
        add(parts.elements.removed(), &|_| 1.0)?;
        let Some(divided) = parts.elements.divided() else { return Ok(()) };
        // A divided triangle pulled on its corners in the scan. Now its copies do.
        add(divided.triangles, &|_| 1.0)?;
        add(divided.copies, &|copy| -f64::from(divided.shares[copy]))
    }

    fn tension(&self, scene: &Scene) -> Option<ScanTension> {
        let tension = self.tension_n_per_m();
        let forces = scene.solver.formulation != Formulation::Pbd;
        forces.then_some(ScanTension { along_n_per_m: tension, across_n_per_m: tension, source: None })
    }

    fn warnings(&self, parts: &BodyParts<'_>) -> Vec<String> {
        let mut warnings = Vec::new();
        if parts.nothing_fixed && !parts.at_rest {
            let warning = "skin tension acts and nothing is fixed: the whole body may shrink and drift";
            warnings.push(warning.to_owned());
        }
        if parts.body.skin.is_empty() {
            warnings.push("no skin was found: skin tension has nothing to act on".to_owned());
        } else if parts.ends_by_xpbd() {
            warnings.extend(too_stiff(parts, self.frequency(parts)));
            warnings.extend(lost_in_rounding(parts, self.tension_n_per_m()));
        }
        warnings
    }
}

impl StcSection {
    /// Tension in the scan: `T s (1 + β s)` with `s = 1/scale − 1`, the derivative of the energy of
    /// a triangle by its area.
    fn tension_n_per_m(&self) -> f64 {
        let stretch = 1.0 / self.rest_area_scale - 1.0;
        self.area_modulus_n_per_m * stretch * (1.0 + self.amplification * stretch.max(0.0))
    }
}

fn corners(parts: &BodyParts<'_>, triangle: &[u32; 3]) -> [Point3<f32>; 3] {
    triangle.map(|v| parts.body.mesh.positions[v as usize])
}
