//! Resampling a CT volume through a deformed tetrahedral mesh.
//!
//! The inverse warp is evaluated by rasterizing the deformed tetrahedra. An output voxel whose
//! center lies in a deformed tet takes the trilinear value of the input at the matching rest
//! position, rounded to the nearest stored `int16`. Barycentric coordinates map between the two
//! positions. The tests check these rules:
//!
//! * a tet that did not move copies the input bit for bit;
//! * if several tets hold a voxel center, the tet with the lowest index owns the voxel;
//! * a voxel that the body has left (it is in the rest shape, but in no deformed tet) becomes air;
//! * a voxel that neither shape covers keeps its input value;
//! * values stay within the range of the input;
//! * the result has the same bits for any number of threads.
//!
//! [`blend_walls`] then gives the voxels that the wall of a wound crosses the mean over the voxel,
//! as a scanner would, so that walls look smooth.
//!
//! [`Displacement`] gives the displacement field of a warp on a grid, and [`resample_labels`] a
//! label map through the warp, with nearest neighbors.
//!
//! With the feature `gpu`, the same rules hold on a GPU: `resample_gpu` resamples through one state
//! of a mesh, and `ResamplerGpu` through many.
//!
//! ```
//! use cutis_resample::{Warp, resample};
//! use cutis_volume::{Affine, Grid, Volume};
//! use nalgebra::Point3;
//!
//! let grid = Grid { shape: [4, 4, 4], affine: Affine::from_spacing([1.0; 3], [0.0; 3])? };
//! let volume = Volume::new(grid, (0..64).collect(), 1.0, 0.0)?;
//! // One tet in local meters, moved by one voxel (1 mm) along +i.
//! let rest = [[0.0; 3], [0.002, 0.0, 0.0], [0.0, 0.002, 0.0], [0.0, 0.0, 0.002]].map(Point3::from);
//! let deformed = rest.map(|p| Point3::new(p.x + 0.001, p.y, p.z));
//! let warp = Warp {
//!     origin_mm: Point3::origin(),
//!     rest: &rest,
//!     deformed: &deformed,
//!     tets: &[[0, 1, 2, 3]],
//!     body_tets: 1,
//!     removed: &[],
//! };
//! let (warped, report) = resample(&volume, &warp, &|_done, _total| {})?;
//! assert_eq!(warped.voxels()[1], volume.voxels()[0]);
//! assert_eq!((report.moved_voxels, report.folds), (10, 0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod buckets;
mod clear_rows;
mod displacement;
mod error;
#[cfg(feature = "gpu")]
mod gpu;
mod group;
mod inverted;
mod labels;
mod lanes;
mod motion;
mod partial_volume;
mod prepared;
mod raster;
mod reaching;
mod report;
mod resampler;
mod rows;
mod sample;
mod samples;
mod slabs;
mod space;
mod spans;
mod tet_map;
mod tile;
mod tiling;
mod voxel_set;
mod wall_means;
mod warp;

pub use displacement::{Coverage, Displacement, Slab};
pub use error::ResampleError;
#[cfg(feature = "gpu")]
pub use gpu::{GridUniform, ResamplerGpu, ResamplerOptions, Setup, SlabState, resample_gpu};
pub use labels::{LabelReport, resample_labels};
pub use partial_volume::blend_walls;
pub use report::ResampleReport;
pub use resampler::Resampler;
pub use warp::{Warp, resample, resample_where};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
