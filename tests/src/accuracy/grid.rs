//! Which configurations a problem is run with.

use cutis_gpu::Gpu;

use super::cases::Case;
use super::config::{Backend, Config, METHODS, Method, PBD, XPBD, is_software};

/// Substeps of a frame.
const SUBSTEPS: [u32; 8] = [1, 2, 5, 10, 20, 40, 80, 160];
/// The same for `--quick`.
const FEW_SUBSTEPS: [u32; 4] = [1, 5, 10, 40];
/// Most sweeps of a frame that are run until the body has settled.
pub const SETTLED_SWEEPS: u32 = 160;
/// Numbers of substeps whose iterations are raised further, for E1 and E2 only: where does iterating alone lead?
const RAISED: [u32; 2] = [1, 10];

/// Which pairs of substeps and iterations there are.
struct Limits {
    substeps: &'static [u32],
    /// Most sweeps of a frame.
    sweeps: u32,
    /// Most iterations with one of [`RAISED`].
    raised: u32,
}

const FULL: Limits = Limits { substeps: &SUBSTEPS, sweeps: SETTLED_SWEEPS, raised: 1024 };
const QUICK: Limits = Limits { substeps: &FEW_SUBSTEPS, sweeps: 80, raised: 64 };

/// All configurations of `case`.
pub fn configs(case: &Case, quick: bool, gpu: Option<&Gpu>) -> Vec<Config> {
    let limits = if quick { QUICK } else { FULL };
    let few = Limits { sweeps: limits.sweeps / 4, raised: 1, ..limits };
    let with = |backend: Backend, method: Method| {
        move |[substeps, iterations]: [u32; 2]| Config {
            backend: backend.clone(),
            method,
            substeps,
            iterations,
        }
    };
    let mut configs = Vec::new();
    for &method in METHODS {
        configs.extend(pairs(&limits).into_iter().map(with(Backend::Cpu, method)));
    }
    let cross = |limits: &Limits| pairs(limits).into_iter().filter(|[s, n]| *n == 1 || RAISED.contains(s));
    configs.extend(cross(&limits).map(with(Backend::CpuDouble, XPBD)));
    configs.extend(cross(&few).map(with(Backend::Reference, XPBD)));
    if let Some(gpu) = gpu {
        let on_gpu = with(Backend::Gpu(gpu.clone()), XPBD);
        let chosen = if is_software(gpu) { cross(&few).collect() } else { pairs(&limits) };
        configs.extend(chosen.into_iter().map(on_gpu));
    }
    if case.pbd.is_some() {
        let chosen = [1, 5, 20].into_iter().flat_map(|s| [1, 5, 20].map(|n| [s, n]));
        configs.extend(chosen.filter(|[s, n]| s * n <= limits.sweeps).map(with(Backend::Cpu, PBD)));
    }
    configs
}

/// Substeps and iterations within `limits`.
fn pairs(limits: &Limits) -> Vec<[u32; 2]> {
    let iterations = |&s: &u32| {
        let raised = if RAISED.contains(&s) { limits.raised } else { 1 };
        let most = (limits.sweeps / s).max(raised);
        (0..).map(|power| 1u32 << power).take_while(move |n| *n <= most).map(move |n| [s, n])
    };
    limits.substeps.iter().filter(|s| **s <= limits.sweeps).flat_map(iterations).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_stay_within_the_limits() {
        let pairs = pairs(&Limits { substeps: &SUBSTEPS, sweeps: 20, raised: 64 });
        assert!(pairs.iter().all(|[s, n]| s * n <= 20 || RAISED.contains(s) && *n <= 64));
        assert!(pairs.contains(&[1, 64]) && pairs.contains(&[10, 1]) && pairs.contains(&[20, 1]));
        assert!(!pairs.contains(&[40, 1]) && !pairs.contains(&[2, 16]));
    }
}
