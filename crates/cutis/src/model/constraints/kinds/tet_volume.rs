//! `constraints.volume`: the volume of each tetrahedron.

use cutis_coloring::Groups;
use cutis_constraints::{Constraint, Volume, VolumeMaterial};
use cutis_solver::{Stiffness, SystemBuilder};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::moduli::Moduli;
use super::{BodyParts, ConstraintKind, KindFacts, compliances, moduli, one};
use crate::Error;
use crate::scene::Scene;
use crate::scene::validate::Check;

/// Key of the modulus.
const MODULUS_KEY: &str = "constraints.volume.bulk_modulus_pa";

/// Volumes of the tetrahedra.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumeConstraintSection {
    /// Bulk modulus, Pa (`xpbd`, `vbd`). Required without `materials`; to be left out with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bulk_modulus_pa: Option<f64>,
    /// Share of the error that a projection removes, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
}

impl VolumeConstraintSection {
    pub(super) const FACTS: KindFacts = KindFacts {
        solver_names: &[Volume::NAME],
        element: "tetrahedron",
        needs_skin: false,
        counts: |body| {
            [body.mesh.tets.len(), body.mesh.inactive.as_ref().map_or(0, |inactive| inactive.tets)]
        },
    };

    /// The moduli of the tetrahedra.
    pub(super) fn moduli<'a>(&self, parts: &BodyParts<'a>) -> Result<Moduli<'a>, Error> {
        parts.moduli(MODULUS_KEY, self.bulk_modulus_pa, |row| row.bulk_modulus_pa)
    }
}

impl ConstraintKind for VolumeConstraintSection {
    fn validate(&self, scene: &Scene, check: &Check<'_>) -> Result<(), Error> {
        moduli::validate(scene, check, MODULUS_KEY, self.bulk_modulus_pa)?;
        check.share("constraints.volume.stiffness", self.stiffness)
    }

    fn add(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
    ) -> Result<(SystemBuilder<f32>, usize), Error> {
        let elements = &parts.elements;
        let groups = Groups::from_colors(&elements.tet_colors())?;
        let stiffness = if parts.compliant() {
            let volumes = elements.tet_volumes();
            let moduli = self.moduli(parts)?;
            compliances(elements.tets(), |n, tet| {
                cutis_constraints::volume_compliance(f64::from(volumes[n]), moduli.of(tet))
            })?
        } else {
            Stiffness::pbd(self.stiffness as f32)
        };
        let rest = VolumeMaterial { rest_scale: 1.0 };
        Ok((builder.add_from_rest::<Volume, 4>(elements.tets(), &rest, stiffness, &groups)?, groups.len()))
    }
}
