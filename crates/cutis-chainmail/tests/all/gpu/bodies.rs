//! Bodies with several materials, holes, cuts, fixed elements and drags that leave violated links.

use cutis_chainmail::{Chain, Drag, Material, NO_MATERIAL, Order};
use cutis_test_kit::Random;

/// Shapes: one element, rows, sheets, and lengths beyond a workgroup along each axis.
pub const SHAPES: [[usize; 3]; 11] = [
    [1, 1, 1],
    [150, 1, 1],
    [1, 131, 1],
    [1, 1, 140],
    [2, 2, 2],
    [17, 9, 1],
    [1, 19, 12],
    [23, 1, 8],
    [40, 9, 7],
    [19, 21, 3],
    [5, 6, 37],
];

/// A soft, an anisotropic, a rigid and a plastic material.
pub fn materials() -> [Material; 4] {
    [
        Material { shear: [0.3, 0.2, 0.25], ..Material::isotropic(0.7, 1.6, 0.0, 0.0) },
        Material { shortest: [0.5, 0.9, 0.0], longest: [2.0, 1.1, 3.0], shear: [1.5, 0.05, 0.4], k: 0.002 },
        Material::RIGID,
        Material::isotropic(0.2, 4.0, 2.0, 0.6),
    ]
}

/// A body at rest with regions of each material, single elements, holes, cuts and fixed elements.
pub fn at_rest(shape: [usize; 3], seed: u64) -> Chain {
    let mut random = Random::new(seed);
    let [nx, ny, nz] = shape;
    let regions = 3 + random.below(3);
    let material = |element: usize| {
        let [i, j, k] = [element % nx, element / nx % ny, element / (nx * ny)];
        match random.below(40) {
            0 => NO_MATERIAL,
            1 => random.below(4) as u8,
            _ => [0, 1, 3, 0, 2][(i + 2 * j + k) / 9 % regions],
        }
    };
    let elements = (0..nx * ny * nz).map(material).collect();
    let mut chain = Chain::new(shape, [1.0, 0.5, 2.0], &materials(), elements).unwrap();
    cut_some(&mut chain, seed ^ 1);
    fix_some(&mut chain, seed ^ 2);
    chain
}

/// Cuts one link in twelve.
pub fn cut_some(chain: &mut Chain, seed: u64) {
    let mut random = Random::new(seed);
    let apart: Vec<bool> = (0..3 * chain.places()).map(|_| random.below(12) == 0).collect();
    let count = chain.places();
    chain.cut(|_, a, b| apart[a as usize + if b == a + 1 { 0 } else { count }]);
}

/// Fixes one element in fifty.
pub fn fix_some(chain: &mut Chain, seed: u64) {
    let mut random = Random::new(seed);
    let count = chain.places();
    let some = (0..count as u32).filter(|_| random.below(50) == 0);
    let fixed: Vec<u32> = some.filter(|&element| chain.has_element(element)).collect();
    chain.fix(&fixed).unwrap();
}

/// Drags up to three elements far, which may contradict fixed elements. Returns the elements.
pub fn drag_some(chain: &mut Chain, seed: u64) -> Vec<u32> {
    let mut random = Random::new(seed);
    let mut drags: Vec<Drag> = Vec::new();
    for _ in 0..3 {
        let element = random.below(chain.places()) as u32;
        let free = chain.has_element(element) && !chain.is_fixed(element);
        if free && drags.iter().all(|drag| drag.element != element) {
            let to = chain.position(element).map(|at| at + random.between(-7.0, 9.0));
            drags.push(Drag { element, to });
        }
    }
    chain.drag(&drags, Order::Fifo).unwrap();
    drags.iter().map(|drag| drag.element).collect()
}
