//! The WGSL sources of Cutis, as text: parts of shaders, joined by concatenation.
//!
//! There is no build script and no preprocessor. [`link`] joins a shader from parts in `wgsl/`. A
//! variant is another selection of parts, without conditions inside a part.
#![forbid(unsafe_code)]

pub mod chainmail;
pub mod coloring;
pub mod constraints;
pub mod render;
pub mod resample;
pub mod rest;
pub mod solver;

/// Joins parts to one source, in order. Each part starts on a new line.
pub fn link(parts: &[&str]) -> String {
    let mut source = String::with_capacity(parts.iter().map(|part| part.len() + 1).sum());
    for part in parts {
        source.push_str(part);
        source.push('\n');
    }
    source
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
