//! The anatomy of one person: all solids in painting order.

use super::habitus::{self, Habitus};
use super::layered_solid::{LayeredSolid, Surroundings};
use super::random::{Field, Random};
use super::{bowel, chest, organs, skeleton};

/// One person on the scanner table.
pub(super) struct Anatomy {
    pub(super) person: Habitus,
    pub(super) solids: Vec<LayeredSolid>,
    pub(super) surroundings: Surroundings,
}

impl Anatomy {
    /// Creates the person with number `seed`. Each region has its own stream of random numbers.
    pub(super) fn new(seed: u64) -> Self {
        let person = Habitus::new(&mut Random::new(seed, 0));
        let mut solids = vec![habitus::table()];
        solids.extend(person.walls());
        solids.extend(chest::solids(&person, &mut Random::new(seed, 1)));
        solids.extend(organs::solids(&person, &mut Random::new(seed, 2)));
        solids.extend(bowel::solids(&person, &mut Random::new(seed, 3)));
        solids.extend(organs::rear_solids(&person));
        solids.extend(skeleton::solids(&person, &mut Random::new(seed, 4)));
        let surroundings = Surroundings {
            cavity: person.cavity,
            wobble: Field::new(seed, 5, 22.0),
            grain: Field::new(seed, 6, 6.0),
        };
        Self { person, solids, surroundings }
    }
}

#[cfg(test)]
mod tests {
    use crate::VolumeError;
    use crate::phantom::Phantom;

    #[test]
    fn no_tissue_lies_outside_the_skin() -> Result<(), VolumeError> {
        for seed in 0..8 {
            let phantom = Phantom::new([32, 32, 48], seed)?;
            let volume = phantom.volume()?;
            let mut checked = 0;
            for (index, &hu) in volume.voxels().iter().enumerate() {
                let at = volume.grid().mm(volume.grid().point(index)).map(|c| c as f32);
                let mut distance = [f32::INFINITY];
                phantom.anatomy.person.skin.lower_row(&[at.x], at.y, at.z, &mut distance);
                // Outside by more than half the diagonal of a voxel, and above the edges of the
                // table.
                if distance[0] > 12.0 && at.y > -70.0 {
                    checked += 1;
                    assert!(hu < -900, "seed {seed}: {hu} HU at {at}");
                }
            }
            assert!(checked > 5000, "only {checked} voxels are outside");
        }
        Ok(())
    }
}
