//! What the programs compute: the beam, the method, and the moduli of its material.

use cutis_solver::{Formulation, Settings};

/// Length of an edge of a cube, m.
pub const SPACING_M: f64 = 0.1;
/// Density, kg/m³.
pub const DENSITY_KG_M3: f64 = 1000.0;
/// Time of a frame, s.
pub const DT_S: f64 = 0.005;

/// The order of vertices and constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Rows of the lattice, with groups in closed form.
    Lattice,
    /// No order at all, with groups by greedy coloring.
    Shuffled,
}

impl Order {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lattice => "lattice",
            Self::Shuffled => "shuffled",
        }
    }
}

/// The constraints of the beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kinds {
    /// Edges, then tetrahedra.
    Both,
    /// Only edges.
    Edges,
    /// Only tetrahedra.
    Tets,
}

impl Kinds {
    /// Name as an option of the scripts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Both => "both",
            Self::Edges => "edges",
            Self::Tets => "tets",
        }
    }
}

/// The beam and its method, the same for every program.
#[derive(Clone, Copy, Debug)]
pub struct Job {
    /// Vertices along x, y and z.
    pub size: [usize; 3],
    /// The constraints.
    pub kinds: Kinds,
    /// Position-based dynamics, or vertex block descent.
    pub formulation: Formulation,
    /// Iterations of a frame, which is one substep.
    pub iterations: u32,
    /// Gravity downwards, m/s².
    pub gravity_m_s2: f64,
    /// Stiffness of position-based dynamics.
    pub stiffness: f64,
    /// Young's modulus of the springs of vertex block descent, Pa.
    pub youngs_pa: f64,
    /// Bulk modulus of its tetrahedra, Pa.
    pub bulk_pa: f64,
    /// Frames of a turn.
    pub frames: usize,
}

impl Job {
    /// Position-based dynamics.
    pub fn pbd(size: [usize; 3], frames: usize) -> Self {
        Self {
            size,
            kinds: Kinds::Both,
            formulation: Formulation::Pbd,
            iterations: 5,
            gravity_m_s2: 9.81,
            stiffness: 1.0,
            youngs_pa: 1e6,
            bulk_pa: 1e6,
            frames,
        }
    }

    /// Vertex block descent, with the number of iterations that Newton has by default. Gravity is
    /// weak, so that a material that ten iterations can solve bends by a third of its length.
    pub fn descent(size: [usize; 3], frames: usize) -> Self {
        let formulation = Formulation::Vbd;
        Self { formulation, iterations: 10, gravity_m_s2: 2.0, ..Self::pbd(size, frames) }
    }

    /// The settings of Cutis.
    pub fn settings(&self) -> Settings {
        Settings {
            formulation: self.formulation,
            dt_s: DT_S,
            substeps: 1,
            iterations: self.iterations,
            gravity_m_s2: [0.0, -self.gravity_m_s2, 0.0],
            ..Settings::default()
        }
    }

    /// The options of the scripts.
    pub fn arguments(&self) -> Vec<String> {
        let mut words = vec!["--size".to_owned()];
        words.extend(self.size.map(|n| n.to_string()));
        let options = [
            ("--spacing", SPACING_M.to_string()),
            ("--density", DENSITY_KG_M3.to_string()),
            ("--dt", DT_S.to_string()),
            ("--kinds", self.kinds.name().into()),
            ("--iterations", self.iterations.to_string()),
            ("--gravity", self.gravity_m_s2.to_string()),
            ("--stiffness", self.stiffness.to_string()),
            ("--youngs", self.youngs_pa.to_string()),
            ("--bulk", self.bulk_pa.to_string()),
            ("--frames", self.frames.to_string()),
        ];
        words.extend(options.into_iter().flat_map(|(name, value)| [name.to_owned(), value]));
        words
    }
}
