//! `constraints.distance`: a spring along each lattice edge.

use cutis_coloring::Groups;
use cutis_constraints::{Constraint, Distance, DistanceMaterial};
use cutis_solver::{Stiffness, SystemBuilder};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::moduli::{self, Moduli, springs_over_body};
use super::{BodyParts, ConstraintKind, KindFacts, compliances, one};
use crate::Error;
use crate::scene::validate::Check;
use crate::scene::{Scene, TissueMaterialSection};

/// Key of the modulus.
const MODULUS_KEY: &str = "constraints.distance.youngs_modulus_pa";

/// Springs along the lattice edges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistanceSection {
    /// Young's modulus of the springs, Pa (`xpbd`, `vbd`): about four times that of the body.
    /// Required without `materials`; to be left out with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub youngs_modulus_pa: Option<f64>,
    /// Share of the error that a projection removes, 0 to 1 (`pbd`).
    #[serde(default = "one")]
    pub stiffness: f64,
}

impl DistanceSection {
    pub(super) const FACTS: KindFacts = KindFacts {
        solver_names: &[Distance::NAME],
        element: "edge",
        needs_skin: false,
        counts: |body| {
            [body.mesh.edges.len(), body.mesh.inactive.as_ref().map_or(0, |inactive| inactive.edges)]
        },
    };

    /// The moduli of the springs.
    pub(super) fn moduli<'a>(&self, parts: &BodyParts<'a>) -> Result<Moduli<'a>, Error> {
        let factor = springs_over_body(parts.body.mesh.lattice.split());
        let of_row = |row: &TissueMaterialSection| factor * row.youngs_modulus_pa;
        parts.moduli(MODULUS_KEY, self.youngs_modulus_pa, of_row)
    }
}

impl ConstraintKind for DistanceSection {
    fn validate(&self, scene: &Scene, check: &Check<'_>) -> Result<(), Error> {
        moduli::validate(scene, check, MODULUS_KEY, self.youngs_modulus_pa)?;
        check.share("constraints.distance.stiffness", self.stiffness)
    }

    fn add(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
    ) -> Result<(SystemBuilder<f32>, usize), Error> {
        let elements = &parts.elements;
        let groups = Groups::from_colors(&elements.edge_colors())?;
        let stiffness = if parts.compliant() {
            let volumes = elements.edge_volumes();
            let moduli = self.moduli(parts)?;
            compliances(elements.edges(), |n, [a, b]| {
                let length = nalgebra::distance(&parts.position(a), &parts.position(b));
                cutis_constraints::distance_compliance(length, moduli.of([a, b]), f64::from(volumes[n]))
            })?
        } else {
            Stiffness::pbd(self.stiffness as f32)
        };
        let rest = DistanceMaterial { rest_scale: 1.0 };
        Ok((builder.add_from_rest::<Distance, 2>(elements.edges(), &rest, stiffness, &groups)?, groups.len()))
    }
}
