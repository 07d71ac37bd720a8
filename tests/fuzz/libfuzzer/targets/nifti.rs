//! The reader `nifti` under libFuzzer.

#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| cutis_fuzz::require_no_fault("nifti", input));
