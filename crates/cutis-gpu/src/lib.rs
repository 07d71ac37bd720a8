//! Compute on any GPU, through wgpu.
#![forbid(unsafe_code)]
