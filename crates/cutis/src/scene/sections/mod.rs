//! The sections of a scene file, each with its defaults.

mod actions;
mod body;
mod running;

pub use actions::*;
pub use body::*;
pub use running::*;
