//! The whole scene of one person: every part in painting order.

use super::habitus::{self, Habitus};
use super::part::{Part, Surroundings};
use super::random::{Field, Random};
use super::{bowel, chest, organs, skeleton};

/// One person on the table.
pub(super) struct Anatomy {
    pub(super) person: Habitus,
    pub(super) parts: Vec<Part>,
    pub(super) surroundings: Surroundings,
}

impl Anatomy {
    /// The person `seed`; each region has its own stream of random numbers.
    pub(super) fn new(seed: u64) -> Self {
        let person = Habitus::new(&mut Random::new(seed, 0));
        let mut parts = vec![habitus::table()];
        parts.extend(person.walls());
        parts.extend(chest::parts(&person, &mut Random::new(seed, 1)));
        parts.extend(organs::parts(&person, &mut Random::new(seed, 2)));
        parts.extend(bowel::parts(&person, &mut Random::new(seed, 3)));
        parts.extend(organs::rear_parts(&person));
        parts.extend(skeleton::parts(&person, &mut Random::new(seed, 4)));
        let surroundings = Surroundings {
            cavity: person.cavity,
            wobble: Field::new(seed, 5, 22.0),
            grain: Field::new(seed, 6, 6.0),
        };
        Self { person, parts, surroundings }
    }
}

#[cfg(test)]
mod tests {
    use crate::VolumeError;
    use crate::phantom::Phantom;

    #[test]
    fn nothing_sticks_out_of_the_skin() -> Result<(), VolumeError> {
        for seed in 0..8 {
            let phantom = Phantom::new([32, 32, 48], seed)?;
            let volume = phantom.volume()?;
            let mut met = 0;
            for (index, &hu) in volume.voxels().iter().enumerate() {
                let at = volume.grid().mm(volume.grid().point(index)).map(|c| c as f32);
                let mut distance = [f32::INFINITY];
                phantom.anatomy.person.skin.lower_row(&[at.x], at.y, at.z, &mut distance);
                // Farther out than half the diagonal of a voxel, and above the edges of the table.
                if distance[0] > 12.0 && at.y > -70.0 {
                    met += 1;
                    assert!(hu < -900, "seed {seed}: {hu} HU at {at}");
                }
            }
            assert!(met > 5000, "only {met} voxels are outside");
        }
        Ok(())
    }
}
