//! The table of constraint kinds that a scene can name.
//!
//! This is the one list of them. A kind is one row of `constraint_kinds!` and one file of this
//! folder, with its section of the scene, the range of its values and the way it is built. The
//! scene format, the plan, the reports, `--without` and `cutis tune` follow from the row.

mod adhesion;
pub(crate) mod contact;
mod distance;
mod freed;
mod membrane;
mod membrane_presets;
mod moduli;
mod rounding;
mod skin_tension;
mod tet_volume;
mod too_stiff;

use std::fmt;

use cutis_solver::{Formulation, Stiffness, SystemBuilder, Values};
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use adhesion::AdhesionSection;
pub use contact::ContactSection;
pub use distance::DistanceSection;
pub use membrane::{MembraneDirections, MembraneSection};
pub use skin_tension::{NearIncisionSection, StcForm, StcSection};
pub use tet_volume::VolumeConstraintSection;

use super::coloring::{self, Coloring};
use super::elements::Elements;
use crate::Error;
use crate::body::Body;
use crate::scene::validate::Check;
use crate::scene::{RunEnd, Scene, SceneFile, SolverSection};

/// Writes the section `constraints` of a scene and the table of its kinds from one list of rows.
/// A row is the documentation, the key and the type of a section that is a [`ConstraintKind`].
macro_rules! constraint_kinds {
    ($($(#[$doc:meta])* $key:ident: $section:ty,)*) => {
        /// The constraint kinds of the scene.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct ConstraintsSection {
            $(
                $(#[$doc])*
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub $key: Option<$section>,
            )*
        }

        /// One row per constraint kind, in the order in which a solver projects them.
        pub(crate) const KINDS: &[KindRow] = &[$(
            KindRow {
                key: stringify!($key),
                facts: <$section>::FACTS,
                section: |all| {
                    let section = all.$key.as_ref().map(|section| section as &dyn ConstraintKind);
                    section.filter(|section| section.acts())
                },
                remove: |all| all.$key = None,
            },
        )*];
    };
}

constraint_kinds! {
    /// Springs along the lattice edges.
    distance: DistanceSection,
    /// Volumes of the tetrahedra.
    volume: VolumeConstraintSection,
    /// Skin tension over the skin triangles, by their area (the paper's form).
    stc: StcSection,
    /// The skin as a membrane with tension and modulus along and across its lines.
    membrane: MembraneSection,
    /// Contact of the lips of incisions without a width. Scenes with sutures have it by default.
    contact: ContactSection,
    /// Adhesion of undermined skin to what is below it. Scenes with an undermining that adheres
    /// have it by default.
    adhesion: AdhesionSection,
}

/// One row of the table of constraint kinds.
pub(crate) struct KindRow {
    /// Key of its section under `constraints`, and its name in all reports.
    pub(crate) key: &'static str,
    pub(crate) facts: KindFacts,
    /// Its section of a scene; none if the scene does not name it, or if it does not act.
    pub(crate) section: fn(&ConstraintsSection) -> Option<&dyn ConstraintKind>,
    remove: fn(&mut ConstraintsSection),
}

/// Facts about a constraint kind that the rest of the program needs.
pub(crate) struct KindFacts {
    /// Names of its constraint types in the solver. A system contains one of them.
    pub(crate) solver_names: &'static [&'static str],
    /// Name of the element on which one constraint acts, for messages.
    pub(crate) element: &'static str,
    /// Whether it acts on skin triangles, so that the skin must be found.
    pub(crate) needs_skin: bool,
    /// Number of elements in the body, and of elements that a region of interest leaves out.
    pub(crate) counts: fn(&Body) -> [usize; 2],
}

/// A section of a scene that names a constraint kind.
pub(crate) trait ConstraintKind {
    /// Whether the kind acts. One that does not is left out.
    fn acts(&self) -> bool {
        true
    }

    /// How the constraints get their colors.
    fn coloring(&self) -> Coloring {
        Coloring::ClosedForm
    }

    /// Checks the values of the section.
    ///
    /// # Errors
    /// [`Error::SceneKey`] with the first key whose value is out of range.
    fn validate(&self, scene: &Scene, check: &Check<'_>) -> Result<(), Error>;

    /// Adds the constraints to a system and returns the number of their colors.
    ///
    /// # Errors
    /// [`Error`] for a value that does not work with this body.
    fn add(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
    ) -> Result<(SystemBuilder<f32>, usize), Error>;

    /// Adds to `loads` (N, one per vertex) the load that a scan at rest needs beyond what the
    /// constraints of [`add`](Self::add) hold by themselves: the negative of the force that the
    /// elements removed by incisions had in the scan.
    ///
    /// # Errors
    /// The errors of [`add`](Self::add).
    fn add_loads(&self, _parts: &BodyParts<'_>, _loads: &mut [Vector3<f64>]) -> Result<(), Error> {
        Ok(())
    }

    /// The tension of the skin in the scan that the section stands for; none if it has none, or if
    /// the formulation of the scene knows no forces.
    fn tension(&self, _scene: &Scene) -> Option<ScanTension> {
        None
    }

    /// Warnings about this kind in this body.
    fn warnings(&self, _parts: &BodyParts<'_>) -> Vec<String> {
        Vec::new()
    }
}

/// Tension of the skin in the scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScanTension {
    /// Tension along the lines of the skin, N/m.
    pub along_n_per_m: f64,
    /// Tension across the lines of the skin, N/m.
    pub across_n_per_m: f64,
    /// Range and source of a preset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

impl fmt::Display for ScanTension {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { along_n_per_m: along, across_n_per_m: across, source } = self;
        match along == across {
            true => write!(out, "{along:.1} N/m in all directions")?,
            false => write!(out, "{along:.1} N/m along the lines, {across:.1} N/m across them")?,
        }
        source.as_ref().map_or(Ok(()), |source| write!(out, " ({source})"))
    }
}

/// The inputs from which a constraint kind is built.
pub(crate) struct BodyParts<'a> {
    pub(crate) file: SceneFile<'a>,
    pub(crate) solver: &'a SolverSection,
    /// When the run ends.
    pub(crate) until: RunEnd,
    /// All kinds of the scene.
    pub(crate) constraints: &'a ConstraintsSection,
    /// Whether the scan shows the body in equilibrium.
    pub(crate) at_rest: bool,
    pub(crate) body: &'a Body,
    /// The elements on which the constraints act.
    pub(crate) elements: Elements<'a>,
    /// Inverse mass of each vertex, 1/kg; 0 for a vertex that does not move.
    pub(crate) inverse_masses: &'a [f32],
    /// Whether the scene fixes no vertex.
    pub(crate) nothing_fixed: bool,
}

impl BodyParts<'_> {
    /// Whether stiffness is a compliance in physical units, as in `xpbd` and `vbd`.
    fn compliant(&self) -> bool {
        self.solver.formulation != Formulation::Pbd
    }

    /// Whether frames of XPBD decide where the body ends, and not a search for the state of rest.
    fn ends_by_xpbd(&self) -> bool {
        self.solver.formulation == Formulation::Xpbd && self.until == RunEnd::Frames
    }

    /// Rest position of a vertex, local meters.
    fn position(&self, vertex: u32) -> Point3<f64> {
        self.body.mesh.positions[vertex as usize].map(f64::from)
    }
}

impl ConstraintsSection {
    /// The kinds that the scene names, each with its row of the table.
    pub(crate) fn named(&self) -> impl Iterator<Item = (&'static KindRow, &dyn ConstraintKind)> {
        KINDS.iter().filter_map(|row| Some((row, (row.section)(self)?)))
    }

    /// Whether points on both sides of cuts touch or adhere.
    pub(crate) fn joins_lips(&self) -> bool {
        self.contact.as_ref().is_some_and(|contact| contact.acts)
            || self.adhesion.as_ref().is_some_and(|adhesion| adhesion.acts)
    }

    /// Number of pairs of points of the finished cuts that touch or adhere.
    pub(crate) fn lip_pairs(&self, body: &Body) -> usize {
        let touching = self.contact.as_ref().map_or(0, |contact| contact.pairs(body));
        touching + self.adhesion.as_ref().map_or(0, |adhesion| adhesion.pairs(body))
    }

    /// Whether a kind that the scene names acts on the skin.
    pub(crate) fn need_skin(&self) -> bool {
        self.named().any(|(row, _)| row.facts.needs_skin)
    }

    /// Removes a kind by its key, so that the scene no longer names it.
    /// Returns false for a name that is not a key of [`constraint_kinds()`].
    pub fn remove(&mut self, kind: &str) -> bool {
        let row = KINDS.iter().find(|row| row.key == kind);
        row.inspect(|row| (row.remove)(self)).is_some()
    }
}

/// Keys of all constraint kinds that a scene can name, in the order of its schema.
pub fn constraint_kinds() -> impl Iterator<Item = &'static str> {
    KINDS.iter().map(|row| row.key)
}

/// The name of a part of the solver in all reports. A kind has the name of its key,
/// for each of its constraint types. Other parts keep the solver's name.
pub(crate) fn report_name(solver_name: &str) -> &str {
    let named = KINDS.iter().find(|row| row.facts.solver_names.contains(&solver_name));
    named.map_or(solver_name, |row| row.key)
}

/// One compliance per element, from its number and vertices.
fn compliances<const N: usize>(
    elements: &[[u32; N]],
    compliance: impl Fn(usize, [u32; N]) -> Result<f64, cutis_constraints::MaterialError>,
) -> Result<Stiffness<f32>, Error> {
    let each: Result<Vec<f32>, _> =
        elements.iter().enumerate().map(|(n, &element)| Ok(compliance(n, element)? as f32)).collect();
    Ok(Stiffness::Compliance(Values::Each(each.map_err(Error::Material)?)))
}

fn one() -> f64 {
    1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reports find a kind by the solver's name. If two kinds had one name, the costs of both would
    /// appear under the first.
    #[test]
    fn no_two_kinds_share_a_solver_name() {
        let mut names: Vec<&str> = KINDS.iter().flat_map(|row| row.facts.solver_names).copied().collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count, "{names:?}");
        assert!(count > KINDS.len(), "skin tension has two forms");
    }
}
