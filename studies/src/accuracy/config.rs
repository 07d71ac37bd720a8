//! A configuration: backend, method, substeps and iterations.

use cutis_gpu::{AdapterKind, Gpu, GpuOptions, Select};
use cutis_solver::{Formulation, Settings, SolverReference, System};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;

use anyhow::Context;

use super::Failure;
use super::problems::Problem;
use super::running::Running;

/// Name of the backend on a hardware GPU.
pub const GPU: &str = "gpu f32";
/// Name of the backend on a software adapter, which computes on the CPU.
pub const SOFTWARE_GPU: &str = "gpu f32 (software)";

/// Where a configuration runs.
#[derive(Clone)]
pub enum Backend {
    /// All threads, `f32`: the default of a scene.
    Cpu,
    /// All threads, `f64`.
    CpuDouble,
    /// One thread, `f64`, the scalar reference.
    Reference,
    /// The first adapter.
    Gpu(Gpu),
}

impl Backend {
    /// Name in tables.
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
    /// The solver refuses the system or the settings.
    pub fn start(&self, system: &System<f32>, settings: Settings) -> Result<Running, Failure> {
        Ok(match self {
            Self::Cpu => Running::Single(Box::new(SolverCpu::new(system.clone(), settings, None)?)),
            Self::CpuDouble => Running::Double(Box::new(SolverCpu::new(system.to_f64(), settings, None)?)),
            Self::Reference => Running::Double(Box::new(SolverReference::new(system.to_f64(), settings)?)),
            Self::Gpu(gpu) => Running::Single(Box::new(SolverGpu::new(gpu, system.clone(), settings)?)),
        })
    }
}

/// True if the adapter is a driver that computes on the CPU.
pub fn is_software(gpu: &Gpu) -> bool {
    gpu.adapter().kind == AdapterKind::Software
}

/// The first adapter, if there is one.
///
/// # Errors
/// The adapter cannot be opened.
pub fn first_gpu() -> Result<Option<Gpu>, Failure> {
    if cutis_gpu::adapters().is_empty() {
        return Ok(None);
    }
    let options =
        GpuOptions { select: Select::First, baseline_limits: false, chunk_cap: None, timestamps: false };
    Ok(Some(Gpu::open(&options)?))
}

/// Method that solves a substep.
#[derive(Clone, Copy)]
pub struct Method {
    /// `xpbd`, `vbd` or `pbd`.
    pub formulation: &'static str,
    /// Over-relaxation, or empty.
    pub variant: &'static str,
    /// Sets the method.
    pub apply: fn(&mut Settings),
    /// Cost of an iteration relative to XPBD; the number of iterations is divided by it.
    pub weight: u32,
}

/// XPBD, the default.
pub const XPBD: Method = Method {
    formulation: "xpbd",
    variant: "",
    apply: |settings| settings.formulation = Formulation::Xpbd,
    weight: 1,
};

/// Vertex block descent.
pub const VBD: Method = Method {
    formulation: "vbd",
    variant: "",
    apply: |settings| settings.formulation = Formulation::Vbd,
    weight: 4,
};

/// PBD, which has no material.
pub const PBD: Method = Method {
    formulation: "pbd",
    variant: "",
    apply: |settings| settings.formulation = Formulation::Pbd,
    weight: 1,
};

/// The methods with a material.
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
    /// Backend.
    pub backend: Backend,
    /// Method.
    pub method: Method,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// True if it runs until the body is at rest; otherwise it ends at the frame of E2.
    pub settles: bool,
}

impl Config {
    /// `settings` with the method, substeps and iterations of the configuration.
    pub fn settings(&self, settings: &Settings) -> Settings {
        let (substeps, iterations) = (self.substeps, self.iterations);
        let mut chosen = Settings { substeps, iterations, ..*settings };
        (self.method.apply)(&mut chosen);
        chosen
    }

    /// True for a method with a material, so not for PBD.
    pub fn has_material(&self) -> bool {
        self.method.formulation != PBD.formulation
    }

    /// The system of `problem` for this method.
    ///
    /// # Errors
    /// The problem has no PBD stiffness.
    pub fn system<'a>(&self, problem: &'a Problem) -> Result<&'a System<f32>, Failure> {
        match (self.has_material(), &problem.vbd) {
            (true, Some(vbd)) if self.method.formulation == VBD.formulation => Ok(vbd),
            (true, _) => Ok(&problem.xpbd),
            (false, _) => Ok(problem.pbd.as_ref().context("this problem has no PBD stiffness")?),
        }
    }
}
