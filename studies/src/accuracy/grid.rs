//! The configurations of a problem.

use cutis_gpu::Gpu;

use super::config::{Backend, Config, METHODS, Method, PBD, VBD, XPBD, is_software};
use super::problems::Problem;

/// Limits of the pairs of substeps and iterations.
#[derive(Clone, Copy)]
struct Limits {
    /// Substeps of a frame.
    substeps: &'static [u32],
    /// Largest number of sweeps of a frame. Does not limit pairs with one iteration.
    sweeps: u32,
    /// Larger numbers of iterations for some numbers of substeps, for E1 and E2 only: pairs of
    /// substeps and iterations.
    raised: &'static [(u32, u32)],
    /// Divides the numbers of iterations.
    times: u32,
}

const FULL: Limits = Limits {
    substeps: &[1, 2, 5, 10, 20, 40, 80],
    sweeps: 40,
    raised: &[(1, 512), (2, 128), (5, 64), (10, 64), (20, 16), (40, 8), (80, 4)],
    times: 1,
};
const FEW: Limits =
    Limits { substeps: &[2, 5, 10, 20, 40, 80], sweeps: 20, raised: &[(5, 32), (10, 16)], times: 1 };
const QUICK_FEW: Limits = Limits { substeps: &[1, 10, 80], sweeps: 20, raised: &[(10, 16)], times: 1 };
const QUICK: Limits = Limits { substeps: &[1, 10, 40], sweeps: 20, raised: &[(1, 16), (10, 16)], times: 1 };
/// Limits for the serial reference and a software adapter. They serve for comparison and are not
/// expected to be fast.
const SLOW: Limits = Limits { substeps: &[1, 10, 20], sweeps: 5, raised: &[(1, 64), (10, 8)], times: 1 };

impl Limits {
    /// The limits for a method whose iterations take `times` as long.
    fn shared_by(self, times: u32) -> Self {
        Self { times, ..self }
    }

    /// Substeps and iterations, and whether there are few enough for a run until the body is at
    /// rest.
    fn pairs(self) -> Vec<([u32; 2], bool)> {
        let of = |&s: &u32| {
            let most = (self.sweeps / self.times / s).max(1);
            let raised = self.raised.iter().find(|(raised, _)| *raised == s);
            let raised = raised.map_or(most, |(_, n)| most.max(n / self.times));
            let powers = (0..).map(|power| 1u32 << power).take_while(move |n| *n <= raised);
            powers.map(move |n| ([s, n], n <= most))
        };
        self.substeps.iter().flat_map(of).collect()
    }
}

/// All configurations of `problem`.
pub fn configs(problem: &Problem, quick: bool, gpu: Option<&Gpu>) -> Vec<Config> {
    let limits = match (quick, problem.few_settings) {
        (true, false) => QUICK,
        (true, true) => QUICK_FEW,
        (false, true) => FEW,
        (false, false) => FULL,
    };
    let slow = if quick { QUICK.shared_by(8) } else { SLOW };
    let mut configs = Vec::new();
    let mut add = |backend: Backend, method: Method, limits: Limits, all: bool| {
        let chosen = limits.pairs().into_iter().filter(|([s, n], _)| all || *n == 1 || [1, 10].contains(s));
        configs.extend(chosen.map(|([substeps, iterations], settles)| Config {
            backend: backend.clone(),
            method,
            substeps,
            iterations,
            settles,
        }));
    };
    for &method in METHODS {
        add(Backend::Cpu, method, limits.shared_by(method.weight), true);
    }
    add(Backend::CpuDouble, XPBD, limits, false);
    add(Backend::CpuDouble, VBD, limits.shared_by(VBD.weight), false);
    add(Backend::Reference, XPBD, slow, false);
    match gpu {
        None => (),
        Some(gpu) if is_software(gpu) => add(Backend::Gpu(gpu.clone()), XPBD, slow, false),
        Some(gpu) => add(Backend::Gpu(gpu.clone()), XPBD, limits, true),
    }
    if problem.pbd.is_some() {
        add(Backend::Cpu, PBD, limits.shared_by(4), true);
    }
    configs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_stay_within_the_limits() {
        let limits = Limits { substeps: &[1, 2, 10, 40], sweeps: 20, raised: &[(1, 64), (10, 4)], times: 1 };
        let pairs = limits.pairs();
        assert!(pairs.iter().all(|([s, n], settles)| !settles || s * n <= 20 || *n == 1));
        for pair in [
            ([1, 16], true),
            ([1, 64], false),
            ([2, 8], true),
            ([10, 2], true),
            ([10, 4], false),
            ([40, 1], true),
        ] {
            assert!(pairs.contains(&pair), "{pair:?}");
        }
        assert_eq!(limits.shared_by(2).pairs().len(), pairs.len() - 3);
    }
}
