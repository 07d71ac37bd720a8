//! Random bodies with materials, holes, cuts and fixed elements, and random drags.

use cutis_chainmail::{Chain, Drag, Material, NO_MATERIAL};
use proptest::collection::vec;
use proptest::prelude::*;

/// A body and a sequence of drags.
#[derive(Clone, Debug)]
pub struct Case {
    pub shape: [usize; 3],
    pub materials: Vec<Material>,
    pub element_materials: Vec<u8>,
    /// Links to cut, by element and axis. Links that do not exist are ignored.
    pub cuts: Vec<(u32, usize)>,
    pub fixed: Vec<u32>,
    pub drags: Vec<Vec<(u32, [f64; 3])>>,
}

fn material() -> impl Strategy<Value = Material> {
    let limits = (0.0..=1.0, 1.0..=3.0, 0.0..=1.5);
    let axes = [limits.clone(), limits.clone(), limits];
    prop_oneof![
        1 => Just(Material::RIGID),
        3 => (axes, 0.0..0.5).prop_map(|(axes, k)| Material {
            shortest: axes.map(|(shortest, _, _)| shortest),
            longest: axes.map(|(_, longest, _)| longest),
            shear: axes.map(|(_, _, shear)| shear),
            k,
        }),
    ]
}

/// Any body of at most 5 × 4 × 3 elements, with up to three drags of up to three elements each.
pub fn case() -> impl Strategy<Value = Case> {
    ([1_usize..=5, 1..=4, 1..=3], vec(material(), 1..=3)).prop_flat_map(|(shape, materials)| {
        let count = shape.iter().product::<usize>();
        let count_of_materials = materials.len() as u8;
        let element = 0..count as u32;
        let of = prop_oneof![9 => 0..count_of_materials, 1 => Just(NO_MATERIAL)];
        let to = [-6.0..9.0, -6.0..9.0, -6.0..9.0];
        (
            vec(of, count),
            vec((element.clone(), 0_usize..3), 0..=count / 3),
            vec(element.clone(), 0..=2),
            vec(vec((element, to), 1..=3), 1..=3),
        )
            .prop_map(move |(element_materials, cuts, fixed, drags)| Case {
                shape,
                materials: materials.clone(),
                element_materials,
                cuts,
                fixed,
                drags,
            })
    })
}

impl Case {
    /// Builds the body.
    pub fn chain(&self) -> Chain {
        let materials = self.element_materials.clone();
        let mut chain = Chain::new(self.shape, [1.0, 0.5, 2.0], &self.materials, materials).unwrap();
        chain.cut(|chain, a, b| {
            self.cuts.iter().any(|&(element, axis)| {
                element == a && chain.link(a, axis).is_some_and(|(next, _)| next == b)
            })
        });
        let fixed: Vec<u32> =
            self.fixed.iter().copied().filter(|&element| chain.has_element(element)).collect();
        chain.fix(&fixed).unwrap();
        chain
    }

    /// The drags without elements that are missing, fixed or repeated.
    pub fn drags(&self, chain: &Chain) -> Vec<Vec<Drag>> {
        let possible = |drags: &Vec<(u32, [f64; 3])>| {
            let mut list: Vec<Drag> = Vec::new();
            for &(element, to) in drags {
                let free = chain.has_element(element) && !chain.is_fixed(element);
                if free && list.iter().all(|drag| drag.element != element) {
                    list.push(Drag { element, to });
                }
            }
            list
        };
        self.drags.iter().map(possible).collect()
    }
}
