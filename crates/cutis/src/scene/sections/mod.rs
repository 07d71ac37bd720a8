//! The sections of a scene file, each with its defaults.

mod actions;
mod body;
mod chainmail;
mod constraints;
mod running;

pub use actions::*;
pub use body::*;
pub use chainmail::*;
pub use constraints::*;
pub use running::*;
