//! Mutations for the stability suite: missing guards, descent in one direction or too far, a skin
//! tension that is not convex, absolute lengths.

use super::list::Suite::Stability;
use super::list::{Mutation, mutation};

/// The mutations.
pub const STABILITY: &[Mutation] = &[
    mutation(
        Stability,
        "the guard of the quotient is left out, Rust",
        "crates/cutis-solver/src/kernel.rs",
        "quotient.select(finite, T::zero())",
        "quotient.select(finite, quotient)",
    ),
    mutation(
        Stability,
        "the guard of the quotient is left out, WGSL",
        "shaders/wgsl/solver/quotient.wgsl",
        "let defined = denominator != 0.0;\n    let quotient = numerator / select(1.0, denominator, defined);\n    return select(0.0, quotient, defined && is_finite(quotient));",
        "return numerator / denominator;",
    ),
    mutation(
        Stability,
        "the guard of coincident points is left out, Rust",
        "crates/cutis-constraints/src/constraint.rs",
        ".select(self.length.simd_gt(zero), zero)",
        ".select(self.length.simd_ge(zero), zero)",
    ),
    mutation(
        Stability,
        "the guard of flat triangles is left out, Rust",
        "crates/cutis-constraints/src/triangle.rs",
        "n_squared.simd_gt(noise_squared)",
        "n_squared.simd_ge(noise_squared * T::zero())",
    ),
    mutation(
        Stability,
        "the guard of flat triangles is left out, WGSL",
        "shaders/wgsl/constraints/triangle.wgsl",
        "let half_normal = n * select(0.0, 0.5 / select(1.0, n_length, defined), defined);",
        "let half_normal = n * (0.5 / n_length);",
    ),
    mutation(
        Stability,
        "no reach of a projection, Rust",
        "crates/cutis-solver/src/kernel.rs",
        "lightest * (c * inverse_reach_squared * c)",
        "lightest * (c * inverse_reach_squared * T::zero())",
    ),
    mutation(
        Stability,
        "no reach of a projection, WGSL",
        "shaders/wgsl/solver/project.wgsl",
        "(found.c * inverse_reach_squared * found.c)",
        "(found.c * inverse_reach_squared * 0.0)",
    ),
    mutation(
        Stability,
        "skin tension with the published amplification in XPBD, Rust",
        "crates/cutis-constraints/src/skin_tension.rs",
        "Eval { c: c * q, grad: [grad[0] * slope, grad[1] * slope, grad[2] * slope] }",
        "Eval { c: c * (T::one() + amplification * stretch(c, rest_area)), grad: grad.map(|g| g * (slope / slope)) }",
    ),
    mutation(
        Stability,
        "skin tension with the published amplification in XPBD, WGSL",
        "shaders/wgsl/constraints/skin_tension.wgsl",
        "return Eval(c * q, triangle.grad);",
        "return Eval(c * (1.0 + p.amplification * stretch(c, p.rest_area)), area_and_gradient(x).grad);",
    ),
    mutation(
        Stability,
        "an absolute epsilon below the volume's gradient, Rust",
        "crates/cutis-constraints/src/volume.rs",
        "let grad2 = cross(&b, &c) * sixth;",
        "let n = cross(&b, &c);\n    let sixth = sixth.select(n.dot(&n).simd_gt(T::constant(1e-6)), T::zero());\n    let grad2 = n * sixth;",
    ),
    mutation(
        Stability,
        "an absolute epsilon below the volume's gradient, WGSL",
        "shaders/wgsl/constraints/volume.wgsl",
        "let sixth = 1.0 / 6.0;",
        "let sixth = select(0.0, 1.0 / 6.0, dot(cross(b, c), cross(b, c)) > 1e-6);",
    ),
    mutation(
        Stability,
        "an absolute epsilon in the denominator, Rust",
        "crates/cutis-solver/src/kernel.rs",
        "let quotient = numerator / denominator;",
        "let quotient = numerator / (denominator + convert(1e-6));",
    ),
    mutation(
        Stability,
        "an absolute epsilon in the denominator, WGSL",
        "shaders/wgsl/solver/quotient.wgsl",
        "let quotient = numerator / select(1.0, denominator, defined);",
        "let quotient = numerator / (select(1.0, denominator, defined) + 1e-6);",
    ),
    mutation(
        Stability,
        "a substep of vertex block descent goes one way only",
        "crates/cutis-solver/src/schedule.rs",
        "let descending = number >= u64::from(self.iterations);",
        "let descending = number >= 2 * u64::from(self.iterations);",
    ),
    mutation(
        Stability,
        "steps of vertex block descent are half as long again, Rust",
        "crates/cutis-solver/src/descent.rs",
        "Vector3::new(z1, z2, z3) * self.relaxation;",
        "Vector3::new(z1, z2, z3) * (self.relaxation * T::constant(1.5));",
    ),
    mutation(
        Stability,
        "steps of vertex block descent are half as long again, WGSL",
        "shaders/wgsl/solver/descend.wgsl",
        "* descent.relaxation;",
        "* (descent.relaxation * 1.5);",
    ),
];
