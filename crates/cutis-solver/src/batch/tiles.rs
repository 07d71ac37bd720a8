//! Tiles: parts of a kind whose vertices stay in the cache while all colors are projected.
//!
//! A pass over one color of a large body reads all vertices, and the next color reads them again
//! from memory. So a kind is divided into tiles. The solver projects all colors of the first tile,
//! then those of the second one, and so on. Two constraints that share a vertex keep the order of
//! their colors, because a constraint is never in an earlier tile than a constraint of an earlier
//! color that shares a vertex with it. All other constraints do not depend on each other. So the
//! result has the bits of a sweep over whole colors.
//!
//! A constraint is in the tile of its highest vertex, where the tiles divide the vertices into
//! equal parts, or in a later one if it has to be. The indices of a mesh are usually sorted along
//! some direction, so that a tile is a slab. With any other indices most constraints are in the
//! last tile, and the sweep is one over whole colors.

use cutis_coloring::Groups;

/// The least number of vertices of a tile: 6 MiB in `f32`. Results do not depend on it. In the unit
/// tests a small body has several tiles.
const TILE: usize = if cfg!(test) { 64 } else { 3 << 17 };

/// The constraints of a kind by color and tile.
#[derive(Clone, Debug)]
pub(super) struct Tiles {
    /// Number of tiles.
    pub(super) count: usize,
    /// Start of each tile within each color, color by color, and the number of constraints. Empty
    /// if there is one tile.
    pub(super) offsets: Vec<u32>,
}

/// Divides the constraints into tiles. Returns them and the order of the constraints: by color,
/// then by tile, then as in the groups.
pub(super) fn divide<const N: usize>(
    indices: &[[u32; N]],
    groups: &Groups,
    vertex_count: usize,
) -> (Tiles, Vec<u32>) {
    let count = (vertex_count / TILE).max(1);
    let tile_len = vertex_count.div_ceil(count);
    if count == 1 {
        return (Tiles { count, offsets: Vec::new() }, groups.order.clone());
    }
    let mut last = vec![0u32; vertex_count];
    let mut offsets = Vec::with_capacity(groups.len() * count + 1);
    offsets.push(0);
    let mut order = vec![0; groups.order.len()];
    let mut of_place = Vec::new();
    let mut first = 0;
    for color in groups.iter() {
        let mut counts = vec![0u32; count];
        of_place.clear();
        for &k in color {
            let tuple = &indices[k as usize];
            let highest = tuple.iter().copied().max().unwrap_or(0) as usize / tile_len;
            let tile = tuple.iter().fold(highest as u32, |tile, &vertex| tile.max(last[vertex as usize]));
            tuple.iter().for_each(|&vertex| last[vertex as usize] = tile);
            counts[tile as usize] += 1;
            of_place.push(tile);
        }
        let mut next: Vec<u32> = Vec::with_capacity(count);
        for count in counts {
            next.push(first);
            first += count;
            offsets.push(first);
        }
        for (&k, &tile) in color.iter().zip(&of_place) {
            order[next[tile as usize] as usize] = k;
            next[tile as usize] += 1;
        }
    }
    (Tiles { count, offsets }, order)
}

#[cfg(test)]
mod tests {
    use cutis_coloring::greedy;
    use cutis_test_kit::Kuhn;

    use super::*;

    /// Places of the constraints in the order of tiles, and then of colors.
    fn places(tiles: &Tiles, order: &[u32]) -> Vec<usize> {
        let mut places = vec![0; order.len()];
        let colors = (tiles.offsets.len() - 1) / tiles.count;
        let mut place = 0;
        for tile in 0..tiles.count {
            for color in 0..colors {
                let part = &tiles.offsets[color * tiles.count + tile..][..2];
                for &k in &order[part[0] as usize..part[1] as usize] {
                    places[k as usize] = place;
                    place += 1;
                }
            }
        }
        places
    }

    /// Whether the constraints of each vertex have ascending places in the order of the colors.
    fn keeps_order(indices: &[[u32; 4]], groups: &Groups, count: usize, places: &[usize]) -> bool {
        let mut last = vec![None; count];
        groups.order.iter().all(|&k| {
            let place = Some(places[k as usize]);
            indices[k as usize].iter().all(|&vertex| last[vertex as usize].replace(place) < Some(place))
        })
    }

    #[test]
    fn constraints_that_share_a_vertex_keep_the_order_of_their_colors() {
        let lattice = Kuhn::new([5, 6, 40], 0.1);
        let (tets, count) = (&lattice.tets, lattice.positions.len());
        for groups in [Groups::from_colors(&lattice.tet_colors).unwrap(), greedy(tets, count).unwrap()] {
            let (tiles, order) = divide(tets, &groups, count);
            assert!(tiles.count > 10, "several tiles");
            let places = places(&tiles, &order);
            let mut sorted = places.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..tets.len()), "each constraint has one place");
            assert!(keeps_order(tets, &groups, count, &places));
            let tiles_in_use = |color: &[u32]| color.windows(2).filter(|part| part[0] < part[1]).count();
            let first = tiles_in_use(&tiles.offsets[..=tiles.count]);
            assert!(first == tiles.count, "the first color is in all tiles");
            let reversed: Vec<usize> = places.iter().map(|place| tets.len() - 1 - place).collect();
            assert!(!keeps_order(tets, &groups, count, &reversed), "the check can fail");
        }
    }

    #[test]
    fn a_small_body_has_one_tile_with_the_order_of_its_groups() {
        let lattice = Kuhn::new([3, 4, 5], 0.1);
        let groups = Groups::from_colors(&lattice.tet_colors).unwrap();
        let (tiles, order) = divide(&lattice.tets, &groups, lattice.positions.len());
        assert_eq!((tiles.count, tiles.offsets, order), (1, Vec::new(), groups.order));
    }
}
