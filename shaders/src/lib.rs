//! The WGSL of Cutis, as text: parts of shaders, joined by plain concatenation.
//!
//! There is no build script and no preprocessor. A shader is [`link`]ed from parts that lie in `wgsl/`; a variant is another
//! choice of parts, not a condition inside one.
#![forbid(unsafe_code)]

pub mod chainmail;
pub mod constraints;
pub mod render;
pub mod resample;
pub mod solver;

/// Joins parts to one source, in order, each beginning on a line of its own.
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
