//! SIMD levels: the instruction sets that a task can run with.
//!
//! A function that is compiled for an instruction set must not run on a processor that lacks it.
//! Here a [`SimdLevel`] is the proof that the processor has the instructions: it is only created
//! after a check of the processor. The types of the wide lanes are private, so that a task gets
//! them from here only.
#![allow(unsafe_code)]

use simba::simd::{WideF32x4, WideF64x4};

use super::LaneTask;

/// An instruction set that this processor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SimdLevel(InstructionSet);

/// The instruction sets that tasks are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InstructionSet {
    /// The instructions that every processor of the architecture has: four lanes.
    Baseline,
    /// Eight lanes of `f32`.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Sixteen lanes of `f32`.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl SimdLevel {
    /// The level with the most lanes.
    pub fn best() -> Self {
        Self::available().into_iter().next_back().unwrap_or(Self(InstructionSet::Baseline))
    }

    /// All levels of this processor, that with the fewest lanes first.
    pub fn available() -> Vec<Self> {
        let mut levels = vec![Self(InstructionSet::Baseline)];
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx2") {
                levels.push(Self(InstructionSet::Avx2));
            }
            let has_avx512 = std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512bw")
                && std::arch::is_x86_feature_detected!("avx512dq")
                && std::arch::is_x86_feature_detected!("avx512vl");
            if has_avx512 && levels.len() > 1 {
                levels.push(Self(InstructionSet::Avx512));
            }
        }
        levels
    }

    /// Number of lanes of `f32`.
    pub fn lanes(self) -> usize {
        match self.0 {
            InstructionSet::Baseline => 4,
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => 8,
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => 16,
        }
    }
}

/// Runs a task with the lanes of a level.
#[inline]
pub(crate) fn run_f32<K: LaneTask<f32>>(level: SimdLevel, task: K) {
    match level.0 {
        InstructionSet::Baseline => task.run::<WideF32x4>(),
        // SAFETY: `available` creates this level only if the processor has AVX2.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { with_avx2(task) },
        // SAFETY: `available` creates this level only if the processor has AVX2 and these parts of
        // AVX-512.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { with_avx512(task) },
    }
}

/// Runs a task in double precision. There is one set of lanes, since nothing in double precision
/// has to be fast.
#[inline]
pub(crate) fn run_f64<K: LaneTask<f64>>(_level: SimdLevel, task: K) {
    task.run::<WideF64x4>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<K: LaneTask<f32>>(task: K) {
    task.run::<super::pack::Pack<std::arch::x86_64::__m256>>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
fn with_avx512<K: LaneTask<f32>>(task: K) {
    task.run::<super::pack::Pack<std::arch::x86_64::__m512>>();
}
