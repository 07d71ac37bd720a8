//! Headless pictures of CT volumes: the skin from any side, lines of a field on it, slices with
//! contours, charts.
//!
//! Everything runs on the CPU without a display and gives the same bits for any number of threads.
//! With the feature `gpu`, `raymarch_gpu` draws the same surface pictures on a GPU, except for
//! roundings.
//!
//! Positions and directions are RAS+ millimeters: `[1, 0, 0]` points to the patient's right, `[0,
//! 1, 0]` to anterior, `[0, 0, 1]` to superior.
//!
//! ```
//! use cutis_render::{Plane, Side, SliceView, View, raymarch, slice};
//! use cutis_volume::{Affine, Grid, Volume};
//!
//! let grid = Grid { shape: [32; 3], affine: Affine::from_spacing([2.0; 3], [-31.0; 3])? };
//! let radius_mm = |v| grid.mm(grid.point(v)).coords.norm();
//! let ball = (0..grid.len()).map(|v| if radius_mm(v) < 25.0 { 40 } else { -1000 });
//! let volume = Volume::new(grid, ball.collect(), 1.0, 0.0)?;
//! let skin = raymarch(&volume, &View { width: 64, height: 64, ..View::new(Side::Anterior) })?;
//! let cut = slice(&volume, &SliceView::new(Plane::Axial, 0.0))?;
//! assert_eq!((skin.width, cut.width), (64, 32));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod annotate;
mod blocks;
mod compose;
mod contour;
mod depth;
mod draw;
mod error;
mod expose;
mod field;
mod font;
#[cfg(feature = "gpu")]
mod gpu;
mod image;
mod legend;
mod lines;
mod outside;
mod path;
pub mod plot;
mod raymarch;
mod rays;
mod shade;
mod side;
mod slice;
mod view;

pub use compose::side_by_side;
pub use contour::Contour;
pub use depth::{bare_sides, skin_depth};
pub use error::RenderError;
#[cfg(feature = "gpu")]
pub use gpu::{GpuRaymarcher, raymarch_gpu};
pub use image::{Image, Rgb};
pub use lines::{LineField, draw_lines};
pub use path::{SkinPaths, draw_paths};
pub use raymarch::{draw_annotations, raymarch};
pub use shade::tissue_color;
pub use side::{Axes, Side};
pub use slice::{Plane, SliceView, slice};
pub use view::{Focus, View};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
