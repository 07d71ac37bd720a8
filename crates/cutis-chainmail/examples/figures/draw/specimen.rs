//! A body of one plane of elements, and what has been done to it.

use cutis_chainmail::{Chain, ChainError, Drag, Material, Order};

use super::look::{Line, Look};

/// What most bodies are made of.
pub const SOFT: Material = Material::isotropic(0.5, 2.0, 0.25, 0.0);
/// Firmer, so that a drag is felt far away.
pub const FIRM: Material = Material::isotropic(0.75, 1.25, 0.125, 0.0);
/// Number of a body's soft material.
pub const IS_SOFT: u8 = 0;
/// Number of what keeps its shape.
pub const IS_RIGID: u8 = 1;

/// A body at 1 mm.
#[derive(Clone)]
pub struct Body {
    pub chain: Chain,
    materials: Vec<u8>,
    /// What was grabbed, and where it was before.
    pub pulled: Option<(u32, [f64; 3])>,
}

impl Body {
    /// A body at rest, of `soft` where `of` says [`IS_SOFT`] of a column and a row.
    pub fn new(
        [columns, rows]: [usize; 2],
        soft: Material,
        of: impl Fn(usize, usize) -> u8,
    ) -> Result<Self, ChainError> {
        let materials: Vec<u8> = (0..columns * rows).map(|e| of(e % columns, e / columns)).collect();
        let chain = Chain::new([columns, rows, 1], [1.0; 3], &[soft, Material::RIGID], materials.clone())?;
        Ok(Self { chain, materials, pulled: None })
    }

    /// Moves an element, and by the wave all that must follow.
    pub fn pull(&mut self, place: [usize; 2], by: [f64; 2]) -> Result<(), ChainError> {
        let drag = self.grab(place, by);
        self.chain.drag(&[drag], Order::Fifo)?;
        Ok(())
    }

    /// The same in the order of classic ChainMail.
    pub fn pull_classic(&mut self, place: [usize; 2], by: [f64; 2]) -> Result<(), ChainError> {
        let drag = self.grab(place, by);
        self.chain.drag_classic(drag)?;
        Ok(())
    }

    /// The same body with an element that is about to be moved.
    pub fn about_to_pull(&self, place: [usize; 2]) -> Self {
        let mut body = self.clone();
        body.grab(place, [0.0; 2]);
        body
    }

    fn grab(&mut self, [column, row]: [usize; 2], [x, y]: [f64; 2]) -> Drag {
        let element = self.chain.element([column, row, 0]);
        let at = self.chain.position(element);
        self.pulled = Some((element, at));
        Drag { element, to: [at[0] + x, at[1] + y, at[2]] }
    }

    /// The elements, and how each is drawn.
    pub fn elements(&self) -> impl Iterator<Item = (u32, Look)> {
        let there = (0..self.chain.places() as u32).filter(|&element| self.chain.is_there(element));
        there.map(|element| (element, self.look(element)))
    }

    fn look(&self, element: u32) -> Look {
        if self.pulled.is_some_and(|(pulled, _)| pulled == element) {
            Look::Grabbed
        } else if self.chain.is_fixed(element) {
            Look::Fixed
        } else if self.materials[element as usize] == IS_RIGID {
            Look::Rigid
        } else if self.distance(element) == 0.0 {
            Look::Still
        } else {
            Look::Soft
        }
    }

    /// How far an element is from where it rests, in steps.
    pub fn distance(&self, element: u32) -> f64 {
        self.chain.displacement(element).iter().map(|by| by * by).sum::<f64>().sqrt()
    }

    /// The links, and how each is drawn.
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
