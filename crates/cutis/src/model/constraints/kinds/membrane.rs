//! `constraints.membrane`: the skin as a membrane under tension, along and across its lines.

use std::path::PathBuf;

use cutis_constraints::{
    Constraint, MaterialError, SkinStrip, SkinStripAtRest, SkinStripLaw, SkinStripMaterial, SkinStripTurn,
};
use cutis_skin::{Directions, Strokes};
use cutis_solver::{Formulation, Stiffness, SystemBuilder, Values};
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::freed::Strength;
use super::membrane_presets::{MembranePreset, PRESETS, preset};
use super::rounding::lost_in_rounding;
use super::too_stiff::too_stiff;
use super::{BodyParts, Coloring, ConstraintKind, KindFacts, ScanTension, coloring, one};
use crate::Error;
use crate::body::Tangent;
use crate::scene::validate::Check;
use crate::scene::{Scene, SceneFile};

/// The skin as a membrane under tension. Values are along the lines of tension and across them.
/// Without a preset all four values are required.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MembraneSection {
    /// Part of the body whose values are used unless a key gives another one: `arm`, `limb`,
    /// `trunk`, `head`, `cheek`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Tension along the lines in the scan, N/m; below the modulus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tension_along_n_per_m: Option<f64>,
    /// Tension across the lines in the scan, N/m; below the modulus.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tension_across_n_per_m: Option<f64>,
    /// Growth of the tension along the lines per strain, N/m (`xpbd`, `vbd`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modulus_along_n_per_m: Option<f64>,
    /// Growth of the tension across the lines per strain, N/m (`xpbd`, `vbd`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modulus_across_n_per_m: Option<f64>,
    /// Growth of the modulus per strain beyond the scan: the J shape of the curve of skin.
    #[serde(default)]
    pub stiffening: f64,
    /// Resistance to compression over resistance to tension, 0 (the skin wrinkles) to 1.
    #[serde(default)]
    pub compression: f64,
    /// Share of the error that a projection removes, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
    /// Directions of the lines. Left out: those of the preset. Required where values along and
    /// across differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub directions: Option<MembraneDirections>,
}

/// Directions of the lines of tension: exactly one of `around`, `along` and `strokes`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MembraneDirections {
    /// In the skin and perpendicular to this axis (RAS+), as on the trunk and the neck.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub around: Option<[f64; 3]>,
    /// Along this axis (RAS+), as on a limb.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<[f64; 3]>,
    /// A file with lines on the skin: points `x y z` in RAS+ mm, or markups of 3D Slicer. Relative
    /// to the scene file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strokes: Option<PathBuf>,
}

/// The values of the section with those of its preset.
#[derive(Clone, Copy)]
pub(crate) struct MembraneValues {
    /// Laws along and across the lines.
    pub(crate) laws: [SkinStripLaw; 2],
}

impl MembraneValues {
    /// Laws along and across the lines where the direction has this weight. Where it has none, both
    /// are the mean.
    fn blended(&self, weight: f64) -> [SkinStripLaw; 2] {
        let [along, across] = self.laws;
        let blend = |this: f64, other: f64| 0.5 * ((1.0 + weight) * this + (1.0 - weight) * other);
        let law = |this: SkinStripLaw, other: SkinStripLaw| SkinStripLaw {
            tension_n_per_m: blend(this.tension_n_per_m, other.tension_n_per_m),
            modulus_n_per_m: blend(this.modulus_n_per_m, other.modulus_n_per_m),
            ..this
        };
        [law(along, across), law(across, along)]
    }
}

const KEY: &str = "constraints.membrane";

impl MembraneSection {
    pub(super) const FACTS: KindFacts = KindFacts {
        solver_names: &[SkinStrip::NAME, SkinStripAtRest::NAME, SkinStripTurn::NAME],
        element: "skin triangle",
        needs_skin: true,
        counts: |body| [body.skin.len(), body.inactive_skin.triangles.len()],
    };

    fn preset(&self) -> Option<&'static MembranePreset> {
        self.preset.as_deref().and_then(preset)
    }

    /// The values, if each is given by a key or a preset.
    pub(crate) fn values(&self) -> Option<MembraneValues> {
        let of =
            |key: Option<f64>, value: fn(&MembranePreset) -> f64| key.or_else(|| self.preset().map(value));
        let tension = [
            of(self.tension_along_n_per_m, |p| p.tension[0])?,
            of(self.tension_across_n_per_m, |p| p.tension[1])?,
        ];
        let modulus = [
            of(self.modulus_along_n_per_m, |p| p.modulus[0])?,
            of(self.modulus_across_n_per_m, |p| p.modulus[1])?,
        ];
        let law = |n: usize| SkinStripLaw {
            tension_n_per_m: tension[n],
            modulus_n_per_m: modulus[n],
            stiffening: self.stiffening,
            compression: self.compression,
        };
        Some(MembraneValues { laws: [law(0), law(1)] })
    }

    /// The directions of the section or of its preset; none if it has neither.
    fn lines(&self) -> Option<MembraneDirections> {
        self.directions.clone().or_else(|| self.preset().map(|preset| (preset.directions)()))
    }

    /// The directions for the field of the skin, and true. Isotropic skin needs none: it gets any,
    /// and false.
    ///
    /// # Errors
    /// [`Error`] for a file of strokes that cannot be read.
    pub(crate) fn directions(&self, file: SceneFile<'_>) -> Result<(Directions, bool), Error> {
        let any = Directions::Around([0.0, 0.0, 1.0]);
        let Some(lines) = self.lines() else { return Ok((any, false)) };
        Ok(match (lines.around, lines.along, lines.strokes) {
            (_, Some(axis), _) => (Directions::Along(axis), true),
            (_, _, Some(path)) => {
                let read =
                    Strokes::read(&path).map_err(file.blame("constraints.membrane.directions.strokes"))?;
                (Directions::Strokes(read), true)
            }
            (Some(axis), ..) => (Directions::Around(axis), true),
            (None, None, None) => (any, false),
        })
    }

    /// Tension in the scan along and across the lines at a place of the skin, N/m. None if the
    /// formulation knows no forces.
    pub(crate) fn tension_at(&self, tangent: &Tangent, formulation: Formulation) -> Option<[f64; 2]> {
        let values = self.values().filter(|_| formulation != Formulation::Pbd)?;
        Some(values.blended(tangent.weight).map(|law| law.tension_n_per_m))
    }

    /// The strips of some triangles, two per triangle. `share` is the share of
    /// its area that a triangle holds.
    ///
    /// # Errors
    /// [`Error`] for a material that a triangle cannot have.
    fn strips(
        &self,
        parts: &BodyParts<'_>,
        skin: &[[u32; 3]],
        share: &dyn Fn(usize) -> f64,
    ) -> Result<Vec<Strip>, Error> {
        let (Some(tangents), Some(values)) = (parts.body.tangents(skin), self.values()) else {
            return Ok(Vec::new());
        };
        let mut strips = Vec::with_capacity(2 * skin.len());
        let numbered = skin.iter().enumerate().zip(tangents);
        for ((number, triangle), Tangent { normal, along, weight }) in numbered {
            let directions = [along, normal.cross(&along)];
            let x = triangle.map(|v| parts.position(v));
            for (direction, law) in directions.into_iter().zip(values.blended(weight)) {
                let material =
                    SkinStripMaterial::new(normal.into(), direction.into(), law).map_err(Error::Material)?;
                match material.compliance(&x) {
                    Ok(whole) => {
                        let compliance = whole / share(number);
                        strips.push(Strip { triangle: *triangle, material, compliance });
                    }
                    // A strip without a width has no force.
                    Err(MaterialError::NoWidth { .. }) => {}
                    Err(error) => return Err(Error::Material(error)),
                }
            }
        }
        Ok(strips)
    }

    /// The strips of the cut skin.
    fn kept_strips(&self, parts: &BodyParts<'_>) -> Result<Vec<Strip>, Error> {
        self.strips(parts, parts.elements.skin(), &|triangle| parts.elements.skin_share(triangle))
    }

    /// Adds the load that strips set free, times a sign.
    fn add_freed(&self, parts: &BodyParts<'_>, strips: &[Strip], sign: f64, loads: &mut [Vector3<f64>]) {
        for strip in strips {
            let x: [Point3<f64>; 3] = strip.triangle.map(|v| parts.position(v));
            let params = SkinStrip::from_rest(&x, &strip.material);
            let strength = match parts.compliant() {
                true => Strength::Compliance(strip.compliance),
                false => Strength::Pbd(self.stiffness),
            };
            let freed = parts.freed_load::<SkinStrip, 3>(&strip.triangle, &params, &strength);
            for (&v, load) in strip.triangle.iter().zip(freed) {
                loads[v as usize] += load * sign;
            }
        }
    }

    /// Mean over the strips of √(Σ w|∇C|²/α), 1/s: the angular frequency at which a strip alone
    /// would oscillate. Zero without strips.
    fn frequency(&self, parts: &BodyParts<'_>) -> f64 {
        let strips = self.kept_strips(parts).unwrap_or_default();
        let frequency = |strip: &Strip| {
            let [b1, b2, ..] =
                SkinStrip::from_rest(&strip.triangle.map(|v| parts.position(v)), &strip.material);
            let weighted = |(v, b): (u32, f64)| f64::from(parts.inverse_masses[v as usize]) * b * b;
            let sum: f64 = strip.triangle.into_iter().zip([b1, b2, -b1 - b2]).map(weighted).sum();
            (sum / strip.compliance).sqrt()
        };
        strips.iter().map(frequency).sum::<f64>() / strips.len().max(1) as f64
    }

    /// Adds one type of strip for all strips.
    fn add_type<C: Constraint<3, Material = SkinStripMaterial>>(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
        strips: &[Strip],
    ) -> Result<(SystemBuilder<f32>, usize), Error> {
        let triangles: Vec<[u32; 3]> = strips.iter().map(|strip| strip.triangle).collect();
        let groups = coloring::of_mesh(&triangles, parts.body.mesh.positions.len())?;
        let at_rest = |triangle: &[u32; 3]| triangle.map(|v| parts.body.mesh.positions[v as usize]);
        let params: Vec<C::Params<f32>> =
            strips.iter().map(|strip| C::from_rest(&at_rest(&strip.triangle), &strip.material)).collect();
        let stiffness = if parts.compliant() {
            Stiffness::Compliance(Values::Each(strips.iter().map(|strip| strip.compliance as f32).collect()))
        } else {
            Stiffness::pbd(self.stiffness as f32)
        };
        Ok((builder.add::<C, 3>(&triangles, &params, stiffness, &groups)?, groups.len()))
    }

    /// Checks that each value is given once.
    fn validate_values(&self, check: &Check<'_>) -> Result<(), Error> {
        if let Some(name) = &self.preset {
            let names: Vec<&str> = PRESETS.iter().map(|preset| preset.name).collect();
            let why = format!("no such preset; use {}", names.join(", "));
            check.require(
                self.preset().is_some(),
                "constraints.membrane.preset",
                format!("{name:?}"),
                &why,
            )?;
        }
        let why = "needs tension_along_n_per_m, tension_across_n_per_m, modulus_along_n_per_m and \
                   modulus_across_n_per_m, or a preset";
        check.require(self.values().is_some(), KEY, "", why)?;
        let Some(MembraneValues { laws }) = self.values() else { return Ok(()) };
        for (law, name) in laws.iter().zip(["along", "across"]) {
            let tension = format!("{KEY}.tension_{name}_n_per_m");
            check.not_negative(&tension, law.tension_n_per_m)?;
            check.positive(&format!("{KEY}.modulus_{name}_n_per_m"), law.modulus_n_per_m)?;
            let below = law.tension_n_per_m < law.modulus_n_per_m;
            let why = format!("must be below the modulus of {} N/m", law.modulus_n_per_m);
            check.require(below, &tension, law.tension_n_per_m, &why)?;
        }
        let [along, across] = laws;
        let why = "are needed where values along and across differ: give around, along or strokes";
        check.require(along == across || self.lines().is_some(), &format!("{KEY}.directions"), "", why)
    }

    fn validate_directions(&self, check: &Check<'_>) -> Result<(), Error> {
        let Some(MembraneDirections { around, along, strokes }) = &self.directions else { return Ok(()) };
        let given = [around.is_some(), along.is_some(), strokes.is_some()];
        let one = given.iter().filter(|given| **given).count() == 1;
        let why = "must have exactly one of around, along and strokes";
        check.require(one, &format!("{KEY}.directions"), "", why)?;
        for (name, axis) in [("around", around), ("along", along)] {
            let Some(axis) = axis else { continue };
            let key = format!("{KEY}.directions.{name}");
            check.point(&key, *axis)?;
            check.require(*axis != [0.0; 3], &key, format!("{axis:?}"), "must not be zero")?;
        }
        Ok(())
    }
}

/// A strip on one triangle.
struct Strip {
    triangle: [u32; 3],
    material: SkinStripMaterial,
    /// Compliance, m/N.
    compliance: f64,
}

impl ConstraintKind for MembraneSection {
    fn coloring(&self) -> Coloring {
        Coloring::GreedyCpu
    }

    fn validate(&self, _: &Scene, check: &Check<'_>) -> Result<(), Error> {
        check.not_negative("constraints.membrane.stiffening", self.stiffening)?;
        check.share("constraints.membrane.compression", self.compression)?;
        check.share("constraints.membrane.stiffness", self.stiffness)?;
        self.validate_directions(check)?;
        self.validate_values(check)
    }

    fn add(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
    ) -> Result<(SystemBuilder<f32>, usize), Error> {
        let strips = self.kept_strips(parts)?;
        // Vertex block descent holds the scan by a load on each vertex.
        if !parts.at_rest || parts.solver.formulation == Formulation::Vbd {
            return self.add_type::<SkinStrip>(builder, parts, &strips);
        }
        let (builder, colors) = self.add_type::<SkinStripAtRest>(builder, parts, &strips)?;
        let (builder, turn_colors) = self.add_type::<SkinStripTurn>(builder, parts, &strips)?;
        Ok((builder, colors + turn_colors))
    }

    fn add_loads(&self, parts: &BodyParts<'_>, loads: &mut [Vector3<f64>]) -> Result<(), Error> {
        self.add_freed(parts, &self.strips(parts, parts.elements.removed(), &|_| 1.0)?, 1.0, loads);
        let Some(divided) = parts.elements.divided() else { return Ok(()) };
        // A divided triangle pulled on its corners in the scan. Now its copies do.
        self.add_freed(parts, &self.strips(parts, divided.triangles, &|_| 1.0)?, 1.0, loads);
        let share = |copy: usize| f64::from(divided.shares[copy]);
        self.add_freed(parts, &self.strips(parts, divided.copies, &share)?, -1.0, loads);
        Ok(())
    }

    fn tension(&self, scene: &Scene) -> Option<ScanTension> {
        let MembraneValues { laws: [along, across] } = self.values()?;
        let source = self.preset().map(|preset| {
            let [low, high] = preset.tension_range;
            format!("preset {:?}, {low} to {high} N/m; {}", preset.name, preset.source)
        });
        let forces = scene.solver.formulation != Formulation::Pbd;
        forces.then_some(ScanTension {
            along_n_per_m: along.tension_n_per_m,
            across_n_per_m: across.tension_n_per_m,
            source,
        })
    }

    fn warnings(&self, parts: &BodyParts<'_>) -> Vec<String> {
        let mut warnings = Vec::new();
        if parts.body.skin.is_empty() {
            warnings.push("no skin was found: skin tension has nothing to act on".to_owned());
        }
        if parts.nothing_fixed && !parts.at_rest {
            warnings
                .push("skin tension acts and nothing is fixed: the whole body may shrink and drift".into());
        }
        if parts.ends_by_xpbd() {
            warnings.extend(too_stiff(parts, self.frequency(parts)));
            let tension = |values: MembraneValues| values.laws.map(|law| law.tension_n_per_m);
            let most = self.values().map(tension).map_or(0.0, |[along, across]| along.max(across));
            warnings.extend(lost_in_rounding(parts, most));
        }
        warnings
    }
}
