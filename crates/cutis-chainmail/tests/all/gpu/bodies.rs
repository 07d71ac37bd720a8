//! Bodies that have everything: several materials, holes, cuts, fixed elements, and drags behind them that leave links beyond their bounds.

use cutis_chainmail::{Chain, Drag, Material, NO_MATERIAL, Order};

/// Shapes: one element, rows, sheets, and more elements than a workgroup has threads, along each axis.
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

/// Noise that is the same everywhere.
pub struct Noise(pub u64);

impl Noise {
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        (self.0 >> 33) as usize % end
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.below(10_001) as f64 / 1e4
    }
}

/// Soft, stiff across, rigid, plastic.
pub fn materials() -> [Material; 4] {
    [
        Material { shear: [0.3, 0.2, 0.25], ..Material::isotropic(0.7, 1.6, 0.0, 0.0) },
        Material { shortest: [0.5, 0.9, 0.0], longest: [2.0, 1.1, 3.0], shear: [1.5, 0.05, 0.4], k: 0.002 },
        Material::RIGID,
        Material::isotropic(0.2, 4.0, 2.0, 0.6),
    ]
}

/// A body at rest: regions of the materials, some of them single elements; a few holes, cuts and fixed elements.
pub fn at_rest(shape: [usize; 3], seed: u64) -> Chain {
    let mut noise = Noise(seed);
    let [nx, ny, nz] = shape;
    let regions = 3 + noise.below(3);
    let of = |element: usize| {
        let [i, j, k] = [element % nx, element / nx % ny, element / (nx * ny)];
        match noise.below(40) {
            0 => NO_MATERIAL,
            1 => noise.below(4) as u8,
            _ => [0, 1, 3, 0, 2][(i + 2 * j + k) / 9 % regions],
        }
    };
    let elements = (0..nx * ny * nz).map(of).collect();
    let mut chain = Chain::new(shape, [1.0, 0.5, 2.0], &materials(), elements).unwrap();
    cut_some(&mut chain, seed ^ 1);
    fix_some(&mut chain, seed ^ 2);
    chain
}

/// Cuts one link in twelve.
pub fn cut_some(chain: &mut Chain, seed: u64) {
    let mut noise = Noise(seed);
    let apart: Vec<bool> = (0..3 * chain.places()).map(|_| noise.below(12) == 0).collect();
    let count = chain.places();
    chain.cut(|_, a, b| apart[a as usize + if b == a + 1 { 0 } else { count }]);
}

/// Fixes one element in fifty, where they are.
pub fn fix_some(chain: &mut Chain, seed: u64) {
    let mut noise = Noise(seed);
    let count = chain.places();
    let some = (0..count as u32).filter(|_| noise.below(50) == 0);
    let fixed: Vec<u32> = some.filter(|&element| chain.is_there(element)).collect();
    chain.fix(&fixed).unwrap();
}

/// Drags a few elements far, which may contradict what is fixed; which ones.
pub fn drag_some(chain: &mut Chain, seed: u64) -> Vec<u32> {
    let mut noise = Noise(seed);
    let mut drags: Vec<Drag> = Vec::new();
    for _ in 0..3 {
        let element = noise.below(chain.places()) as u32;
        let free = chain.is_there(element) && !chain.is_fixed(element);
        if free && drags.iter().all(|drag| drag.element != element) {
            let to = chain.position(element).map(|at| at + noise.between(-7.0, 9.0));
            drags.push(Drag { element, to });
        }
    }
    chain.drag(&drags, Order::Fifo).unwrap();
    drags.iter().map(|drag| drag.element).collect()
}
