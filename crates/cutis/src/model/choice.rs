//! The list of models. A new model is a variant of [`ModelChoice`] and an arm of each `match` here.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::chainmail::{self, ChainmailModel};
use super::constraints::{self, ConstraintModel};
use super::{Model, ModelInput};
use crate::run::clock::Clock;
use crate::scene::Scene;
use crate::scene::validate::Check;
use crate::{Error, Progress};

/// Deformation model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ModelChoice {
    /// Position-based dynamics over a tetrahedral lattice.
    #[default]
    Pbd,
    /// ChainMail: links between the points of the lattice, which follow only beyond a limit.
    Chainmail,
}

impl ModelChoice {
    /// Whether an incision with a width may be made in a body that has begun to move.
    pub(crate) fn cuts_later(self) -> bool {
        match self {
            Self::Pbd => false,
            Self::Chainmail => true,
        }
    }

    /// Whether a cut of no width is made while the body moves. ChainMail makes all of them like
    /// that: also those that exist from the start are made in the first frame. `later` tells
    /// whether it begins after the start, or grows.
    pub(crate) fn cuts_while_moving(self, later: bool) -> bool {
        match self {
            Self::Pbd => later,
            Self::Chainmail => true,
        }
    }
}

/// Builds the model that the scene names.
///
/// # Errors
/// [`Error`] for a value of the scene that does not work with this body.
pub(crate) fn build(input: &ModelInput<'_>, clock: &mut Clock<'_>) -> Result<Box<dyn Model>, Error> {
    Ok(match input.scene.model {
        ModelChoice::Pbd => {
            let build = |_: &dyn Progress| ConstraintModel::build(input);
            Box::new(clock.stage("constraints and colors", 0, build)?)
        }
        ModelChoice::Chainmail => {
            let build = |_: &dyn Progress| ChainmailModel::build(input);
            Box::new(clock.stage("links and materials", 0, build)?)
        }
    })
}

/// Checks the sections of all models.
///
/// # Errors
/// [`Error::SceneKey`] with the first key whose value cannot be used.
pub(crate) fn validate(scene: &Scene, check: &Check<'_>) -> Result<(), Error> {
    chainmail::section::validate(scene, check)?;
    constraints::validate(scene, check)
}

/// Adds the default sections of the scene's model, so that reports show them.
pub(crate) fn fill_defaults(scene: &mut Scene) {
    match scene.model {
        ModelChoice::Pbd => constraints::fill_default(scene),
        ModelChoice::Chainmail => {
            scene.chainmail.get_or_insert_default();
        }
    }
}
