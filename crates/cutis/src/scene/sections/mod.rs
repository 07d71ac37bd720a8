//! The sections of a scene file, each with its defaults.

mod actions;
mod body;
mod material_presets;
mod materials;
mod running;

pub use actions::*;
pub use body::*;
pub use materials::*;
pub use running::*;
