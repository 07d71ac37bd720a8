//! A body that is one plane of elements, with the drag applied to it.

use cutis_chainmail::{Chain, ChainError, Drag, Material, Order};

use super::look::{Line, Look};

/// The material of most specimens.
pub const SOFT: Material = Material::isotropic(0.5, 2.0, 0.25, 0.0);
/// A firmer material, in which a drag reaches farther.
pub const FIRM: Material = Material::isotropic(0.75, 1.25, 0.125, 0.0);
/// Number of the soft material.
pub const IS_SOFT: u8 = 0;
/// Number of the rigid material.
pub const IS_RIGID: u8 = 1;

/// A body with a spacing of 1 mm.
#[derive(Clone)]
pub struct Specimen {
    pub chain: Chain,
    materials: Vec<u8>,
    /// The grabbed element and its former position.
    pub grabbed: Option<(u32, [f64; 3])>,
}

impl Specimen {
    /// A body at rest. `of` gives the material number for a column and a row.
    pub fn new(
        [columns, rows]: [usize; 2],
        soft: Material,
        of: impl Fn(usize, usize) -> u8,
    ) -> Result<Self, ChainError> {
        let materials: Vec<u8> = (0..columns * rows).map(|e| of(e % columns, e / columns)).collect();
        let chain = Chain::new([columns, rows, 1], [1.0; 3], &[soft, Material::RIGID], materials.clone())?;
        Ok(Self { chain, materials, grabbed: None })
    }

    /// Moves an element with the wave algorithm.
    pub fn drag(&mut self, place: [usize; 2], by: [f64; 2]) -> Result<(), ChainError> {
        let drag = self.grab(place, by);
        self.chain.drag(&[drag], Order::Fifo)?;
        Ok(())
    }

    /// Moves an element with the classic algorithm.
    pub fn drag_classic(&mut self, place: [usize; 2], by: [f64; 2]) -> Result<(), ChainError> {
        let drag = self.grab(place, by);
        self.chain.drag_classic(drag)?;
        Ok(())
    }

    /// A copy in which an element is marked as grabbed but has not moved.
    pub fn with_grabbed(&self, place: [usize; 2]) -> Self {
        let mut specimen = self.clone();
        specimen.grab(place, [0.0; 2]);
        specimen
    }

    fn grab(&mut self, [column, row]: [usize; 2], [x, y]: [f64; 2]) -> Drag {
        let element = self.chain.element([column, row, 0]);
        let at = self.chain.position(element);
        self.grabbed = Some((element, at));
        Drag { element, to: [at[0] + x, at[1] + y, at[2]] }
    }

    /// The elements with their looks.
    pub fn elements(&self) -> impl Iterator<Item = (u32, Look)> {
        let there = (0..self.chain.places() as u32).filter(|&element| self.chain.has_element(element));
        there.map(|element| (element, self.look(element)))
    }

    fn look(&self, element: u32) -> Look {
        if self.grabbed.is_some_and(|(grabbed, _)| grabbed == element) {
            Look::Grabbed
        } else if self.chain.is_fixed(element) {
            Look::Fixed
        } else if self.materials[element as usize] == IS_RIGID {
            Look::Rigid
        } else if self.distance(element) == 0.0 {
            Look::Unmoved
        } else {
            Look::Soft
        }
    }

    /// Distance of an element from its rest position in steps.
    pub fn distance(&self, element: u32) -> f64 {
        self.chain.displacement(element).iter().map(|by| by * by).sum::<f64>().sqrt()
    }

    /// The links with their looks.
    pub fn links(&self) -> impl Iterator<Item = ([u32; 2], Line)> {
        let link = |element, axis| {
            let (next, bounds) = self.chain.link(element, axis)?;
            let (from, to) = (self.chain.units(element), self.chain.units(next));
            let any = |is: fn(i32, [i32; 2]) -> bool| (0..3).any(|c| is(to[c] - from[c], bounds[c]));
            let line = if any(|apart, [lo, hi]| apart < lo || apart > hi) {
                Line::Beyond
            } else if any(|apart, [lo, hi]| lo < hi && (apart == lo || apart == hi)) {
                Line::AtLimit
            } else {
                Line::Within
            };
            Some(([element, next], line))
        };
        (0..self.chain.places() as u32)
            .flat_map(move |element| (0..2).filter_map(move |axis| link(element, axis)))
    }
}
