//! The chain: a grid of elements, their materials, their links and their positions.

use crate::ChainError;
use crate::limits::{Bounds, Limits};
use crate::links::{Links, Neighbor};
use crate::material::{self, Material};
use crate::neighborhood::{IMMOBILE, NeighborhoodClasses, UNCLASSIFIED};
use crate::simd::SimdLevel;
use crate::units::{FARTHEST_MOVED, UNITS_PER_STEP, to_steps};

/// Material number of a grid point without an element.
pub const NO_MATERIAL: u8 = u8::MAX;

/// A grid of elements with links between neighbors.
///
/// Element `(i, j, k)` has the number `i + nx (j + ny k)` and rests at `(i, j, k)` steps. A chain
/// takes 17 bytes per grid point, and 18 after the first relaxation.
#[derive(Clone, Debug)]
pub struct Chain {
    pub(crate) structure: Structure,
    pub(crate) spacing_mm: [f64; 3],
    /// Positions by coordinate, in units.
    pub(crate) positions: [Vec<i32>; 3],
    /// Flags of a drag by coordinate. They are 0 between drags.
    pub(crate) flags: [Vec<u8>; 3],
    /// Fixed elements that the last drag would have had to move. The next drag starts with them
    /// too.
    pub(crate) strained: Vec<u32>,
    /// Classes of elements that relax together; empty until the first relaxation.
    pub(crate) classes: NeighborhoodClasses,
    /// For each row along the first axis: true if it may have changed since the last relaxation.
    pub(crate) changed: Vec<bool>,
    /// Instruction set of the relaxation. It does not change the result.
    pub(crate) simd: SimdLevel,
}

/// The part of a chain that a drag does not change.
#[derive(Clone, Debug)]
pub(crate) struct Structure {
    pub(crate) links: Links,
    pub(crate) materials: Vec<u8>,
    pub(crate) limits: Limits,
}

impl Structure {
    /// Bounds of one coordinate of a link.
    #[inline]
    pub(crate) fn bounds(&self, element: u32, neighbor: Neighbor, coordinate: usize) -> Bounds {
        let [a, b] = [element, neighbor.element].map(|element| self.materials[element as usize]);
        self.limits.of(coordinate, self.limits.pair(a, b), neighbor.axis)
    }
}

impl Chain {
    /// Creates a chain at rest.
    ///
    /// `shape` is the number of grid points along each axis, and `spacing_mm` their distance.
    /// `element_materials` has one entry for each grid point: an index into `materials`, or
    /// [`NO_MATERIAL`].
    ///
    /// # Errors
    /// [`ChainError::Shape`], [`ChainError::Spacing`], [`ChainError::Length`],
    /// [`ChainError::NoSuchMaterial`], [`ChainError::MaterialCount`] and [`ChainError::Material`].
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
            structure: Structure {
                links,
                limits: Limits::new(materials, spacing_mm),
                materials: element_materials,
            },
            strained: Vec::new(),
            classes: NeighborhoodClasses::default(),
            changed: vec![false; shape[1] * shape[2]],
            simd: SimdLevel::best(),
            spacing_mm,
        })
    }

    /// Number of grid points along each axis.
    pub fn shape(&self) -> [usize; 3] {
        self.structure.links.shape()
    }

    /// Number of grid points, with or without an element.
    pub fn places(&self) -> usize {
        self.structure.links.len()
    }

    /// Number of the element at a grid point.
    pub fn element(&self, [i, j, k]: [usize; 3]) -> u32 {
        let [nx, ny, _] = self.shape();
        (i + nx * (j + ny * k)) as u32
    }

    /// True if there is an element with this number.
    pub fn has_element(&self, element: u32) -> bool {
        self.structure.materials.get(element as usize).is_some_and(|&material| material != NO_MATERIAL)
    }

    /// Position of an element in steps, without rounding.
    pub fn position(&self, element: u32) -> [f64; 3] {
        self.units(element).map(to_steps)
    }

    /// Displacement of an element from its rest position in steps, without rounding.
    pub fn displacement(&self, element: u32) -> [f64; 3] {
        let place = self.structure.links.place(element);
        let position = self.position(element);
        [0, 1, 2].map(|axis| position[axis] - place[axis] as f64)
    }

    /// Position of an element in units; a step has [`UNITS_PER_STEP`] of them.
    pub fn units(&self, element: u32) -> [i32; 3] {
        [0, 1, 2].map(|axis| self.positions[axis][element as usize])
    }

    /// Fixes elements permanently at their present positions.
    ///
    /// # Errors
    /// [`ChainError::NoSuchElement`]; then no element is fixed.
    pub fn fix(&mut self, elements: &[u32]) -> Result<(), ChainError> {
        elements.iter().try_for_each(|&element| self.check_element(element))?;
        for &element in elements {
            self.structure.links.set_fixed(element);
            if let Some(state) = self.classes.class_of.get_mut(element as usize) {
                *state = IMMOBILE;
            }
        }
        Ok(())
    }

    /// True if an element is fixed.
    pub fn is_fixed(&self, element: u32) -> bool {
        self.has_element(element) && self.structure.links.is_fixed(element)
    }

    /// The elements that are linked with an element.
    pub fn neighbors(&self, element: u32) -> impl Iterator<Item = u32> {
        self.has_element(element)
            .then(|| self.structure.links.of(element))
            .into_iter()
            .flatten()
            .map(|n| n.element)
    }

    /// The link from an element to the next one along an axis.
    ///
    /// Returns the next element and, for each coordinate, the smallest and the largest allowed
    /// difference `next − element` in units.
    pub fn link(&self, element: u32, axis: usize) -> Option<(u32, [[i32; 2]; 3])> {
        let next = self.has_element(element).then(|| self.structure.links.next(element, axis)).flatten()?;
        let neighbor = Neighbor { element: next, axis, next: true };
        let bounds = [0, 1, 2].map(|coordinate| self.structure.bounds(element, neighbor, coordinate));
        Some((next, bounds.map(|Bounds { lo, hi }| [lo, hi])))
    }

    /// Removes every link for which `apart(chain, element, next)` is true, and returns how many it
    /// removed. `apart` is called for all links, in the order of the elements.
    pub fn cut(&mut self, apart: impl Fn(&Self, u32, u32) -> bool) -> usize {
        let mut cut = 0;
        for element in 0..self.places() as u32 {
            for axis in 0..3 {
                let next = self.structure.links.next(element, axis);
                if next.is_some_and(|next| apart(self, element, next)) {
                    cut += usize::from(self.cut_link(element, axis));
                }
            }
        }
        cut
    }

    /// Removes the links between pairs of elements and returns how many it removed.
    pub fn cut_links(&mut self, pairs: &[[u32; 2]]) -> usize {
        let mut cut = 0;
        for [a, b] in pairs.iter().map(|[a, b]| [*a.min(b), *a.max(b)]) {
            let links = &self.structure.links;
            if (b as usize) < links.len()
                && let Some(axis) = (0..3).find(|&axis| links.next(a, axis) == Some(b))
            {
                cut += usize::from(self.cut_link(a, axis));
            }
        }
        cut
    }

    /// Removes the link to the next element along an axis. Returns true if there was one.
    fn cut_link(&mut self, element: u32, axis: usize) -> bool {
        let Some(next) = self.structure.links.next(element, axis) else { return false };
        for end in [element, next] {
            if let Some(state) =
                self.classes.class_of.get_mut(end as usize).filter(|state| **state != IMMOBILE)
            {
                *state = UNCLASSIFIED;
            }
        }
        self.mark_changed(element);
        self.structure.links.cut(element, axis)
    }

    /// Number of links.
    pub fn links(&self) -> usize {
        let next =
            |element: u32| (0..3).filter(|&axis| self.structure.links.next(element, axis).is_some()).count();
        (0..self.places() as u32).map(next).sum()
    }

    /// Memory of the chain in bytes, by part, after the first relaxation. `links` includes which
    /// elements are fixed; `marks` are the working data of drags and relaxation.
    pub fn bytes(&self) -> [(&'static str, usize); 4] {
        let count = self.places();
        let coordinates = 3 * count * size_of::<i32>();
        [("coordinates", coordinates), ("links", count), ("materials", count), ("marks", 4 * count)]
    }

    /// Fixed elements that the last drag would have had to move. A saved state needs them in
    /// addition to the positions.
    pub fn strained(&self) -> &[u32] {
        &self.strained
    }

    /// Continues from a saved state: positions in units, and the value of [`Chain::strained`].
    /// Elements that are not listed keep their positions.
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

    /// Marks the row of an element as changed, so that relaxation visits it and its neighbors.
    pub(crate) fn mark_changed(&mut self, element: u32) {
        self.changed[element as usize / self.structure.links.shape()[0]] = true;
    }

    pub(crate) fn check_element(&self, element: u32) -> Result<(), ChainError> {
        if self.has_element(element) {
            return Ok(());
        }
        Err(ChainError::NoSuchElement { element, count: self.places() })
    }
}
