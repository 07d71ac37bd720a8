//! A stable counting sort of constraint indices by a small key, and allocations that may fail.

use crate::ColoringError;

/// Length of the longest list that a `u32` can index.
pub(crate) const INDEX_LIMIT: usize = u32::MAX as usize;

/// Returns a vector of `len` copies of `value`, or [`ColoringError::OutOfMemory`].
pub(crate) fn filled<T: Copy>(value: T, len: usize) -> Result<Vec<T>, ColoringError> {
    let mut vec = Vec::new();
    vec.try_reserve_exact(len)
        .map_err(|_| ColoringError::OutOfMemory { bytes: len.saturating_mul(size_of::<T>()) })?;
    vec.resize(len, value);
    Ok(vec)
}

/// Fails if `count` constraints cannot be numbered in 32 bits.
pub(crate) fn check_constraint_count(count: usize) -> Result<(), ColoringError> {
    if count > INDEX_LIMIT {
        return Err(ColoringError::TooManyConstraints { count, limit: INDEX_LIMIT });
    }
    Ok(())
}

/// Writes `items` to `sorted` by ascending key. Items with equal keys keep their order.
///
/// `counts[key]` is the number of items with this key. `sorted` has one place for each item.
pub(crate) fn by_key(
    items: impl Iterator<Item = u32>,
    keys: impl Iterator<Item = usize>,
    counts: &[u32],
    sorted: &mut [u32],
) {
    let mut cursors: Vec<u32> = counts
        .iter()
        .scan(0, |next, &count| {
            let start = *next;
            *next += count;
            Some(start)
        })
        .collect();
    for (item, key) in items.zip(keys) {
        let cursor = &mut cursors[key];
        sorted[*cursor as usize] = item;
        *cursor += 1;
    }
}
