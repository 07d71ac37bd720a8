//! Changes of a body between two frames: what a cut that grows and a hook make of it.

use std::collections::HashSet;

use cutis_coloring::{Incidence, Tuples};
use cutis_constraints::Scalar;
use nalgebra::Vector3;

use crate::descent::{Descent, check_compliances, groups_error};
use crate::{Handle, Kind, KinematicHandle, SolverError, System, Vertex};

/// New kinds, masses, loads and states for some parts of a body. All other parts stay as they are.
pub struct Change<T: Scalar> {
    /// Kinds to replace: number and new constraints, which may be more or fewer.
    pub kinds: Vec<(usize, Kind<T>)>,
    /// Vertices and their new inverse masses in 1/kg; 0 for a vertex that no longer moves.
    pub inverse_masses: Vec<(u32, T)>,
    /// Vertices and their new loads in N.
    pub loads: Vec<(u32, Vector3<T>)>,
    /// Pairs of vertices: the first takes the position and the velocity of the second. The pairs
    /// act one after the other, before the masses change.
    pub states: Vec<[u32; 2]>,
    /// Handles that grab their vertices where these are after the changes of state. They come after
    /// the handles that the body has.
    pub handles: Vec<Handle>,
}

impl<T: Scalar> Default for Change<T> {
    fn default() -> Self {
        Self {
            kinds: Vec::new(),
            inverse_masses: Vec::new(),
            loads: Vec::new(),
            states: Vec::new(),
            handles: Vec::new(),
        }
    }
}

impl<T: Scalar> System<T> {
    /// Adds kinds after the others.
    ///
    /// # Errors
    /// Returns [`SolverError::VertexLength`] for a kind that was built for another number of
    /// vertices.
    pub fn add_kinds(&mut self, kinds: Vec<Kind<T>>) -> Result<(), SolverError> {
        kinds.iter().try_for_each(|kind| self.check_kind(kind))?;
        self.kinds.extend(kinds);
        Ok(())
    }

    /// Changes parts of the body.
    ///
    /// # Errors
    /// Returns an error for a kind, a vertex or a value that does not exist or is out of range. The
    /// body is then unchanged.
    pub fn change(&mut self, change: &Change<T>) -> Result<(), SolverError> {
        self.check_change(change)?;
        for (number, kind) in &change.kinds {
            self.kinds[*number] = kind.clone();
        }
        for &[to, from] in &change.states {
            let [to, from] = [to, from].map(|vertex| vertex as usize);
            let position = self.vertices[from].position();
            self.vertices[to].set_position(position);
            self.previous[to] = self.previous[from];
            self.velocities[to] = self.velocities[from];
        }
        for &(vertex, inverse_mass) in &change.inverse_masses {
            let vertex = &mut self.vertices[vertex as usize];
            *vertex = Vertex::new(vertex.position(), inverse_mass);
        }
        for handle in &change.handles {
            self.handles.push(KinematicHandle::grab(handle.clone(), &mut self.vertices));
        }
        if self.loads.is_empty() && change.loads.iter().any(|(_, load)| *load != Vector3::zeros()) {
            self.loads = vec![Vector3::zeros(); self.vertices.len()];
        }
        for &(vertex, load) in &change.loads {
            if let Some(old) = self.loads.get_mut(vertex as usize) {
                *old = load;
            }
        }
        Ok(())
    }

    fn check_kind(&self, kind: &Kind<T>) -> Result<(), SolverError> {
        let (found, expected) = (kind.vertex_count(), self.vertices.len());
        let error = SolverError::VertexLength { what: "vertices of a new kind", found, expected };
        if found == expected { Ok(()) } else { Err(error) }
    }

    fn check_change(&self, change: &Change<T>) -> Result<(), SolverError> {
        for (number, kind) in &change.kinds {
            self.check_kind(kind)?;
            let fits = self.kinds.get(*number).is_some_and(|old| {
                (old.name(), old.arity(), old.param_count())
                    == (kind.name(), kind.arity(), kind.param_count())
                    && old.stiffness().formulation() == kind.stiffness().formulation()
            });
            if !fits {
                let expected = "the number of a kind with the same name and formulation";
                return Err(SolverError::Setting {
                    key: "number of a new kind",
                    value: *number as f64,
                    expected,
                });
            }
        }
        self.check_vertices(change.states.as_flattened())?;
        let mut kinematic: HashSet<u32> =
            self.handles.iter().flat_map(|handle| handle.vertices()).copied().collect();
        let refuse =
            |vertex, what, value, expected| Err(SolverError::Vertex { vertex, what, value, expected });
        for &(vertex, inverse_mass) in &change.inverse_masses {
            self.check_vertices(&[vertex])?;
            let value = inverse_mass.to_f64();
            let held = kinematic.contains(&vertex);
            if !(value.is_finite() && value >= 0.0) {
                return refuse(vertex as usize, "inverse mass", value, "a finite number, 0 or more");
            }
            if held && value != 0.0 {
                return refuse(vertex as usize, "inverse mass", value, "0, because a handle moves it");
            }
        }
        for (index, handle) in (self.handles.len()..).zip(&change.handles) {
            KinematicHandle::<T>::check(index, handle, self.vertices.len(), &mut kinematic)?;
        }
        for (vertex, load) in &change.loads {
            self.check_vertices(&[*vertex])?;
            if let Some(value) = load.iter().map(|value| value.to_f64()).find(|value| !value.is_finite()) {
                return refuse(*vertex as usize, "load", value, "a finite number");
            }
        }
        Ok(())
    }
}

impl<T: Scalar> Descent<T> {
    /// Prepares vertex block descent again after a change. `moved` tells which vertices moved
    /// before it.
    ///
    /// The groups were checked for all kinds and the vertices that moved. What remains to be
    /// checked are the new kinds, and the constraints at vertices that move only now.
    pub(crate) fn change(
        &mut self,
        system: &System<T>,
        change: &Change<T>,
        moved: &[bool],
    ) -> Result<(), SolverError> {
        let count = system.vertices().len();
        let moves: Vec<bool> = system.vertices().iter().map(|v| v.inverse_mass() > T::zero()).collect();
        let is_new = |n: &usize| change.kinds.iter().any(|(number, _)| number == n);
        let mut incidences = Vec::with_capacity(change.kinds.len());
        for (number, kind) in &change.kinds {
            check_compliances(kind)?;
            let tuples = Tuples { vertices: kind.indices(), arity: kind.arity() };
            incidences.push((*number, Incidence::new(tuples, count).map_err(groups_error)?));
        }
        for (number, incidence) in incidences {
            self.set_incidence(number, incidence);
        }
        let Some(groups) = &system.vertex_groups else {
            return self.color_again(system);
        };
        let groups = groups.restricted_to(&moves);
        let begin: Vec<u32> = change
            .inverse_masses
            .iter()
            .map(|(v, _)| *v)
            .filter(|&v| moves[v as usize] && !moved[v as usize])
            .collect();
        let mut around: Vec<(usize, Vec<u32>)> = Vec::new();
        for (number, kind) in system.kinds().iter().enumerate() {
            let arity = kind.arity();
            let tuple = |place: u32| {
                let first = place as usize / arity * arity;
                &kind.indices()[first..first + arity]
            };
            let vertices = match is_new(&number) {
                true => kind.indices().to_vec(),
                false => {
                    let places = begin.iter().flat_map(|&v| self.incidences()[number].of(v));
                    places.flat_map(|&place| tuple(place)).copied().collect()
                }
            };
            around.push((arity, vertices));
        }
        let tuples: Vec<Tuples<'_>> =
            around.iter().map(|(arity, vertices)| Tuples { vertices, arity: *arity }).collect();
        groups.verify_vertices(&tuples, &moves).map_err(groups_error)?;
        self.set_groups(groups);
        Ok(())
    }
}
