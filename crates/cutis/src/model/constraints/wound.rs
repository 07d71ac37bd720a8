//! The constraints, masses and loads along cuts that grow while the body moves.
//!
//! A body with such cuts has each kind of constraint twice: first on the elements that no cut
//! changes, then on those along the cuts. An increment of a cut replaces the second ones and leaves
//! the first alone.

use cutis_mesh::sever::Stage;
use cutis_solver::{Change, Formulation, Kind, SystemBuilder, Vertex, VertexForce, add_forces};
use nalgebra::{Point3, Vector3};

use super::elements::{Elements, WoundElements};
use super::kinds::BodyParts;
use crate::Error;
use crate::body::GrowingCuts;
use crate::model::ModelInput;

/// The state of cuts that grow.
pub(crate) struct GrowingWound {
    /// Builds constraints from the body at rest; none after an error.
    builder: Option<SystemBuilder<f32>>,
    /// The body at rest.
    rest: Vec<Vertex<f32>>,
    /// Inverse masses of all vertices at the present stage, 1/kg.
    inverse_masses: Vec<f32>,
    /// Number of the first kind along the cuts.
    first_kind: usize,
    /// For each of the nodes along the cuts: whether the scene holds or moves it.
    held: Vec<bool>,
    /// Loads on these nodes that the cuts do not change, N.
    loads: Vec<Vector3<f64>>,
    /// Forces in the scan on these nodes by the elements that no cut changes; none if the
    /// constraints hold the scan by themselves.
    forces: Option<Vec<VertexForce<f32>>>,
    /// How far each blade has come, m.
    reached: Vec<f64>,
    /// The node that each of these nodes follows, or itself.
    follows: Vec<u32>,
}

/// What one stage of the wound needs.
pub(crate) struct WoundParts {
    /// The kinds along the cuts.
    pub(crate) kinds: Vec<Kind<f32>>,
    /// Inverse mass of each node along the cuts, 1/kg.
    pub(crate) inverse_masses: Vec<f32>,
    /// Load on each of these nodes, N.
    pub(crate) loads: Vec<Vector3<f32>>,
    follows: Vec<u32>,
}

/// What a body with growing cuts is before the cuts are made.
pub(crate) struct WholeParts<'a> {
    /// Builds constraints from the body at rest.
    pub(crate) builder: SystemBuilder<f32>,
    pub(crate) rest: &'a [Vertex<f32>],
    /// The kinds on the elements that no cut changes.
    pub(crate) kinds: &'a [Kind<f32>],
    /// Loads that the cuts do not change, N, one per vertex.
    pub(crate) loads: &'a [Vector3<f64>],
    pub(crate) inverse_masses: &'a [f32],
    /// Per vertex: whether the scene holds or moves it.
    pub(crate) held: &'a dyn Fn(u32) -> bool,
}

impl GrowingWound {
    /// Prepares the wound, and returns its parts at the start of the run.
    ///
    /// # Errors
    /// [`Error`] for a value of the scene that does not work with this body.
    pub(crate) fn new(
        input: &ModelInput<'_>,
        cuts: &GrowingCuts,
        whole: WholeParts<'_>,
    ) -> Result<(Self, WoundParts), Error> {
        let nodes = cuts.growth.nodes();
        let holds_by_loads =
            input.scene.scan_is_at_rest && input.scene.solver.formulation == Formulation::Vbd;
        let forces = holds_by_loads.then(|| {
            let mut forces = vec![VertexForce::none(); nodes.len()];
            add_forces(whole.kinds, whole.rest, nodes, &mut forces).map(|()| forces)
        });
        let mut wound = Self {
            builder: Some(whole.builder),
            rest: whole.rest.to_vec(),
            inverse_masses: whole.inverse_masses.to_vec(),
            first_kind: whole.kinds.len(),
            held: nodes.iter().map(|&node| (whole.held)(node)).collect(),
            loads: nodes.iter().map(|&node| whole.loads[node as usize]).collect(),
            forces: forces.transpose()?,
            reached: cuts.reached(0.0),
            follows: nodes.to_vec(),
        };
        let parts = wound.parts(input, cuts)?;
        wound.follows.clone_from(&parts.follows);
        Ok((wound, parts))
    }

    /// The change of the body when the cuts come to where they are at a time in s. None if they
    /// have not moved.
    ///
    /// # Errors
    /// The errors of [`GrowingWound::new`].
    pub(crate) fn change(
        &mut self,
        input: &ModelInput<'_>,
        cuts: &GrowingCuts,
        time_s: f64,
    ) -> Result<Option<Change<f32>>, Error> {
        let reached = cuts.reached(time_s);
        if reached == self.reached {
            return Ok(None);
        }
        self.reached = reached;
        let parts = self.parts(input, cuts)?;
        let nodes = cuts.growth.nodes();
        // A node that comes free begins where the node that it followed is.
        let free = nodes.iter().zip(&self.follows).zip(&parts.follows);
        let states =
            free.filter(|((_, before), now)| before != now).map(|((&node, &before), _)| [node, before]);
        let change = Change {
            kinds: (self.first_kind..).zip(parts.kinds).collect(),
            states: states.collect(),
            inverse_masses: nodes.iter().copied().zip(parts.inverse_masses).collect(),
            loads: nodes.iter().copied().zip(parts.loads).collect(),
            ..Change::default()
        };
        self.follows = parts.follows;
        Ok(Some(change))
    }

    fn parts(&mut self, input: &ModelInput<'_>, cuts: &GrowingCuts) -> Result<WoundParts, Error> {
        let stage = cuts.growth.stage(&self.reached);
        let nodes = cuts.growth.nodes();
        let inverse_masses = self.inverse_masses_at(cuts, &stage);
        for (&node, &inverse_mass) in nodes.iter().zip(&inverse_masses) {
            self.inverse_masses[node as usize] = inverse_mass;
        }
        let ModelInput { file, scene, body } = *input;
        let elements = self.elements(input, cuts, &stage);
        let parts = BodyParts {
            file,
            solver: &scene.solver,
            until: scene.run.until,
            constraints: &scene.constraints,
            at_rest: scene.scan_is_at_rest,
            body,
            elements: Elements::Wound(&elements),
            inverse_masses: &self.inverse_masses,
            nothing_fixed: scene.fixed == Default::default(),
        };
        let mut loads = vec![Vector3::zeros(); body.mesh.positions.len()];
        let mut builder = match self.builder.take() {
            Some(builder) => builder,
            None => SystemBuilder::in_place(&body.mesh.positions, &self.inverse_masses)?,
        };
        for (row, kind) in scene.constraints.named() {
            let section = format!("constraints.{}", row.key);
            (builder, _) = kind.add(builder, &parts).map_err(file.blame(&section))?;
            if scene.scan_is_at_rest {
                kind.add_loads(&parts, &mut loads).map_err(file.blame(&section))?;
            }
        }
        let kinds = builder.take_kinds();
        self.builder = Some(builder);
        let held = match &self.forces {
            None => vec![Vector3::zeros(); nodes.len()],
            Some(whole) => {
                let mut forces = whole.clone();
                add_forces(&kinds, &self.rest, nodes, &mut forces)?;
                forces.iter().map(|force| force.force).collect()
            }
        };
        let of_node = nodes.iter().zip(&self.loads).zip(held);
        let loads = of_node
            .map(|((&node, load), held)| (load + loads[node as usize]).map(|newton| newton as f32) - held)
            .collect();
        let mut follows = nodes.to_vec();
        for &[node, of] in &stage.follows {
            follows[nodes.partition_point(|&other| other < node)] = of;
        }
        Ok(WoundParts { kinds, inverse_masses, loads, follows })
    }

    /// The elements along the cuts at a stage.
    fn elements(&self, input: &ModelInput<'_>, cuts: &GrowingCuts, stage: &Stage) -> WoundElements {
        let body = input.body;
        let triangles = body.severed.as_ref().map_or(&[][..], |severed| &severed.triangles);
        let joined = input.scene.constraints.joins_lips();
        let pairs = if joined { cuts.growth.lip_pairs(&self.reached) } else { Vec::new() };
        WoundElements::new(&body.mesh, triangles, stage, pairs)
    }

    fn inverse_masses_at(&self, cuts: &GrowingCuts, stage: &Stage) -> Vec<f32> {
        let masses = cuts.masses(stage).into_iter().zip(&self.held);
        masses.map(|(mass, held)| if *held || mass <= 0.0 { 0.0 } else { 1.0 / mass as f32 }).collect()
    }

    /// Holds vertices from now on, so that increments of the cuts give them no mass.
    pub(crate) fn hold(&mut self, cuts: &GrowingCuts, vertices: &[u32]) {
        for vertex in vertices {
            if let Ok(place) = cuts.growth.nodes().binary_search(vertex) {
                self.held[place] = true;
            }
        }
    }

    /// The vertex at whose place a vertex is.
    pub(crate) fn leader(&self, cuts: &GrowingCuts, vertex: u32) -> u32 {
        cuts.growth.nodes().binary_search(&vertex).map_or(vertex, |place| self.follows[place])
    }

    /// Number of vertices that follow others.
    pub(crate) fn followers(&self, cuts: &GrowingCuts) -> usize {
        cuts.growth.nodes().iter().zip(&self.follows).filter(|(node, of)| node != of).count()
    }

    /// Gives the vertices that follow others the values of those.
    pub(crate) fn complete<V: Copy>(&self, cuts: &GrowingCuts, values: &mut [V]) {
        for (&node, &of) in cuts.growth.nodes().iter().zip(&self.follows) {
            values[node as usize] = values[of as usize];
        }
    }
}

/// The vertices of a body at rest with their inverse masses.
pub(super) fn at_rest(positions: &[Point3<f32>], inverse_masses: &[f32]) -> Vec<Vertex<f32>> {
    positions.iter().zip(inverse_masses).map(|(&position, &w)| Vertex::new(position, w)).collect()
}
