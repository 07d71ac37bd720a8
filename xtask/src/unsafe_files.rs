//! The files that may hold `unsafe` code, and the tests that run them under Miri.

/// A file with `unsafe` code.
pub struct UnsafeFile {
    /// Path from the root of the checkout.
    pub path: &'static str,
    /// Why the file needs `unsafe`, and why it has no tests for Miri if it has none.
    pub reason: &'static str,
    /// Tests for Miri.
    pub tests: Option<Tests>,
}

/// Unit tests of one package.
#[derive(PartialEq)]
pub struct Tests {
    pub package: &'static str,
    /// The tests whose names contain this text.
    pub filter: &'static str,
    /// Instructions that Miri must offer beyond those of every processor.
    pub target_features: &'static str,
}

/// The tests of SIMD lanes.
const LANES: Option<Tests> =
    Some(Tests { package: "cutis-constraints", filter: "lanes::", target_features: "+avx2" });

/// `tidy` refuses `unsafe` in every other file.
pub const UNSAFE_FILES: &[UnsafeFile] = &[
    UnsafeFile {
        path: "crates/cutis-solver/src/colored.rs",
        reason: "threads move the vertices of one color at the same time",
        tests: Some(Tests { package: "cutis-solver", filter: "colored::", target_features: "" }),
    },
    UnsafeFile {
        path: "crates/cutis-solver/src/colored/shared.rs",
        reason: "has the vertices that these threads read and move",
        tests: Some(Tests { package: "cutis-solver", filter: "colored::", target_features: "" }),
    },
    UnsafeFile {
        path: "crates/cutis-constraints/src/lanes/level.rs",
        reason: "calls functions for vector units that only some processors have",
        tests: LANES,
    },
    UnsafeFile {
        path: "crates/cutis-constraints/src/lanes/mask.rs",
        reason: "implements a trait with unsafe methods",
        tests: LANES,
    },
    UnsafeFile {
        path: "crates/cutis-constraints/src/lanes/pack.rs",
        reason: "implements a trait with unsafe methods",
        tests: LANES,
    },
    UnsafeFile {
        path: "crates/cutis-constraints/src/lanes/x86.rs",
        reason: "has instructions of vector units that only some processors have",
        tests: LANES,
    },
    UnsafeFile {
        path: "crates/cutis-constraints/src/prefetch.rs",
        reason: "has an instruction for the cache",
        tests: Some(Tests { package: "cutis-constraints", filter: "prefetch::", target_features: "" }),
    },
    UnsafeFile {
        path: "crates/cutis-chainmail/src/simd.rs",
        reason: "calls functions for vector units that only some processors have",
        tests: Some(Tests {
            package: "cutis-chainmail",
            filter: "simd::",
            target_features: "+avx2,+avx512f,+avx512bw,+avx512dq,+avx512vl",
        }),
    },
    UnsafeFile {
        path: "tests/fuzz/harness/memory.rs",
        reason: "an allocator that counts; it only forwards to the allocator of the system",
        tests: None,
    },
    UnsafeFile {
        path: "crates/cutis-solver-cpu/tests/allocations.rs",
        reason: "an allocator that counts; it only forwards to the allocator of the system",
        tests: None,
    },
];

/// Whether the file may hold `unsafe` code.
pub fn is_allowed(path: &str) -> bool {
    UNSAFE_FILES.iter().any(|file| file.path == path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_exists_and_says_why() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        for file in UNSAFE_FILES {
            assert!(root.join(file.path).is_file(), "{} does not exist", file.path);
            assert!(!file.reason.is_empty());
        }
    }

    #[test]
    fn product_code_with_unsafe_has_tests_for_miri() {
        for file in UNSAFE_FILES.iter().filter(|file| file.path.contains("/src/")) {
            assert!(file.tests.is_some(), "{}", file.path);
        }
    }
}
