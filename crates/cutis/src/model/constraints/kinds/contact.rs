//! `constraints.contact`: the lips of a cut of no width do not pass through each other.

use cutis_coloring::Groups;
use cutis_constraints::{Constraint, LipContact, LipContactMaterial, lip_contact_compliance};
use cutis_mesh::TetMesh;
use cutis_mesh::sever::LipPair;
use cutis_solver::{Formulation, Stiffness, SystemBuilder, Values};
use nalgebra::distance;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BodyParts, ConstraintKind, KindFacts};
use crate::Error;
use crate::body::Body;
use crate::model::ModelChoice;
use crate::model::constraints::elements::Elements;
use crate::scene::Scene;
use crate::scene::validate::Check;

/// Contact of the lips of cuts without a width. It is as stiff as the springs and the volumes of
/// the tissue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactSection {
    /// Whether the lips touch. `false`: they pass through each other.
    #[serde(default = "acts")]
    pub acts: bool,
}

fn acts() -> bool {
    true
}

impl Default for ContactSection {
    fn default() -> Self {
        Self { acts: true }
    }
}

/// Adds the section to a scene with sutures, and that of adhesion to one with skin that adheres, if
/// springs or volumes give it a modulus.
pub(crate) fn fill_default(scene: &mut Scene) {
    let adheres = scene.undermining.iter().any(|undermining| undermining.adheres);
    if !scene.suture.is_empty() && has_modulus(scene) {
        scene.constraints.contact.get_or_insert_default();
    }
    if adheres && has_modulus(scene) {
        scene.constraints.adhesion.get_or_insert_default();
    }
}

/// Whether the stiffness of contacts is known.
pub(crate) fn has_modulus(scene: &Scene) -> bool {
    let constraints = &scene.constraints;
    let kinds = constraints.distance.is_some() || constraints.volume.is_some();
    kinds || scene.solver.formulation == Formulation::Pbd
}

impl ContactSection {
    pub(super) const FACTS: KindFacts = KindFacts {
        solver_names: &[LipContact::NAME],
        element: "lip",
        needs_skin: false,
        counts: |body| [count(body, false), 0],
    };

    /// Number of pairs of points of the finished cuts that touch.
    pub(crate) fn pairs(&self, body: &Body) -> usize {
        if self.acts { (Self::FACTS.counts)(body)[0] } else { 0 }
    }
}

impl ConstraintKind for ContactSection {
    fn acts(&self) -> bool {
        self.acts
    }

    fn validate(&self, scene: &Scene, check: &Check<'_>) -> Result<(), Error> {
        let why = "needs constraints.distance or constraints.volume, whose modulus it takes";
        let known = has_modulus(scene) || scene.model != ModelChoice::Pbd;
        check.require(known, "constraints.contact", "", why)
    }

    fn add(
        &self,
        builder: SystemBuilder<f32>,
        parts: &BodyParts<'_>,
    ) -> Result<(SystemBuilder<f32>, usize), Error> {
        add::<LipContact>(builder, parts, false)
    }
}

/// Number of pairs of points of the finished cuts that adhere, or of the others.
pub(super) fn count(body: &Body, adhering: bool) -> usize {
    let pairs = body.severed.iter().flat_map(|severed| &severed.lip_pairs);
    pairs.filter(|pair| body.adhering_blades.contains(&pair.blade) == adhering).count()
}

/// Adds a constraint type to the pairs that adhere, or to the others.
pub(super) fn add<C>(
    builder: SystemBuilder<f32>,
    parts: &BodyParts<'_>,
    adhering: bool,
) -> Result<(SystemBuilder<f32>, usize), Error>
where
    C: for<'a> Constraint<4, Params<f32> = [f32; 4], Material = LipContactMaterial>,
{
    let chosen = |pair: &&LipPair| parts.body.adhering_blades.contains(&pair.blade) == adhering;
    let pairs: Vec<LipPair> = parts.elements.lip_pairs().iter().filter(chosen).copied().collect();
    // Along growing cuts there may be pairs later.
    if pairs.is_empty() && !matches!(parts.elements, Elements::Wound(_)) {
        return Ok((builder, 0));
    }
    let nodes: Vec<[u32; 4]> = pairs.iter().map(|pair| pair.nodes).collect();
    let params: Vec<[f32; 4]> = pairs.iter().map(|pair| params::<C>(parts, pair)).collect();
    let color = |pair: &LipPair| parts.body.mesh.edge_color(pair.edge, pair.number);
    let groups = Groups::from_colors(&pairs.iter().map(color).collect::<Vec<u16>>())?;
    let stiffness = if parts.compliant() { compliances(parts, &pairs)? } else { Stiffness::pbd(1.0) };
    Ok((builder.add::<C, 4>(&nodes, &params, stiffness, &groups)?, groups.len()))
}

fn params<C>(parts: &BodyParts<'_>, pair: &LipPair) -> [f32; 4]
where
    C: Constraint<4, Material = LipContactMaterial>,
{
    let rest = pair.nodes.map(|node| parts.position(node));
    let material = LipContactMaterial { part: pair.part.into(), normal: pair.normal.map(f64::from) };
    let params: Vec<f32> = C::from_rest::<f64>(&rest, &material).as_ref().iter().map(|&p| p as f32).collect();
    [params[0], params[1], params[2], params[3]]
}

/// The compliance of each pair. Its modulus is the sum of those of the springs and the volumes: no
/// less than that of the tissue in any direction. So lips under a pressure overlap by no more than
/// a layer of tissue between them would be compressed.
fn compliances(parts: &BodyParts<'_>, pairs: &[LipPair]) -> Result<Stiffness<f32>, Error> {
    let (springs, volumes) = (&parts.constraints.distance, &parts.constraints.volume);
    let springs = springs.as_ref().map(|section| section.moduli(parts)).transpose()?;
    let volumes = volumes.as_ref().map(|section| section.moduli(parts)).transpose()?;
    let compliance = |pair: &LipPair| {
        let [low, high] = pair.edge.map(|vertex| parts.position(vertex));
        let modulus: f64 =
            [&springs, &volumes].into_iter().flatten().map(|moduli| moduli.of(pair.edge)).sum();
        let compliance = lip_contact_compliance(pair.area.into(), distance(&low, &high), modulus)?;
        Ok(compliance as f32)
    };
    let each: Result<Vec<f32>, _> = pairs.iter().map(compliance).collect();
    Ok(Stiffness::Compliance(Values::Each(each.map_err(Error::Material)?)))
}

/// Gives the virtual nodes of a body colors of their own for vertex block descent: a contact joins
/// nodes at one lattice point, which have one color.
pub(crate) fn separate(colors: &mut [u16], mesh: &TetMesh) {
    let count = colors.iter().max().map_or(0, |most| most + 1);
    let first = mesh.real_vertices();
    let mut number = 0;
    for node in first..colors.len() {
        // The nodes of a lattice point follow each other.
        let same = node > first && mesh.lattice_index[node] == mesh.lattice_index[node - 1];
        number = if same { number + 1 } else { 1 };
        colors[node] += count * number;
    }
}
