//! Each SIMD lane has the bits of a scalar evaluation, independent of the other lanes.

use cutis_constraints::{
    Constraint, Distance, LipAdhesion, LipContact, Params, Real, Scalar, SkinStrip, SkinStripAtRest,
    SkinStripTurn, SkinTension, SkinTensionPaper, Volume,
};
use nalgebra::{Point3, SimdValue};
use simba::simd::{AutoF32x8, WideF32x4, WideF32x8, WideF64x4};

use cutis_test_kit::Random;

use crate::shapes::SCALES;

/// Number of SIMD evaluations.
const ROUNDS: usize = 200;

/// Random shapes at three scales. Every third one is degenerate, in one of three ways.
fn shape<const N: usize>(random: &mut Random, number: usize) -> [Point3<f64>; N] {
    let scale = SCALES[number % 3];
    let mut x: [Point3<f64>; N] = std::array::from_fn(|_| random.point() * scale);
    match number % 9 {
        2 => x = [x[0]; N],
        5 => x[N - 1] = x[0],
        8 => x = std::array::from_fn(|i| Point3::new(i as f64, 2.0 * i as f64, 0.0) * scale),
        _ => {}
    }
    x
}

/// Bits of value and gradient. A value that is not finite fails.
fn bits<S: Scalar>(c: S, grad: impl IntoIterator<Item = S>) -> Vec<u64> {
    let numbers: Vec<f64> = std::iter::once(c).chain(grad).map(Scalar::to_f64).collect();
    assert!(numbers.iter().all(|v| v.is_finite()), "{numbers:?}");
    numbers.into_iter().map(f64::to_bits).collect()
}

/// `params` gives the parameters for a rest size.
fn check<const N: usize, C, L, S>(dimension: i32, params: &impl Fn(f64) -> Vec<f64>)
where
    C: Constraint<N>,
    S: Scalar,
    L: Real + SimdValue<Element = S>,
{
    let mut random = Random::new(7);
    let mut equal_to_next = 0;
    for round in 0..ROUNDS {
        let shapes: Vec<[Point3<S>; N]> = (0..L::LANES)
            .map(|lane| shape(&mut random, round * L::LANES + lane).map(|p| p.map(S::constant)))
            .collect();
        // Rest sizes from 0 to more than the present size, so that lanes take both sides of every
        // `select`.
        let factors: Vec<f64> = (0..L::LANES).map(|_| (random.uniform() * 4.0).floor() * 0.3).collect();
        let scalar_params: Vec<C::Params<S>> = (0..L::LANES)
            .map(|lane| {
                let scale = SCALES[(round * L::LANES + lane) % 3];
                let params = params(factors[lane] * f64::powi(scale, dimension));
                Params::from_fn(|k| S::constant(params[k]))
            })
            .collect();

        let mut x = [Point3::new(L::zero(), L::zero(), L::zero()); N];
        for (lane, shape) in shapes.iter().enumerate() {
            for i in 0..N {
                for axis in 0..3 {
                    x[i][axis].replace(lane, shape[i][axis]);
                }
            }
        }
        let lane_params = <C::Params<L> as Params<L>>::from_fn(|k| {
            let mut value = L::zero();
            for (lane, params) in scalar_params.iter().enumerate() {
                value.replace(lane, params.as_ref()[k]);
            }
            value
        });

        let in_lanes = C::eval(&x, &lane_params);
        let of_lane = |lane: usize| {
            bits(
                in_lanes.c.extract(lane),
                in_lanes.grad.iter().flatten().map(|v| v.extract(lane)).collect::<Vec<_>>(),
            )
        };
        for lane in 0..L::LANES {
            let scalar = C::eval(&shapes[lane], &scalar_params[lane]);
            let scalar = bits(scalar.c, scalar.grad.iter().flatten().copied().collect::<Vec<_>>());
            assert_eq!(of_lane(lane), scalar, "{} round {round} lane {lane}", C::NAME);
            let acts = scalar.iter().any(|bits| f64::from_bits(*bits) != 0.0);
            equal_to_next += usize::from(acts && of_lane((lane + 1) % L::LANES) == scalar);
        }
    }
    // Negative control: the next lane holds another shape. Only degenerate ones may give equal
    // bits, and constraints that do not act.
    assert!(equal_to_next < ROUNDS * L::LANES / 10, "{equal_to_next}");
}

fn check_types<const N: usize, C: Constraint<N>>(dimension: i32, params: impl Fn(f64) -> Vec<f64>) {
    check::<N, C, WideF32x8, f32>(dimension, &params);
    check::<N, C, WideF32x4, f32>(dimension, &params);
    check::<N, C, AutoF32x8, f32>(dimension, &params);
    check::<N, C, WideF64x4, f64>(dimension, &params);
}

#[test]
fn lanes_equal_scalars_bit_for_bit() {
    check_types::<2, Distance>(1, |rest| vec![rest]);
    check_types::<4, Volume>(3, |rest| vec![rest]);
    check_types::<4, LipContact>(0, |part| vec![part, 0.6, -0.5, 0.3]);
    check_types::<4, LipAdhesion>(0, |part| vec![part, 0.6, -0.5, 0.3]);
    check_types::<3, SkinTension>(2, |rest| vec![rest, 5.0]);
    check_types::<3, SkinTensionPaper>(2, |rest| vec![rest, 5.0, 3.0]);
    let strip =
        |rest: f64| vec![1.0, -0.4, 0.7 * rest, rest, 3.0, 0.25, 0.1 * rest, -0.2 * rest, 0.15 * rest];
    check_types::<3, SkinStrip>(1, strip);
    check_types::<3, SkinStripAtRest>(1, strip);
    let turn =
        |rest: f64| [1.0, -0.4, rest, 0.2 * rest, -0.3 * rest, 0.3 * rest, 0.1 * rest, 0.0, 0.15 * rest];
    check_types::<3, SkinStripTurn>(1, |rest| turn(rest).to_vec());
}
