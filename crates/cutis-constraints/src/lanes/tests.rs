//! These tests are small enough for Miri: `cargo miri test -p cutis-constraints --lib lanes::`.
//! Miri has only the instruction sets that the compiler enables.

use std::cmp::Ordering;

use simba::simd::SimdBool;

use super::{LaneTask, Lanes, SimdLevel};
use crate::Scalar;

/// Numbers of all kinds, in an order in which neighbors differ.
const NUMBERS: [f32; 19] = [
    1.0,
    -2.5,
    f32::NAN,
    0.0,
    -0.0,
    f32::INFINITY,
    3.0e-42,
    -1.0e38,
    0.1,
    7.0,
    f32::NEG_INFINITY,
    -7.0,
    1.0e-30,
    1.0,
    f32::MAX,
    -0.3,
    f32::MIN_POSITIVE,
    2.0,
    -f32::NAN,
];

/// The bits of a number; all NaN have the same. Only integers decide, because the sign of a NaN may
/// differ between two evaluations of one expression.
fn bits(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits & 0x7fff_ffff > 0x7f80_0000 { 0x7fc0_0000 } else { bits }
}

/// Compares every operation of the lanes with that of `f32`.
struct Operations;

impl LaneTask<f32> for Operations {
    fn run<L: Lanes<f32>>(self) {
        for shift in 0..NUMBERS.len() {
            let number = |lane: usize| NUMBERS[lane % NUMBERS.len()];
            let other = |lane: usize| NUMBERS[(lane + shift) % NUMBERS.len()];
            let (x, y) = (L::from_lanes(number), L::from_lanes(other));
            let check = |name: &str, found: L, expected: &dyn Fn(f32, f32) -> f32| {
                for lane in 0..L::LANES {
                    let expected = expected(number(lane), other(lane));
                    let found = found.extract(lane);
                    assert_eq!(bits(found), bits(expected), "{name}: {found} for {expected}");
                }
            };
            check("add", x + y, &|x, y| x + y);
            check("sub", x - y, &|x, y| x - y);
            check("mul", x * y, &|x, y| x * y);
            check("div", x / y, &|x, y| x / y);
            check("neg", -x, &|x, _| -x);
            check("abs", x.simd_abs(), &|x, _| x.abs());
            check("sqrt", x.simd_sqrt(), &|x, _| x.sqrt());
            check("floor", x.simd_floor(), &|x, _| x.floor());
            // Which zero is the larger one differs between processors. No constraint depends on it.
            let zeros = |x: f32, y: f32| x == 0.0 && y == 0.0;
            check("max", x.simd_max(y) + L::zero(), &|x, y| if zeros(x, y) { 0.0 } else { x.max(y) + 0.0 });
            check("min", x.simd_min(y) + L::zero(), &|x, y| if zeros(x, y) { 0.0 } else { x.min(y) + 0.0 });
            let one = |holds: bool| if holds { 1.0 } else { 0.0 };
            let found = |mask: L::SimdBool| L::one().select(mask, L::zero());
            check("gt", found(x.simd_gt(y)), &|x, y| one(x > y));
            check("ge", found(x.simd_ge(y)), &|x, y| one(x >= y));
            check("lt", found(x.simd_lt(y)), &|x, y| one(x < y));
            check("le", found(x.simd_le(y)), &|x, y| one(x <= y));
            check("eq", found(x.simd_eq(y)), &|x, y| one(x == y));
            check("ne", found(x.simd_ne(y)), &|x, y| one(x != y));
            check("and", found(x.simd_gt(y) & x.simd_gt(L::zero())), &|x, y| one(x > y && x > 0.0));
            check("or", found(x.simd_gt(y) | x.simd_gt(L::zero())), &|x, y| one(x > y || x > 0.0));
            check("not", found(!x.simd_gt(y)), &|x, y| one(x.partial_cmp(&y) != Some(Ordering::Greater)));
            let greater = |lane: &usize| number(*lane) > other(*lane);
            assert_eq!(x.simd_gt(y).any(), (0..L::LANES).any(|lane| greater(&lane)));
            assert_eq!(x.simd_gt(y).all(), (0..L::LANES).all(|lane| greater(&lane)));
            assert_eq!(x.simd_gt(y).bitmask().count_ones() as usize, (0..L::LANES).filter(greater).count());
        }
        assert!(L::one().simd_eq(L::constant(1.0)).all());
        assert!(!L::one().simd_eq(L::zero()).any());
    }
}

/// Reads rows as columns, and writes them again.
struct Transposition;

impl LaneTask<f32> for Transposition {
    fn run<L: Lanes<f32>>(self) {
        let row = |lane: usize| [0, 1, 2, 3].map(|column| (10 * lane + column) as f32);
        let columns = L::columns(row);
        for (number, column) in columns.iter().enumerate() {
            (0..L::LANES).for_each(|lane| assert_eq!(column.extract(lane), row(lane)[number]));
        }
        let quads = L::from_quads(|quad| [0, 1, 2, 3].map(|n| (4 * quad + n) as f32));
        (0..L::LANES).for_each(|lane| assert_eq!(quads.extract(lane), lane as f32));
        let mut seen = vec![false; L::LANES];
        L::rows(columns, |lane, numbers| {
            assert_eq!(numbers, row(lane));
            seen[lane] = true;
        });
        assert!(seen.iter().all(|seen| *seen));
    }
}

/// Moves lanes to slices and quads.
struct Moves;

impl LaneTask<f32> for Moves {
    fn run<L: Lanes<f32>>(self) {
        let numbers: Vec<f32> = (0..20).map(|n| n as f32).collect();
        let lanes = L::from_slice(&numbers[1..]);
        let mut written = [-1.0; 20];
        lanes.write_to(&mut written[2..]);
        let quarter = L::LANES / 4;
        for lane in 0..L::LANES {
            assert_eq!(lanes.extract(lane), numbers[1 + lane]);
            assert_eq!(written[2 + lane], numbers[1 + lane]);
        }
        assert!(written[..2].iter().chain(&written[2 + L::LANES..]).all(|&number| number == -1.0));
        let mut quads = 0;
        lanes.quads(|n, quad| {
            assert_eq!(quad[..], numbers[1 + 4 * n..5 + 4 * n]);
            quads += 1;
        });
        assert_eq!(quads, quarter);
    }
}

/// Counts the lanes.
struct Count<'a>(&'a mut usize);

impl<T: Scalar> LaneTask<T> for Count<'_> {
    fn run<L: Lanes<T>>(self) {
        *self.0 = L::LANES;
    }
}

#[test]
fn every_operation_of_every_level_has_the_bits_of_the_scalar_operation() {
    for level in SimdLevel::available() {
        f32::in_lanes(level, Operations);
    }
}

#[test]
fn rows_and_columns_are_each_others_inverse() {
    for level in SimdLevel::available() {
        f32::in_lanes(level, Transposition);
    }
}

#[test]
fn lanes_move_to_slices_quads_and_other_lanes() {
    for level in SimdLevel::available() {
        f32::in_lanes(level, Moves);
    }
}

#[test]
fn each_level_has_its_number_of_lanes_and_the_best_one_the_most() {
    let mut found = Vec::new();
    for level in SimdLevel::available() {
        let (mut single, mut double) = (0, 0);
        f32::in_lanes(level, Count(&mut single));
        f64::in_lanes(level, Count(&mut double));
        assert_eq!((single, double), (level.lanes(), 4));
        found.push(single);
    }
    assert!(found.is_sorted() && found.first() == Some(&4), "{found:?}");
    assert_eq!(found.last(), Some(&SimdLevel::best().lanes()));
}
