//! Synthetic CTs: a human-like torso, and test solids with closed forms.
//!
//! [`Phantom`] consists of analytic solids: skin, subcutaneous fat, muscle, bones, lungs with
//! vessels, organs, bowel with gas, and a scanner table. Each voxel is the mean over sample points
//! at most 2.5 mm apart (partial volume effect) plus noise. Its value depends only on shape, seed
//! and index. It is bitwise the same for any number of threads and any order of slices, because
//! only arithmetic that IEEE 754 specifies exactly is used.

mod anatomy;
mod bowel;
mod chest;
mod habitus;
mod layered_solid;
mod organs;
mod outline;
mod profile;
mod random;
mod scan;
mod skeleton;
mod solid;
mod solids;
mod turn;

use std::ops::Range;
use std::path::Path;

use anatomy::Anatomy;
use solid::{Capsule, Solid};
use turn::Turn;

pub use solids::{nested_spheres, sphere};

use crate::{Affine, Grid, Volume, VolumeError, nifti};

/// Largest number of voxels along one axis.
pub const MAX_VOXELS_PER_AXIS: usize = 4096;
/// Width and depth of the field of view in mm.
const FIELD_OF_VIEW_MM: f64 = 400.0;
/// Shortest and longest length of a scan along the body in mm.
const LENGTH_MM: [f64; 2] = [300.0, 600.0];
/// Number of bytes that [`Phantom::write`] computes at a time.
const PORTION_BYTES: usize = 16 << 20;

/// A synthetic CT scan of a torso.
///
/// The person lies on the back. The frame is RAS+ with the origin in the middle of the body. The
/// belly is at +y, the table at −y and the head at +z. The index axes run along +x, +y and +z.
/// [`turned`](Self::turned) turns the person in this frame.
///
/// The field of view is 400 × 400 mm, so the axial spacing is `400/nx` × `400/ny`. The slice
/// spacing equals the finer of these two, within limits on the length of the scan: at least 300 mm
/// (lower chest to iliac crests) and at most 600 mm (upper chest to hips). `spacing_z = clamp(nz ·
/// min(400/nx, 400/ny), 300, 600)/nz`.
///
/// The seed varies the build of the body, the sizes and positions of organs, the bowel and the
/// noise.
///
/// ```
/// use cutis_volume::phantom::Phantom;
/// let phantom = Phantom::new([32, 32, 24], 7)?;
/// assert_eq!(phantom.grid().affine.spacing_mm(), [12.5, 12.5, 12.5]);
/// let mut slices = vec![0; 32 * 32 * 2];
/// phantom.fill_slices(10..12, &mut slices)?;
/// assert_eq!(slices, phantom.volume()?.voxels()[32 * 32 * 10..32 * 32 * 12]);
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
pub struct Phantom {
    grid: Grid,
    seed: u64,
    anatomy: Anatomy,
    turn: Option<Turn>,
}

impl Phantom {
    /// Creates a scan with `shape` voxels of the person with number `seed`.
    ///
    /// # Errors
    /// [`VolumeError::PhantomShape`] if an axis has no voxels or more than [`MAX_VOXELS_PER_AXIS`].
    pub fn new(shape: [usize; 3], seed: u64) -> Result<Self, VolumeError> {
        voxel_count(shape)?;
        let [nx, ny, nz] = shape.map(|n| n as f64);
        let (sx, sy) = (FIELD_OF_VIEW_MM / nx, FIELD_OF_VIEW_MM / ny);
        let length = (nz * sx.min(sy)).clamp(LENGTH_MM[0], LENGTH_MM[1]);
        let grid = centered_grid(shape, [sx, sy, length / nz])?;
        Ok(Self { grid, seed, anatomy: Anatomy::new(seed), turn: None })
    }

    /// Turns the person in the scanner by angles in degrees: about the x axis first, then about y,
    /// then about z. A positive angle turns as a right-handed screw. All axes pass through the
    /// middle of the scan.
    ///
    /// The table turns with the person, and so do the levels of fluid in the bowel: the scan is
    /// that of the same person in another frame. Only the noise belongs to the scanner. With angles
    /// of zero the voxels stay the same.
    ///
    /// # Errors
    /// [`VolumeError::PhantomTurn`] if an angle is not finite.
    pub fn turned(mut self, turn_deg: [f64; 3]) -> Result<Self, VolumeError> {
        if !turn_deg.iter().all(|angle| angle.is_finite()) {
            return Err(VolumeError::PhantomTurn { turn_deg });
        }
        self.turn = Turn::new(turn_deg);
        Ok(self)
    }

    /// The place in the scan of a point of the person who is not turned, in mm.
    pub fn place(&self, point_mm: [f64; 3]) -> [f64; 3] {
        self.turn.as_ref().map_or(point_mm, |turn| turn.to_scanner(point_mm))
    }

    /// The grid of the voxel centers.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Two points in mm on the skin of the belly, next to the midline and about 100 mm apart along
    /// the body. They suit an incision.
    pub fn incision_site(&self) -> ([f64; 3], [f64; 3]) {
        const X_MM: f32 = 36.0;
        let at = |z: f32| self.place([X_MM, self.anatomy.person.skin.front_at(X_MM, z), z].map(f64::from));
        (at(-85.0), at(15.0))
    }

    /// Computes the HU of some slices in parallel, index `i` fastest.
    ///
    /// # Errors
    /// [`VolumeError::SliceRange`] if the grid does not have these slices.
    /// [`VolumeError::VoxelCount`] if the length of `out` is not the number of their voxels.
    pub fn fill_slices(&self, slices: Range<usize>, out: &mut [i16]) -> Result<(), VolumeError> {
        let [nx, ny, nz] = self.grid.shape;
        if slices.start > slices.end || slices.end > nz {
            return Err(VolumeError::SliceRange { start: slices.start, end: slices.end, count: nz });
        }
        let shape = [nx, ny, slices.len()];
        let expected = nx * ny * slices.len();
        if out.len() != expected {
            return Err(VolumeError::VoxelCount { shape, expected, found: out.len() });
        }
        scan::fill(&self.grid, self.seed, &self.anatomy, self.turn.as_ref(), slices.start, out);
        Ok(())
    }

    /// Computes the whole scan. It takes two bytes of memory per voxel.
    ///
    /// # Errors
    /// [`VolumeError::PhantomShape`] if there is not enough memory. [`Phantom::write`] needs little
    /// memory.
    pub fn volume(&self) -> Result<Volume, VolumeError> {
        let mut voxels = zeros(self.grid.shape)?;
        self.fill_slices(0..self.grid.shape[2], &mut voxels)?;
        Volume::new(self.grid, voxels, 1.0, 0.0)
    }

    /// Writes the scan to a `.nii` or `.nii.gz` file, a few slices at a time. Calls `progress` with
    /// the number of finished slices and of all slices.
    ///
    /// # Errors
    /// The errors of [`nifti::Writer`].
    pub fn write(
        &self,
        path: impl AsRef<Path>,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<(), VolumeError> {
        let [nx, ny, nz] = self.grid.shape;
        let mut writer = nifti::Writer::create(path, self.grid)?;
        let portion = (PORTION_BYTES / (size_of::<i16>() * nx * ny)).clamp(1, nz);
        let mut voxels = zeros([nx, ny, portion])?;
        for start in (0..nz).step_by(portion) {
            let end = (start + portion).min(nz);
            let slices = &mut voxels[..nx * ny * (end - start)];
            self.fill_slices(start..end, slices)?;
            writer.push_slices(slices)?;
            progress(end, nz);
        }
        writer.finish()
    }
}

/// Number of voxels of a shape, or an error if the shape exceeds the limits.
fn voxel_count(shape: [usize; 3]) -> Result<usize, VolumeError> {
    let refused = VolumeError::PhantomShape { shape, most: MAX_VOXELS_PER_AXIS };
    if shape.iter().any(|n| !(1..=MAX_VOXELS_PER_AXIS).contains(n)) {
        return Err(refused);
    }
    shape.iter().try_fold(1_usize, |count, &n| count.checked_mul(n)).ok_or(refused)
}

/// Zeroed voxels of a shape, or an error if the shape exceeds the limits or there is not enough
/// memory.
fn zeros(shape: [usize; 3]) -> Result<Vec<i16>, VolumeError> {
    let count = voxel_count(shape)?;
    let mut voxels = Vec::new();
    if voxels.try_reserve_exact(count).is_err() {
        return Err(VolumeError::PhantomShape { shape, most: MAX_VOXELS_PER_AXIS });
    }
    voxels.resize(count, 0);
    Ok(voxels)
}

/// The grid along +x, +y and +z whose middle is at the origin.
fn centered_grid(shape: [usize; 3], spacing_mm: [f64; 3]) -> Result<Grid, VolumeError> {
    let origin_mm = std::array::from_fn(|c| -0.5 * (shape[c] as f64 - 1.0) * spacing_mm[c]);
    Ok(Grid { shape, affine: Affine::from_spacing(spacing_mm, origin_mm)? })
}

/// Capsules that form a tube through points `[x, y, z, radius]`.
fn tube(points: &[[f32; 4]]) -> impl Iterator<Item = Solid> + use<> {
    let capsules: Vec<_> = points
        .windows(2)
        .map(|pair| {
            let [from, to] = [pair[0], pair[1]].map(|[x, y, z, _]| [x, y, z]);
            Solid::Capsule(Capsule::new([from, to], [pair[0][3], pair[1][3]]))
        })
        .collect();
    capsules.into_iter()
}
