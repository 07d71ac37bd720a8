//! Hints for the cache.
#![allow(unsafe_code)]

/// Tells the processor that an element of a slice is needed soon, so that it comes into the cache
/// while other work goes on. Does nothing beyond the end of the slice, and on processors without
/// such an instruction here.
#[inline(always)]
pub fn prefetch<T>(slice: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(element) = slice.get(index) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has the instruction. It reads nothing, and the address is
        // that of an element.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(element).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, index);
}

#[cfg(test)]
mod tests {
    use super::prefetch;

    #[test]
    fn any_index_may_be_named() {
        let numbers = vec![1.0f32, 2.0, 3.0];
        for index in [0, 2, 3, usize::MAX] {
            prefetch(&numbers, index);
            prefetch(&numbers[..0], index);
            prefetch(&[(); 3], index);
        }
        assert_eq!(numbers, [1.0, 2.0, 3.0]);
    }
}
