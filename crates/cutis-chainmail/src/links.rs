//! Links between elements, and which elements must not move: one byte per element.

use crate::ChainError;
use crate::units::MOST_ELEMENTS;

/// Bits of the links to the next and to the previous element along each axis.
pub(crate) const NEXT: [u8; 3] = [1, 2, 4];
pub(crate) const BEFORE: [u8; 3] = [8, 16, 32];
/// The element never moves.
const FIXED: u8 = 64;
/// The element is held at its target during this drag or relaxation.
const GRABBED: u8 = 128;

/// A link, seen from one of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Neighbor {
    /// The element at the other end.
    pub(crate) element: u32,
    /// The axis of the link.
    pub(crate) axis: usize,
    /// True if the other end is the next element, false if it is the previous one.
    pub(crate) next: bool,
}

/// The links of a grid. Element `(i, j, k)` has the number `i + nx (j + ny k)`.
#[derive(Clone, Debug)]
pub(crate) struct Links {
    shape: [usize; 3],
    strides: [u32; 3],
    bits: Vec<u8>,
}

impl Links {
    /// Links all neighbors for which `there` is true at both ends.
    pub(crate) fn new(shape: [usize; 3], there: impl Fn(usize) -> bool) -> Result<Self, ChainError> {
        let count = shape.iter().try_fold(1_usize, |count, &n| count.checked_mul(n));
        let fits = |count: &usize| u32::try_from(*count).is_ok_and(|count| count < u32::MAX);
        let right = shape.iter().all(|n| (1..=MOST_ELEMENTS).contains(n));
        let Some(count) = count.filter(|count| right && fits(count)) else {
            return Err(ChainError::Shape { shape, most: MOST_ELEMENTS });
        };
        let strides = [1, shape[0], shape[0] * shape[1]].map(|stride| stride as u32);
        let mut links = Self { shape, strides, bits: vec![0; count] };
        for element in (0..count).filter(|&element| there(element)) {
            let place = links.place(element as u32);
            for axis in 0..3 {
                let next = element + strides[axis] as usize;
                if place[axis] + 1 < shape[axis] && there(next) {
                    links.bits[element] |= NEXT[axis];
                    links.bits[next] |= BEFORE[axis];
                }
            }
        }
        Ok(links)
    }

    pub(crate) fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// The byte of each element, in the layout that the GPU kernel reads.
    #[cfg(feature = "gpu")]
    pub(crate) fn bits(&self) -> &[u8] {
        &self.bits
    }

    pub(crate) fn len(&self) -> usize {
        self.bits.len()
    }

    /// Grid point of an element.
    pub(crate) fn place(&self, element: u32) -> [usize; 3] {
        let [nx, ny, _] = self.shape;
        let element = element as usize;
        [element % nx, element / nx % ny, element / (nx * ny)]
    }

    /// The links of an element.
    #[inline]
    pub(crate) fn of(&self, element: u32) -> impl Iterator<Item = Neighbor> + use<> {
        let (bits, strides) = (self.bits[element as usize], self.strides);
        (0..3).flat_map(move |axis| {
            let next = (bits & NEXT[axis] != 0).then(|| Neighbor {
                element: element + strides[axis],
                axis,
                next: true,
            });
            let before = (bits & BEFORE[axis] != 0).then(|| Neighbor {
                element: element - strides[axis],
                axis,
                next: false,
            });
            next.into_iter().chain(before)
        })
    }

    /// The byte of an element.
    #[inline]
    pub(crate) fn bits_of(&self, element: usize) -> u8 {
        self.bits[element]
    }

    /// The next element along an axis, if there is a link to it.
    #[inline]
    pub(crate) fn next(&self, element: u32, axis: usize) -> Option<u32> {
        (self.bits[element as usize] & NEXT[axis] != 0).then(|| element + self.strides[axis])
    }

    /// Removes the link to the next element. Returns true if there was one.
    pub(crate) fn cut(&mut self, element: u32, axis: usize) -> bool {
        let next = self.next(element, axis);
        if let Some(next) = next {
            self.bits[element as usize] &= !NEXT[axis];
            self.bits[next as usize] &= !BEFORE[axis];
        }
        next.is_some()
    }

    /// True if propagation must not move the element.
    #[inline]
    pub(crate) fn is_held(&self, element: u32) -> bool {
        self.bits[element as usize] & (FIXED | GRABBED) != 0
    }

    pub(crate) fn is_fixed(&self, element: u32) -> bool {
        self.bits[element as usize] & FIXED != 0
    }

    pub(crate) fn set_fixed(&mut self, element: u32) {
        self.bits[element as usize] |= FIXED;
    }

    pub(crate) fn set_grabbed(&mut self, element: u32, grabbed: bool) {
        let bits = &mut self.bits[element as usize];
        *bits = if grabbed { *bits | GRABBED } else { *bits & !GRABBED };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_see_a_link_and_a_cut() {
        let mut links = Links::new([3, 2, 2], |element| element != 1).unwrap();
        let of = |links: &Links, element| links.of(element).map(|n| n.element).collect::<Vec<_>>();
        assert_eq!(
            (of(&links, 0), of(&links, 1)),
            (vec![3, 6], vec![]),
            "nothing is linked with what is not there"
        );
        for element in 0..12 {
            for n in links.of(element) {
                assert!(links.of(n.element).any(|back| back.element == element && back.next != n.next));
            }
        }
        assert!(links.cut(0, 1) && !links.cut(0, 1) && !links.cut(0, 0));
        assert_eq!((of(&links, 0), of(&links, 3)), (vec![6], vec![4, 9]));
        assert_eq!(links.place(9), [0, 1, 1]);
    }

    #[test]
    fn shapes_that_cannot_be_numbered_are_refused() {
        for shape in [[0, 1, 1], [4097, 1, 1], [4096; 3], [usize::MAX; 3]] {
            assert!(matches!(Links::new(shape, |_| true), Err(ChainError::Shape { .. })));
        }
    }
}
