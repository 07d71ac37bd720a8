//! `constraints.adhesion`: undermined skin that slides over what is below it without coming off.

use cutis_constraints::{Constraint, LipAdhesion};
use cutis_solver::SystemBuilder;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BodyParts, ConstraintKind, KindFacts, contact};
use crate::Error;
use crate::body::Body;
use crate::model::ModelChoice;
use crate::scene::Scene;
use crate::scene::validate::Check;

/// Adhesion of the sides of underminings that adhere. It is as stiff as contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdhesionSection {
    /// Whether it acts. `false`: undermined skin comes off.
    #[serde(default = "acts")]
    pub acts: bool,
}

fn acts() -> bool {
    true
}

impl Default for AdhesionSection {
    fn default() -> Self {
        Self { acts: true }
    }
}

impl AdhesionSection {
    pub(super) const FACTS: KindFacts = KindFacts {
        solver_names: &[LipAdhesion::NAME],
        element: "point of an undermining",
        needs_skin: false,
        counts: |body| [contact::count(body, true), 0],
    };

    /// Number of pairs of points of the finished cuts that adhere.
    pub(crate) fn pairs(&self, body: &Body) -> usize {
        if self.acts { (Self::FACTS.counts)(body)[0] } else { 0 }
    }
}

impl ConstraintKind for AdhesionSection {
    fn acts(&self) -> bool {
        self.acts
    }

    fn validate(&self, scene: &Scene, check: &Check<'_>) -> Result<(), Error> {
        let why = "needs constraints.distance or constraints.volume, whose modulus it takes";
        let known = contact::has_modulus(scene) || scene.model != ModelChoice::Pbd;
        check.require(known, "constraints.adhesion", "", why)
    }

    fn add(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
    ) -> Result<(SystemBuilder<f32>, usize), Error> {
        contact::add::<LipAdhesion>(builder, parts, true)
    }
}
