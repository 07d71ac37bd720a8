//! The build of a person: outlines of skin, muscle and body cavity, the curve of the spine, and the
//! scanner table.
//!
//! All positions are in RAS+ millimeters: x to the right, y to the front, z to the head. The lowest
//! ribs are near z = 0.

use super::layered_solid::{Layer, LayeredSolid, grainy, layer};
use super::outline::Outline;
use super::profile::Profile;
use super::random::Random;
use super::solid::{Board, Solid};

/// Depth of the back below the origin in mm. The back is flat, because the person lies on it.
const BACK_MM: f32 = 100.0;
/// Shape of the outlines, between an ellipse (0) and a rounded box (1).
const SQUARENESS: f32 = 0.3;
/// Layers of muscle with planes of fat between them.
const MUSCLE: [Layer; 5] = [
    grainy(0.0, 52.0, 14.0),
    layer(5.0, -45.0),
    grainy(6.0, 54.0, 14.0),
    layer(10.0, -30.0),
    grainy(10.8, 54.0, 14.0),
];
/// Distance between the skin of the back and the table in mm.
const TABLE_GAP_MM: f32 = 12.0;

/// Outlines of one person.
pub(super) struct Habitus {
    pub(super) skin: Outline,
    pub(super) muscle: Outline,
    pub(super) cavity: Outline,
    spine: Profile,
    width: f32,
    depth: f32,
}

impl Habitus {
    /// Creates a person of random width, depth and amount of fat.
    pub(super) fn new(random: &mut Random) -> Self {
        let width = random.between(0.94, 1.05);
        let depth = random.between(0.94, 1.08);
        let fatness = random.between(0.75, 1.3);

        // Knots from z = −300 (hips) to 300 (upper chest), every 100 mm.
        let side = Profile::new([172.0, 170.0, 161.0, 154.0, 158.0, 163.0, 158.0]).scaled(width);
        let front = Profile::new([92.0, 101.0, 109.0, 109.0, 109.0, 107.0, 95.0]).scaled(depth);
        let back = Profile::new([BACK_MM; 7]);
        let skin = Outline { side, front, back, squareness: SQUARENESS };

        let fat_side = Profile::new([28.0, 27.0, 25.0, 18.0, 12.0, 10.0, 10.0]);
        let fat_front = Profile::new([18.0, 24.0, 25.0, 20.0, 13.0, 11.0, 11.0]);
        let fat_back = Profile::new([20.0, 18.0, 14.0, 11.0, 10.0, 10.0, 10.0]);
        let muscle = Outline {
            side: side.plus(&fat_side, -fatness),
            front: front.plus(&fat_front, -fatness),
            back: back.plus(&fat_back, -1.0),
            squareness: SQUARENESS,
        };

        let wall_side = Profile::new([58.0, 46.0, 17.0, 14.0, 15.0, 16.0, 20.0]);
        let wall_front = Profile::new([18.0, 13.0, 12.0, 12.0, 15.0, 17.0, 20.0]);
        let wall_back = Profile::new([20.0, 22.0, 30.0, 26.0, 15.0, 15.0, 18.0]);
        let cavity = Outline {
            side: muscle.side.plus(&wall_side, -1.0),
            front: muscle.front.plus(&wall_front, -1.0),
            back: muscle.back.plus(&wall_back, -1.0),
            squareness: SQUARENESS,
        };

        let spine = Profile::new([-66.0, -58.0, -34.0, -36.0, -46.0, -50.0, -46.0]);
        Self { skin, muscle, cavity, spine, width, depth }
    }

    /// Maps a position in the average person to the position in this one.
    pub(super) fn place(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        [x * self.width, if y > 0.0 { y * self.depth } else { y }, z]
    }

    /// The y coordinate of the middle of the vertebral column at height `z`.
    pub(super) fn spine(&self, z: f32) -> f32 {
        self.spine.at(z)
    }

    /// Skin with subcutaneous fat, the muscle wall, and the body cavity filled with fat.
    pub(super) fn walls(&self) -> Vec<LayeredSolid> {
        vec![
            LayeredSolid::new([Solid::Outline(self.skin)], [layer(0.0, 25.0), grainy(2.0, -102.0, 12.0)]),
            LayeredSolid::new([Solid::Outline(self.muscle)], MUSCLE).wobbly(1.5),
            LayeredSolid::new([Solid::Outline(self.cavity)], [grainy(0.0, -98.0, 14.0)]).wobbly(1.0),
        ]
    }
}

/// The scanner table: a carbon shell around foam.
pub(super) fn table() -> LayeredSolid {
    let board = Board { top: -BACK_MM - TABLE_GAP_MM, thickness: 26.0, half_width: 185.0, bend: 620.0 };
    LayeredSolid::new([Solid::Board(board)], [layer(0.0, -20.0), layer(4.5, -925.0)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_of_every_person_are_nested_and_fit_the_field_of_view() {
        for seed in 0..200 {
            let person = Habitus::new(&mut Random::new(seed, 0));
            for z in (-300..=300).step_by(10).map(|z| z as f32) {
                let outlines = [person.skin, person.muscle, person.cavity];
                let radii = outlines.map(|o| [o.side.at(z), o.front.at(z), o.back.at(z)]);
                for c in 0..3 {
                    assert!(radii[0][c] < 195.0 && radii[2][c] > 30.0, "seed {seed}, z {z}: {radii:?}");
                    assert!(radii[0][c] > radii[1][c] + 5.0 && radii[1][c] > radii[2][c] + 5.0);
                }
            }
        }
    }
}
