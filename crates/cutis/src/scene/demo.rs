//! The built-in demo: the whole pipeline on the phantom.

use std::path::Path;

use crate::{Error, LoadedScene, Override, Scene};

const SCENE: &str = include_str!("demo.toml");

/// Returns the demo's scene, with overrides applied.
///
/// # Errors
/// The errors of [`Scene::load`], for an override that cannot be used.
pub fn demo(overrides: &[Override]) -> Result<LoadedScene, Error> {
    Scene::parse(SCENE, Path::new("demo.toml"), Path::new(""), overrides)
}
