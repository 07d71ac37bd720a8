//! The sections of a scene file, each with its defaults.

mod actions;
mod body;
mod cuts;
mod material_presets;
mod materials;
mod region;
mod running;
mod sutures;

pub use actions::*;
pub use body::*;
pub use cuts::*;
pub use materials::*;
pub use region::*;
pub use running::*;
pub use sutures::*;
