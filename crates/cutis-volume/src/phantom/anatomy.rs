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
