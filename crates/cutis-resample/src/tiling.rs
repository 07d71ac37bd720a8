//! The tiles of the output: boxes of voxels that are resampled one at a time.

use std::ops::Range;

/// Voxels of a tile along each axis. A row of a tile has one bit per column in a `u64`. The result
/// does not depend on it. Smaller tiles follow what moved more closely, but put more tets into
/// several tiles.
pub const TILE: [usize; 3] = [u64::BITS as usize, 32, 16];

/// The tiles of a grid.
#[derive(Clone, Copy, Debug)]
pub struct Tiling {
    /// Voxels along each axis.
    pub shape: [usize; 3],
    /// Tiles along each axis.
    pub counts: [usize; 3],
}

/// A box of tiles: the first tile and the end along each axis. It is empty if an end is not behind
/// the first tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileBox {
    first: [i32; 3],
    end: [i32; 3],
}

/// The tiles around a point: the first one along each axis, negative, and the last one along each
/// axis. The largest numbers of several points are those of the box around them.
#[derive(Clone, Copy, Debug, Default)]
pub struct TilesNear([i32; 8]);

impl TilesNear {
    /// The tiles of the box around the corners of a tet.
    #[inline(always)]
    pub fn around(corners: [Self; 4]) -> TileBox {
        let [Self(mut most), others @ ..] = corners;
        for corner in others {
            for n in 0..8 {
                most[n] = most[n].max(corner.0[n]);
            }
        }
        let [x, y, z, end_x, end_y, end_z, ..] = most;
        TileBox { first: [-x, -y, -z], end: [end_x + 1, end_y + 1, end_z + 1] }
    }

    /// Whether all of these tiles are among those around another point.
    #[inline(always)]
    pub fn is_within(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(own, other)| own <= other)
    }
}

impl Tiling {
    /// Divides a grid with this shape.
    pub fn new(shape: [usize; 3]) -> Self {
        Self { shape, counts: std::array::from_fn(|axis| shape[axis].div_ceil(TILE[axis])) }
    }

    /// Number of tiles.
    pub fn len(&self) -> usize {
        self.counts.iter().product()
    }

    /// Number of a tile.
    pub fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.counts[0] * (j + self.counts[1] * k)
    }

    /// Place of a tile along each axis.
    pub fn place(&self, number: usize) -> [usize; 3] {
        let [columns, rows, _] = self.counts;
        [number % columns, number / columns % rows, number / columns / rows]
    }

    /// The voxels of a tile along each axis.
    pub fn region(&self, tile: [usize; 3]) -> [Range<usize>; 3] {
        std::array::from_fn(|axis| {
            let first = tile[axis] * TILE[axis];
            first..self.shape[axis].min(first + TILE[axis])
        })
    }

    /// The tiles that hold voxel centers at most `margin` voxels away from a continuous index.
    #[inline(always)]
    pub fn near(&self, place: [f64; 3], margin: f64) -> TilesNear {
        let mut tiles = [0; 8];
        for axis in 0..3 {
            let last = self.shape[axis] as f64 - 1.0;
            let (low, high) = (place[axis] - margin, place[axis] + margin);
            let tile = |at: f64| (at.clamp(0.0, last) as u32 / TILE[axis] as u32) as i32;
            // Outside of the grid the box is empty.
            tiles[axis] = -(if low > last { self.counts[axis] as i32 } else { tile(low) });
            tiles[3 + axis] = if high < 0.0 { -1 } else { tile(high) };
        }
        TilesNear(tiles)
    }

    /// Calls `visit` with the number of each tile of a box.
    #[inline(always)]
    pub fn each(&self, tiles: &TileBox, mut visit: impl FnMut(usize)) {
        let [columns, rows, slices] = [0, 1, 2].map(|a| tiles.first[a]..tiles.end[a]);
        for k in slices {
            for j in rows.clone() {
                for i in columns.clone() {
                    visit(self.number([i as usize, j as usize, k as usize]));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three tiles along the first and the third axis, and one along the second.
    fn tiling() -> Tiling {
        Tiling::new([2 * TILE[0] + 2, TILE[1], 2 * TILE[2] + 1])
    }

    #[test]
    fn tiles_cover_each_voxel_once() {
        let tiling = tiling();
        assert_eq!(tiling.counts, [3, 1, 3]);
        let mut count = 0;
        for number in 0..tiling.len() {
            let tile = tiling.place(number);
            assert_eq!(tiling.number(tile), number);
            count += tiling.region(tile).iter().map(ExactSizeIterator::len).product::<usize>();
        }
        assert_eq!(count, tiling.shape.iter().product::<usize>());
    }

    #[test]
    fn a_box_touches_the_tiles_of_its_voxels() {
        let tiling = tiling();
        let [x, y, z] = TILE.map(|length| length as f64);
        let touched = |low, high| {
            let mut found = Vec::new();
            let corners = [low, high].map(|corner| tiling.near(corner, 0.0));
            tiling.each(&TilesNear::around([0, 1, 1, 0].map(|n| corners[n])), |tile| found.push(tile));
            found
        };
        assert_eq!(touched([-3.0, 2.0, 2.0], [x - 0.1, y + 8.0, 2.0]), [0]);
        assert_eq!(touched([x - 0.1, 2.0, z - 1.0], [x, 3.0, z]), [0, 1, 3, 4]);
        assert_eq!(touched([2.0 * x, y - 1.0, 2.0 * z], [900.0, 99.0, 99.0]), [8]);
        assert!(touched([2.0 * x + 1.1, 0.0, 0.0], [900.0, 1.0, 1.0]).is_empty());
        assert!(touched([0.0, -2.0, 0.0], [1.0, -0.1, 1.0]).is_empty());
    }
}
