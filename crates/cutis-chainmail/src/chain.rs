//! The chain: elements, what they are made of, and where they are.

use crate::ChainError;
use crate::blade::Blade;
use crate::census::{Census, MIXED, STILL};
use crate::limits::{Bounds, Limits};
use crate::links::{Links, Neighbor};
use crate::material::{self, Material};
use crate::units::{FARTHEST_MOVED, UNITS_PER_STEP, to_steps};
use crate::wide::Width;

/// The material of a place of the grid where there is nothing.
pub const NO_MATERIAL: u8 = u8::MAX;

/// A grid of elements, and links between neighbors: 17 bytes for each place of the grid, 18 once it is relaxed.
///
/// Element `(i, j, k)` is number `i + nx (j + ny k)`. It is at rest at `(i, j, k)` steps.
#[derive(Clone, Debug)]
pub struct Chain {
    pub(crate) body: Body,
    pub(crate) spacing_mm: [f64; 3],
    /// By coordinate, in units.
    pub(crate) positions: [Vec<i32>; 3],
    /// By coordinate: what a drag notes, and 0 between drags.
    pub(crate) flags: [Vec<u8>; 3],
    /// Fixed elements that a drag would have had to move: the next one begins with them too.
    pub(crate) strained: Vec<u32>,
    /// How elements can be relaxed; empty before it was first asked.
    pub(crate) census: Census,
    /// By row along the first axis: something in it may have changed since it was last relaxed.
    pub(crate) changed: Vec<bool>,
    /// What relaxation computes with; the outcome is the same.
    pub(crate) width: Width,
}

/// What of a chain a drag does not change.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) links: Links,
    pub(crate) materials: Vec<u8>,
    pub(crate) limits: Limits,
}

impl Body {
    /// The bounds of a link.
    #[inline]
    pub(crate) fn bounds(&self, element: u32, neighbor: Neighbor, coordinate: usize) -> Bounds {
        let [a, b] = [element, neighbor.element].map(|element| self.materials[element as usize]);
        self.limits.of(coordinate, self.limits.pair(a, b), neighbor.axis)
    }
}

impl Chain {
    /// A chain at rest. `element_materials`: for each place of the grid a number in `materials`, or [`NO_MATERIAL`].
    ///
    /// # Errors
    /// [`ChainError::Shape`], [`ChainError::Spacing`], [`ChainError::Length`], [`ChainError::NoSuchMaterial`], and those of
    /// materials.
    pub fn new(
        shape: [usize; 3],
        spacing_mm: [f64; 3],
        materials: &[Material],
        element_materials: Vec<u8>,
    ) -> Result<Self, ChainError> {
        material::check_all(materials.iter())?;
        if !spacing_mm.iter().all(|step| step.is_finite() && *step > 0.0) {
            return Err(ChainError::Spacing { spacing_mm });
        }
        let there = |element: usize| element_materials.get(element).is_some_and(|&m| m != NO_MATERIAL);
        let links = Links::new(shape, there)?;
        if element_materials.len() != links.len() {
            let (found, expected) = (element_materials.len(), links.len());
            return Err(ChainError::Length { what: "materials of elements", found, expected });
        }
        let known = |m: u8| m == NO_MATERIAL || usize::from(m) < materials.len();
        if let Some(element) = element_materials.iter().position(|&m| !known(m)) {
            let material = element_materials[element];
            return Err(ChainError::NoSuchMaterial { element, material, count: materials.len() });
        }
        let [nx, ny, _] = shape;
        let strides = [1, nx, nx * ny];
        let at_rest = |axis: usize| {
            let rest = |element: usize| (element / strides[axis] % shape[axis]) as i32 * UNITS_PER_STEP;
            (0..links.len()).map(rest).collect()
        };
        Ok(Self {
            positions: [0, 1, 2].map(at_rest),
            flags: [0, 1, 2].map(|_| vec![0; links.len()]),
            body: Body { links, limits: Limits::new(materials, spacing_mm), materials: element_materials },
            strained: Vec::new(),
            census: Census::default(),
            changed: vec![false; shape[1] * shape[2]],
            width: Width::widest(),
            spacing_mm,
        })
    }

    /// Elements along each axis.
    pub fn shape(&self) -> [usize; 3] {
        self.body.links.shape()
    }

    /// Places of the grid, empty or not.
    pub fn places(&self) -> usize {
        self.body.links.len()
    }

    /// Number of the element at a place of the grid.
    pub fn element(&self, [i, j, k]: [usize; 3]) -> u32 {
        let [nx, ny, _] = self.shape();
        (i + nx * (j + ny * k)) as u32
    }

    /// Whether there is an element.
    pub fn is_there(&self, element: u32) -> bool {
        self.body.materials.get(element as usize).is_some_and(|&material| material != NO_MATERIAL)
    }

    /// Where an element is, in steps; exact.
    pub fn position(&self, element: u32) -> [f64; 3] {
        self.units(element).map(to_steps)
    }

    /// How far an element is from where it rests, in steps; exact.
    pub fn displacement(&self, element: u32) -> [f64; 3] {
        let place = self.body.links.place(element);
        let position = self.position(element);
        [0, 1, 2].map(|axis| position[axis] - place[axis] as f64)
    }

    /// Where an element is, in units of a step over [`UNITS_PER_STEP`].
    pub fn units(&self, element: u32) -> [i32; 3] {
        [0, 1, 2].map(|axis| self.positions[axis][element as usize])
    }

    /// Fixes elements where they are, for good.
    ///
    /// # Errors
    /// [`ChainError::NoSuchElement`]; then none is fixed.
    pub fn fix(&mut self, elements: &[u32]) -> Result<(), ChainError> {
        elements.iter().try_for_each(|&element| self.check_element(element))?;
        for &element in elements {
            self.body.links.set_fixed(element);
            if let Some(state) = self.census.of.get_mut(element as usize) {
                *state = STILL;
            }
        }
        Ok(())
    }

    /// Whether an element is fixed.
    pub fn is_fixed(&self, element: u32) -> bool {
        self.is_there(element) && self.body.links.is_fixed(element)
    }

    /// Elements linked with an element.
    pub fn neighbors(&self, element: u32) -> impl Iterator<Item = u32> {
        self.is_there(element).then(|| self.body.links.of(element)).into_iter().flatten().map(|n| n.element)
    }

    /// The link of an element to the one after it along an axis: that element, and for each coordinate the least and the most that it may
    /// be ahead, in units.
    pub fn link(&self, element: u32, axis: usize) -> Option<(u32, [[i32; 2]; 3])> {
        let next = self.is_there(element).then(|| self.body.links.next(element, axis)).flatten()?;
        let neighbor = Neighbor { element: next, axis, next: true };
        let bounds = [0, 1, 2].map(|coordinate| self.body.bounds(element, neighbor, coordinate));
        Some((next, bounds.map(|Bounds { lo, hi }| [lo, hi])))
    }

    /// Removes the links for which `apart` says so of the elements before and after; how many there were. Asks about every link
    /// in order of the elements.
    pub fn cut(&mut self, apart: impl Fn(&Self, u32, u32) -> bool) -> usize {
        let mut cut = 0;
        for element in 0..self.places() as u32 {
            for axis in 0..3 {
                let next = self.body.links.next(element, axis);
                if next.is_some_and(|next| apart(self, element, next)) {
                    cut += usize::from(self.cut_link(element, axis));
                }
            }
        }
        cut
    }

    /// Removes the links that a blade crosses, where they are now; how many there were.
    pub fn cut_with(&mut self, blade: &Blade) -> usize {
        self.cut(|chain, a, b| blade.crosses(chain.position(a), chain.position(b)))
    }

    /// Removes the links between elements for which `mask` differs; how many there were.
    ///
    /// # Errors
    /// [`ChainError::Length`].
    pub fn cut_mask(&mut self, mask: &[bool]) -> Result<usize, ChainError> {
        let (found, expected) = (mask.len(), self.places());
        if found != expected {
            return Err(ChainError::Length { what: "mask of a cut", found, expected });
        }
        Ok(self.cut(|_, a, b| mask[a as usize] != mask[b as usize]))
    }

    /// Removes the links between pairs of elements; how many there were.
    pub fn cut_links(&mut self, pairs: &[[u32; 2]]) -> usize {
        let mut cut = 0;
        for [a, b] in pairs.iter().map(|[a, b]| [*a.min(b), *a.max(b)]) {
            let links = &self.body.links;
            if (b as usize) < links.len()
                && let Some(axis) = (0..3).find(|&axis| links.next(a, axis) == Some(b))
            {
                cut += usize::from(self.cut_link(a, axis));
            }
        }
        cut
    }

    /// Removes the link of an element to the one after it; whether there was one.
    fn cut_link(&mut self, element: u32, axis: usize) -> bool {
        let Some(next) = self.body.links.next(element, axis) else { return false };
        for end in [element, next] {
            if let Some(state) = self.census.of.get_mut(end as usize).filter(|state| **state != STILL) {
                *state = MIXED;
            }
        }
        self.mark_changed(element);
        self.body.links.cut(element, axis)
    }

    /// Number of links.
    pub fn links(&self) -> usize {
        let next =
            |element: u32| (0..3).filter(|&axis| self.body.links.next(element, axis).is_some()).count();
        (0..self.places() as u32).map(next).sum()
    }

    /// Bytes that are stored once the chain has been relaxed, by part: coordinates, links with what is fixed, materials, and
    /// what drags and relaxation note.
    pub fn bytes(&self) -> [(&'static str, usize); 4] {
        let count = self.places();
        let coordinates = 3 * count * size_of::<i32>();
        [("coordinates", coordinates), ("links", count), ("materials", count), ("marks", 4 * count)]
    }

    /// Fixed elements that the last drag would have had to move; what a saved state needs beside the positions.
    pub fn strained(&self) -> &[u32] {
        &self.strained
    }

    /// Goes on from a saved state: where elements are, in units, and what [`Chain::strained`] said. Other elements stay where they
    /// are.
    ///
    /// # Errors
    /// [`ChainError::NoSuchElement`], [`ChainError::TooFar`]; then nothing moves.
    pub fn restore(&mut self, units: &[(u32, [i32; 3])], strained: &[u32]) -> Result<(), ChainError> {
        for &(element, to) in units {
            self.check_element(element)?;
            if to.iter().any(|units| units.unsigned_abs() > FARTHEST_MOVED) {
                return Err(ChainError::TooFar { element, to: to.map(to_steps) });
            }
        }
        strained.iter().try_for_each(|&element| self.check_element(element))?;
        for &(element, to) in units {
            (0..3).for_each(|axis| self.positions[axis][element as usize] = to[axis]);
        }
        self.strained = strained.to_vec();
        self.changed.fill(true);
        Ok(())
    }

    /// Notes that relaxation has to look at an element's row and those beside it.
    pub(crate) fn mark_changed(&mut self, element: u32) {
        self.changed[element as usize / self.body.links.shape()[0]] = true;
    }

    pub(crate) fn check_element(&self, element: u32) -> Result<(), ChainError> {
        if self.is_there(element) {
            return Ok(());
        }
        Err(ChainError::NoSuchElement { element, count: self.places() })
    }
}
