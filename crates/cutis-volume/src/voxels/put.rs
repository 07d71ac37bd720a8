//! Writes the voxels of a volume as HU, for formats without slope and intercept.

use std::io::{self, Write};

use crate::Volume;

/// Number of voxels converted to bytes at a time.
const PORTION: usize = 1 << 16;

/// Writes all voxels of a file to a sink.
pub(crate) type PutVoxels<'a> = dyn Fn(&mut dyn Write) -> io::Result<()> + 'a;

/// True if all HU are whole numbers within int16. Else they are written as 32-bit real numbers.
pub(crate) fn fits_int16(volume: &Volume) -> bool {
    let whole = |hu: f32| hu == hu.trunc() && (f32::from(i16::MIN)..=f32::from(i16::MAX)).contains(&hu);
    (volume.slope() == 1.0 && volume.intercept() == 0.0)
        || volume.voxels().iter().all(|&stored| whole(volume.hu(stored)))
}

/// Writes all voxels, little-endian, as int16 or as 32-bit real numbers.
pub(crate) fn put_hu(sink: &mut dyn Write, volume: &Volume, int16: bool) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(4 * PORTION);
    for portion in volume.voxels().chunks(PORTION) {
        bytes.clear();
        let hu = portion.iter().map(|&stored| volume.hu(stored));
        match int16 {
            true => bytes.extend(hu.flat_map(|hu| (hu as i16).to_le_bytes())),
            false => bytes.extend(hu.flat_map(f32::to_le_bytes)),
        }
        sink.write_all(&bytes)?;
    }
    Ok(())
}
