//! The configurations: which backend, which method, how many substeps and iterations.

use cutis_gpu::{AdapterKind, Gpu, GpuOptions, Select};
use cutis_solver::{Formulation, Settings, SolverReference, System};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;

use super::Failure;
use super::cases::Case;
use super::running::Running;

/// Name of a GPU as a backend.
pub const GPU: &str = "gpu f32";
/// Name of one that computes on the CPU.
pub const SOFTWARE_GPU: &str = "gpu f32 (software)";

/// Where a configuration runs.
#[derive(Clone)]
pub enum Backend {
    /// All threads, `f32`: what a run uses.
    Cpu,
    /// All threads, `f64`.
    CpuDouble,
    /// One constraint after the other, `f64`.
    Reference,
    /// The first adapter.
    Gpu(Gpu),
}

impl Backend {
    /// As in the table.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Cpu => "cpu f32",
            Self::CpuDouble => "cpu f64",
            Self::Reference => "reference f64",
            Self::Gpu(gpu) if is_software(gpu) => SOFTWARE_GPU,
            Self::Gpu(_) => GPU,
        }
    }

    /// A solver for a body.
    ///
    /// # Errors
    /// What the solver refuses.
    pub fn start(&self, system: &System<f32>, settings: Settings) -> Result<Running, Failure> {
        Ok(match self {
            Self::Cpu => Running::Single(Box::new(SolverCpu::new(system.clone(), settings, None)?)),
            Self::CpuDouble => Running::Double(Box::new(SolverCpu::new(system.to_f64(), settings, None)?)),
            Self::Reference => Running::Double(Box::new(SolverReference::new(system.to_f64(), settings)?)),
            Self::Gpu(gpu) => Running::Single(Box::new(SolverGpu::new(gpu, system.clone(), settings)?)),
        })
    }
}

/// Whether the adapter is a driver that computes on the CPU.
pub fn is_software(gpu: &Gpu) -> bool {
    gpu.adapter().kind == AdapterKind::Software
}

/// The first adapter, if there is one.
///
/// # Errors
/// An adapter that cannot be opened.
pub fn first_gpu() -> Result<Option<Gpu>, Failure> {
    if cutis_gpu::adapters().is_empty() {
        return Ok(None);
    }
    let options =
        GpuOptions { select: Select::First, baseline_limits: false, chunk_cap: None, timestamps: false };
    Ok(Some(Gpu::open(&options)?))
}

/// How a substep is solved.
#[derive(Clone, Copy)]
pub struct Method {
    /// `xpbd` and so on.
    pub formulation: &'static str,
    /// What else is chosen; empty for nothing.
    pub variant: &'static str,
    /// Chooses it.
    pub apply: fn(&mut Settings),
    /// So many times fewer iterations are tried, because one takes longer and brings more.
    pub weight: u32,
}

/// What the others have to beat.
pub const XPBD: Method = Method {
    formulation: "xpbd",
    variant: "",
    apply: |settings| settings.formulation = Formulation::Xpbd,
    weight: 1,
};

/// Vertex by vertex, with true convergence.
pub const VBD: Method = Method {
    formulation: "vbd",
    variant: "",
    apply: |settings| settings.formulation = Formulation::Vbd,
    weight: 4,
};

/// Without a material.
pub const PBD: Method = Method {
    formulation: "pbd",
    variant: "",
    apply: |settings| settings.formulation = Formulation::Pbd,
    weight: 1,
};

/// The methods that solve for the material's answer.
pub const METHODS: &[Method] = &[
    XPBD,
    VBD,
    Method {
        formulation: "vbd",
        variant: "ω 1.4",
        apply: |settings| {
            settings.formulation = Formulation::Vbd;
            settings.relaxation = 1.4;
        },
        weight: 4,
    },
];

/// One configuration.
#[derive(Clone)]
pub struct Config {
    /// Where it runs.
    pub backend: Backend,
    /// How it solves a substep.
    pub method: Method,
    /// Of one frame.
    pub substeps: u32,
    /// Of one substep.
    pub iterations: u32,
    /// Whether it is run until the body has settled; else as far as the trajectory is compared.
    pub settles: bool,
}

impl Config {
    /// `settings` with what the configuration chooses.
    pub fn settings(&self, settings: &Settings) -> Settings {
        let (substeps, iterations) = (self.substeps, self.iterations);
        let mut chosen = Settings { substeps, iterations, ..*settings };
        (self.method.apply)(&mut chosen);
        chosen
    }

    /// Whether it solves for the material's answer; PBD does not.
    pub fn has_material(&self) -> bool {
        self.method.formulation != PBD.formulation
    }

    /// The body of `case` that it solves.
    ///
    /// # Errors
    /// A case without PBD.
    pub fn system<'a>(&self, case: &'a Case) -> Result<&'a System<f32>, Failure> {
        match self.has_material() {
            true => Ok(&case.xpbd),
            false => Ok(case.pbd.as_ref().ok_or("this problem has no PBD stiffness")?),
        }
    }
}
