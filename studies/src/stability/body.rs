//! Bodies in their own units: material, initial state, and the system at a scale.
//!
//! At scale `s`, lengths are multiplied by `s`, and masses and times do not change. Energies are
//! then multiplied by `s²`. A compliance `C²/U` does not change for a length. It is multiplied by
//! `s²` for an area and by `s⁴` for a volume. The result is the same problem in another unit of
//! length.

use std::collections::BTreeMap;

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Constraint, Distance, Scalar, SkinTension, SkinTensionMaterial, Volume};
use cutis_solver::{Formulation, Handle, Stiffness, System, SystemBuilder, Values};
use nalgebra::{Point3, Vector3};

use super::Failure;
use super::membrane::Membrane;
use crate::sheet::Sheet;
use cutis_test_kit::Kuhn;

/// Compliances in the units of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compliances {
    /// Compliance of springs.
    pub distance: f64,
    /// Compliance of skin triangles.
    pub skin: f64,
    /// Compliance of tetrahedra.
    pub volume: f64,
}

impl Compliances {
    /// A soft solid with a volume about five times as stiff as its shape.
    pub const SOFT: Self = Self { distance: 7e-4, skin: 2e-4, volume: 3e-6 };

    /// The soft solid, a thousand times as stiff.
    pub const STIFF: Self = Self { distance: 7e-7, skin: 2e-7, volume: 3e-9 };

    /// The same compliance for all kinds.
    pub const fn uniform(compliance: f64) -> Self {
        Self { distance: compliance, skin: compliance, volume: compliance }
    }
}

/// Stiffness of a body by formulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// PBD with the share of an error that a projection removes.
    Pbd(f64),
    /// XPBD.
    Xpbd(Compliances),
    /// Vertex block descent.
    Vbd(Compliances),
}

impl Law {
    /// The soft solid by XPBD.
    pub const SOFT: Self = Self::Xpbd(Compliances::SOFT);
    /// A rigid solid: all compliances are 0.
    pub const RIGID: Self = Self::Xpbd(Compliances::uniform(0.0));
    /// PBD in which every projection removes its whole error.
    pub const PBD: Self = Self::Pbd(1.0);
    /// The soft solid by vertex block descent.
    pub const DESCENT: Self = Self::Vbd(Compliances::SOFT);
    /// The stiff solid by vertex block descent.
    pub const STIFF_DESCENT: Self = Self::Vbd(Compliances::STIFF);

    /// The stiffnesses of most cases.
    pub const ALL: [Self; 5] = [Self::SOFT, Self::RIGID, Self::PBD, Self::DESCENT, Self::STIFF_DESCENT];

    /// True if a substep of 1/240 s resolves the stiffness.
    pub fn is_resolved(self) -> bool {
        match self {
            Self::Pbd(_) => false,
            Self::Xpbd(compliances) | Self::Vbd(compliances) => {
                compliances == Compliances::SOFT || compliances.distance >= 1e-3
            }
        }
    }

    /// True if the energy is that of the compliances for any substep, because the step is implicit.
    pub fn is_implicit(self) -> bool {
        matches!(self, Self::Vbd(_))
    }

    /// The formulation.
    pub fn formulation(self) -> Formulation {
        match self {
            Self::Pbd(_) => Formulation::Pbd,
            Self::Xpbd(_) => Formulation::Xpbd,
            Self::Vbd(_) => Formulation::Vbd,
        }
    }

    /// Name in the names of cases.
    pub fn name(self) -> String {
        match self {
            Self::SOFT => "XPBD".into(),
            Self::DESCENT => "VBD".into(),
            Self::Pbd(1.0) => "PBD".into(),
            Self::Pbd(share) => format!("PBD, stiffness {share}"),
            Self::Xpbd(Compliances { distance, .. }) => format!("XPBD, compliance {distance:e}"),
            Self::Vbd(Compliances { distance, .. }) => format!("VBD, compliance {distance:e}"),
        }
    }
}

/// A body, its initial state and its material. Lengths are in units of about one element.
#[derive(Clone, Debug)]
pub struct Body {
    /// Positions at rest.
    pub rest: Vec<Point3<f64>>,
    /// Positions at the start.
    pub start: Vec<Point3<f64>>,
    /// Velocities at the start, per s.
    pub velocities: Vec<Vector3<f64>>,
    /// In 1/kg; 0 for a fixed vertex.
    pub inverse_masses: Vec<f64>,
    /// Springs, two vertices each.
    pub edges: Vec<[u32; 2]>,
    /// Skin triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Tetrahedra.
    pub tets: Vec<[u32; 4]>,
    /// Stiffness of the constraints.
    pub law: Law,
    /// Stiffness of the material at each vertex over that of `law`, above 0 and at most 1. An
    /// element has the harmonic mean of its vertices.
    pub softening: Vec<f64>,
    /// Amplification of skin tension.
    pub amplification: f64,
    /// Skin strips on the triangles, in place of skin tension.
    pub membrane: Option<Membrane>,
    /// Handles that move vertices.
    pub handles: Vec<Handle>,
    /// Offset of the body from the origin.
    pub offset: Vector3<f64>,
    /// True if every rest size is set to zero.
    pub without_rest_size: bool,
}

impl Body {
    /// A block of `size` vertices along each axis, with springs, volumes and skin, at rest.
    pub fn block(size: [usize; 3], law: Law) -> Self {
        let lattice = Kuhn::new(size, 1.0);
        let triangles = surface(&lattice.tets);
        Self::new(lattice.positions, lattice.edges, triangles, lattice.tets, law)
    }

    /// One tetrahedron with its six edges and four faces.
    pub fn tetrahedron(law: Law) -> Self {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let tets = vec![[0, 1, 2, 3]];
        let edges = vec![[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
        let triangles = surface(&tets);
        Self::new(positions.map(Point3::from).to_vec(), edges, triangles, tets, law)
    }

    /// A plane sheet of springs and skin.
    pub fn sheet(columns: i64, law: Law) -> Self {
        let sheet = Sheet::new(columns);
        Self::new(sheet.positions, sheet.springs, sheet.triangles, Vec::new(), law)
    }

    /// A body at rest, without a membrane.
    pub(super) fn new(
        rest: Vec<Point3<f64>>,
        edges: Vec<[u32; 2]>,
        triangles: Vec<[u32; 3]>,
        tets: Vec<[u32; 4]>,
        law: Law,
    ) -> Self {
        let count = rest.len();
        Self {
            start: rest.clone(),
            velocities: vec![Vector3::zeros(); count],
            inverse_masses: vec![1.0; count],
            softening: vec![1.0; count],
            rest,
            edges,
            triangles,
            tets,
            law,
            amplification: 2.0,
            membrane: None,
            handles: Vec::new(),
            offset: Vector3::zeros(),
            without_rest_size: false,
        }
    }

    /// Sets the start positions: `place` of each rest position.
    pub fn placed(mut self, mut place: impl FnMut(Point3<f64>) -> Point3<f64>) -> Self {
        self.start = self.rest.iter().map(|&x| place(x)).collect();
        self
    }

    /// Makes the lower half of the body `contrast` times as soft as the upper half.
    pub fn layered(mut self, contrast: f64) -> Self {
        let height = |points: &[Point3<f64>]| points.iter().map(|x| x.z).sum::<f64>() / points.len() as f64;
        let middle = height(&self.rest);
        let of = |x: &Point3<f64>| if x.z < middle { 1.0 / contrast } else { 1.0 };
        self.softening = self.rest.iter().map(of).collect();
        self
    }

    /// The system at a scale.
    ///
    /// # Errors
    /// The builder refuses the system.
    pub fn system<T: Scalar>(&self, scale: f64) -> Result<System<T>, Failure> {
        if let Some(membrane) = &self.membrane {
            return self.membrane_system(membrane, scale);
        }
        let count = self.rest.len();
        let mut builder = self.builder::<T>(&self.start, scale)?;
        let size = if self.without_rest_size { 0.0 } else { 1.0 };
        if !self.edges.is_empty() {
            let params = |rest: &[_; 2]| Distance::from_rest(rest, &Default::default());
            let params =
                self.params(&self.edges, scale, |rest| params(rest).map(|p: f64| T::constant(p * size)));
            let (stiffness, groups) = (self.stiffness(&self.edges, 0, scale), groups(&self.edges, count)?);
            builder = builder.add::<Distance, 2>(&self.edges, &params, stiffness, &groups)?;
        }
        if !self.tets.is_empty() {
            let params = |rest: &[_; 4]| Volume::from_rest(rest, &Default::default());
            let params =
                self.params(&self.tets, scale, |rest| params(rest).map(|p: f64| T::constant(p * size)));
            let (stiffness, groups) = (self.stiffness(&self.tets, 4, scale), groups(&self.tets, count)?);
            builder = builder.add::<Volume, 4>(&self.tets, &params, stiffness, &groups)?;
        }
        if !self.triangles.is_empty() {
            let material = SkinTensionMaterial { amplification: self.amplification, ..Default::default() };
            let params = |rest: &[_; 3]| {
                let [area, amplification] = SkinTension::from_rest::<f64>(rest, &material);
                [T::constant(area * size), T::constant(amplification)]
            };
            let params = self.params(&self.triangles, scale, params);
            let (stiffness, groups) =
                (self.stiffness(&self.triangles, 2, scale), groups(&self.triangles, count)?);
            builder = builder.add::<SkinTension, 3>(&self.triangles, &params, stiffness, &groups)?;
        }
        Ok(self.with_handles(builder, scale)?.build())
    }

    /// The vertices at a scale, at `positions` in the units of the body.
    pub(super) fn builder<T: Scalar>(
        &self,
        positions: &[Point3<f64>],
        scale: f64,
    ) -> Result<SystemBuilder<T>, Failure> {
        let positions: Vec<Point3<f64>> = positions.iter().map(|x| (x + self.offset) * scale).collect();
        let velocities: Vec<_> = self.velocities.iter().map(|v| v.map(|v| T::constant(v * scale))).collect();
        Ok(SystemBuilder::<T>::new(&positions, &self.inverse_masses)?.velocities(&velocities)?)
    }

    /// Adds the handles at a scale.
    pub(super) fn with_handles<T: Scalar>(
        &self,
        mut builder: SystemBuilder<T>,
        scale: f64,
    ) -> Result<SystemBuilder<T>, Failure> {
        for handle in &self.handles {
            let move_m = handle.move_m.map(|d| d * scale);
            builder = builder.handle(Handle { move_m, ..handle.clone() })?;
        }
        Ok(builder)
    }

    fn params<P, const N: usize>(
        &self,
        elements: &[[u32; N]],
        scale: f64,
        params: impl Fn(&[Point3<f64>; N]) -> P,
    ) -> Vec<P> {
        elements.iter().map(|element| params(&element.map(|v| self.rest[v as usize] * scale))).collect()
    }

    /// Stiffness of a kind whose compliance grows by this power of the scale.
    pub(super) fn stiffness<T: Scalar, const N: usize>(
        &self,
        elements: &[[u32; N]],
        power: i32,
        scale: f64,
    ) -> Stiffness<T> {
        match self.law {
            Law::Pbd(share) => Stiffness::Pbd(self.values(elements, |softening| share * softening)),
            Law::Xpbd(Compliances { distance, skin, volume })
            | Law::Vbd(Compliances { distance, skin, volume }) => {
                let compliance = [distance, skin, volume][power as usize / 2] * scale.powi(power);
                Stiffness::Compliance(self.values(elements, |softening| compliance / softening))
            }
        }
    }

    /// A value for each element from its softening, or one for all if all materials are the same.
    fn values<T: Scalar, const N: usize>(
        &self,
        elements: &[[u32; N]],
        value: impl Fn(f64) -> f64,
    ) -> Values<T> {
        if self.softening.iter().all(|softening| *softening == 1.0) {
            return Values::Uniform(T::constant(value(1.0)));
        }
        let softening = |element: &[u32; N]| {
            N as f64 / element.iter().map(|&v| 1.0 / self.softening[v as usize]).sum::<f64>()
        };
        Values::Each(elements.iter().map(|element| T::constant(value(softening(element)))).collect())
    }
}

fn groups<const N: usize>(elements: &[[u32; N]], vertices: usize) -> Result<Groups, Failure> {
    Ok(greedy(elements, vertices)?)
}

/// The faces that belong to one tetrahedron only.
fn surface(tets: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let mut faces = BTreeMap::new();
    for &[a, b, c, d] in tets {
        for face in [[b, c, d], [a, d, c], [a, b, d], [a, c, b]] {
            let mut key = face;
            key.sort_unstable();
            faces.entry(key).or_insert_with(Vec::new).push(face);
        }
    }
    faces.into_values().filter(|sides| sides.len() == 1).flatten().collect()
}
