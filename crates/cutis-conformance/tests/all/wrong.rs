//! Two correct constraints, and variants of them with one fault each.

use cutis_constraints::{Constraint, Eval, Real};
use nalgebra::{Point3, Vector3};

/// The shader of a stretch with the given end of its body.
macro_rules! stretch_wgsl {
    ($body:literal) => {
        concat!(
            "struct Params { rest_length: f32, slack: f32 }\n",
            "fn eval(x: array<vec3f, N>, p: Params) -> Eval {\n    let d = x[0] - x[1];\n",
            $body,
            "}\n"
        )
    };
}

const STRETCH: &str = stretch_wgsl!(
    "let length = sqrt(dot(d, d));
    let apart = length > 0.0;
    let direction = d * select(0.0, 1.0 / select(1.0, length, apart), apart);
    return Eval(length - p.rest_length * p.slack, array<vec3f, N>(direction, -direction));"
);

/// Implements a variant of the stretch `C = |x1 − x2| − L s` with its own `eval` and, if given,
/// another shader.
macro_rules! stretch {
    ($(#[$doc:meta])* $name:ident, $eval:expr $(, $wgsl:expr)?) => {
        $(#[$doc])*
        pub struct $name;

        impl Constraint<2> for $name {
            const NAME: &'static str = stringify!($name);
            const WGSL: &'static str = [STRETCH $(, $wgsl)?][[0usize $(, { let _ = $wgsl; 1 })?].len() - 1];
            type Params<T: Real> = [T; 2];
            type Material = ();

            fn from_rest<T: Real>([x1, x2]: &[Point3<T>; 2], _: &()) -> [T; 2] {
                let d = x1 - x2;
                [d.dot(&d).simd_sqrt(), T::constant(0.8)]
            }

            #[inline(always)]
            fn eval<T: Real>(x: &[Point3<T>; 2], params: &[T; 2]) -> Eval<T, 2> {
                let eval: fn(&[Point3<T>; 2], &[T; 2]) -> Eval<T, 2> = $eval;
                eval(x, params)
            }

            fn rest_size<T: Real>(&[rest_length, _]: &[T; 2]) -> T {
                rest_length
            }
        }
    };
}

fn length<T: Real>([x1, x2]: &[Point3<T>; 2]) -> T {
    let d = x1 - x2;
    d.dot(&d).simd_sqrt()
}

fn direction<T: Real>(x: &[Point3<T>; 2]) -> Vector3<T> {
    let length = length(x);
    (x[0] - x[1]) * (T::one() / length).select(length.simd_gt(T::zero()), T::zero())
}

fn stretch<T: Real>(x: &[Point3<T>; 2], &[rest_length, slack]: &[T; 2]) -> Eval<T, 2> {
    Eval { c: length(x) - rest_length * slack, grad: [direction(x), -direction(x)] }
}

stretch!(
    /// The correct stretch.
    Stretch,
    stretch
);
stretch!(
    /// Pushes instead of pulling.
    WrongSign,
    |x, p| {
        let Eval { c, grad } = stretch(x, p);
        Eval { c, grad: grad.map(|g| -g) }
    }
);
stretch!(
    /// Pulls at one end only.
    OneSided,
    |x, p| Eval { grad: [direction(x), Vector3::zeros()], ..stretch(x, p) },
    stretch_wgsl!(
        "let length = sqrt(dot(d, d));
        let apart = length > 0.0;
        let direction = d * select(0.0, 1.0 / select(1.0, length, apart), apart);
        return Eval(length - p.rest_length * p.slack, array<vec3f, N>(direction, vec3f(0.0)));"
    )
);
stretch!(
    /// Adds a tenth of a millimeter to the length.
    AbsoluteEpsilon,
    |x, p| {
        let length = length(x) + T::constant(1e-4);
        let direction = (x[0] - x[1]) * (T::one() / length);
        Eval { c: length - p[0] * p[1], grad: [direction, -direction] }
    },
    stretch_wgsl!(
        "let length = sqrt(dot(d, d)) + 1e-4;
        let direction = d * (1.0 / length);
        return Eval(length - p.rest_length * p.slack, array<vec3f, N>(direction, -direction));"
    )
);
stretch!(
    /// Treats the direction as undefined below a length of one nanometer.
    TinyGuard,
    |x, p| {
        let length = length(x);
        let inverse = (T::one() / length).select(length.simd_gt(T::constant(1e-9)), T::zero());
        let direction = (x[0] - x[1]) * inverse;
        Eval { c: length - p[0] * p[1], grad: [direction, -direction] }
    },
    stretch_wgsl!(
        "let length = sqrt(dot(d, d));
        let apart = length > 1e-9;
        let direction = d * select(0.0, 1.0 / select(1.0, length, apart), apart);
        return Eval(length - p.rest_length * p.slack, array<vec3f, N>(direction, -direction));"
    )
);
stretch!(
    /// Adds a square picometer to its squared length.
    TinyEpsilon,
    |x, p| {
        let d = x[0] - x[1];
        let length = (d.dot(&d) + T::constant(1e-24)).simd_sqrt();
        let direction = d * (T::one() / length);
        Eval { c: length - p[0] * p[1], grad: [direction, -direction] }
    },
    stretch_wgsl!(
        "let length = sqrt(dot(d, d) + 1e-24);
        let direction = d * (1.0 / length);
        return Eval(length - p.rest_length * p.slack, array<vec3f, N>(direction, -direction));"
    )
);
stretch!(
    /// Reads only one of its two parameters.
    Idle,
    |x, &[rest_length, _]| stretch(x, &[rest_length, T::one()]),
    stretch_wgsl!(
        "let length = sqrt(dot(d, d));
        let apart = length > 0.0;
        let direction = d * select(0.0, 1.0 / select(1.0, length, apart), apart);
        return Eval(length - p.rest_length, array<vec3f, N>(direction, -direction));"
    )
);
stretch!(
    /// Adds and subtracts ten thousand lengths.
    Canceling,
    |x, p| {
        let detour = p[0] * T::constant(1e4);
        let Eval { c, grad } = stretch(x, p);
        Eval { c: (c + detour) - detour, grad }
    }
);
stretch!(
    /// Uses the largest length of all lanes.
    LanesMixed,
    |x, p| {
        let longest = T::splat(length(x).simd_horizontal_max());
        let Eval { c, grad } = stretch(x, p);
        Eval { c: c + (longest - length(x)), grad }
    }
);
stretch!(
    /// Divides by a length that may be zero.
    Unguarded,
    |x, p| {
        let direction = (x[0] - x[1]) * (T::one() / length(x));
        Eval { grad: [direction, -direction], ..stretch(x, p) }
    }
);
stretch!(
    /// Divides by a length that may be zero, in the shader only.
    UnguardedShader,
    stretch,
    stretch_wgsl!(
        "let length = sqrt(dot(d, d));
        let direction = d * (1.0 / length);
        return Eval(length - p.rest_length * p.slack, array<vec3f, N>(direction, -direction));"
    )
);
stretch!(
    /// Has no shader.
    NoShader,
    stretch,
    ""
);
stretch!(
    /// The shader uses an unknown name.
    UnknownName,
    stretch,
    stretch_wgsl!("return Eval(sqrt(dot(d, d)) - p.length, array<vec3f, N>(d, -d));")
);
stretch!(
    /// The shader declares a name of the solver.
    TakenName,
    stretch,
    concat!(
        "fn is_finite(value: f32) -> bool { return true; }\n",
        stretch_wgsl!(
            "let length = sqrt(dot(d, d));
            let apart = length > 0.0;
            let direction = d * select(0.0, 1.0 / select(1.0, length, apart), apart);
            return Eval(length - p.rest_length * p.slack, array<vec3f, N>(direction, -direction));"
        )
    )
);
stretch!(
    /// The shader has more parameters than the host.
    TooManyParams,
    stretch,
    "struct Params { rest_length: f32, slack: f32, more: f32 }
    fn eval(x: array<vec3f, N>, p: Params) -> Eval {
        let d = x[0] - x[1];
        return Eval(sqrt(dot(d, d)) - p.rest_length * p.slack, array<vec3f, N>(d, -d));
    }"
);
stretch!(
    /// The shader declares a parameter as an integer.
    IntegerParams,
    stretch,
    "struct Params { rest_length: f32, slack: u32 }
    fn eval(x: array<vec3f, N>, p: Params) -> Eval {
        let d = x[0] - x[1];
        return Eval(sqrt(dot(d, d)) - p.rest_length * f32(p.slack), array<vec3f, N>(d, -d));
    }"
);
stretch!(
    /// The shader calls a function that rounds differently.
    Normalized,
    stretch,
    stretch_wgsl!(
        "let direction = normalize(d);
        return Eval(length(d) - p.rest_length * p.slack, array<vec3f, N>(direction, -direction));"
    )
);
stretch!(
    /// The shader declares its parameters in another order.
    SwappedFields,
    |x, &[rest_length, slack]| {
        let Eval { c, grad } = stretch(x, &[rest_length, slack]);
        Eval { c: c * slack, grad: grad.map(|g| g * slack) }
    },
    "struct Params { slack: f32, rest_length: f32 }
    fn eval(x: array<vec3f, N>, p: Params) -> Eval {
        let d = x[0] - x[1];
        let length = sqrt(dot(d, d));
        let apart = length > 0.0;
        let direction = d * select(0.0, 1.0 / select(1.0, length, apart), apart);
        let c = length - p.rest_length * p.slack;
        return Eval(c * p.slack, array<vec3f, N>(direction * p.slack, -(direction * p.slack)));
    }"
);

/// The shader of a content constraint (see `content!`). `$tail` is the end of its `eval`.
macro_rules! content_wgsl {
    ($tail:literal) => {
        concat!(
            "struct Params { rest: f32 }
            fn eval(x: array<vec3f, N>, p: Params) -> Eval {
                let a = x[1] - x[0]; let b = x[2] - x[0]; let c = x[3] - x[0];
                let bc = cross(b, c); let ca = cross(c, a); let ab = cross(a, b);
                let sixth = 1.0 / 6.0;
                let v = dot(a, bc) * sixth - p.rest;\n",
            $tail,
            "}\n"
        )
    };
}

/// Implements a variant of a constraint on the content (signed volume) of a tetrahedron,
/// `C = a·(b×c)/6 − V0`. The gradient is a function of the three cross products.
macro_rules! content {
    ($(#[$doc:meta])* $name:ident, $gradient:expr, $wgsl:expr) => {
        $(#[$doc])*
        pub struct $name;

        impl Constraint<4> for $name {
            const NAME: &'static str = stringify!($name);
            const WGSL: &'static str = $wgsl;
            type Params<T: Real> = [T; 1];
            type Material = ();

            fn from_rest<T: Real>(x: &[Point3<T>; 4], _: &()) -> [T; 1] {
                [content(x).0]
            }

            #[inline(always)]
            fn eval<T: Real>(x: &[Point3<T>; 4], &[rest]: &[T; 1]) -> Eval<T, 4> {
                let (content, cross) = content(x);
                let gradient: fn([Vector3<T>; 3]) -> [Vector3<T>; 4] = $gradient;
                Eval { c: content - rest, grad: gradient(cross) }
            }

            fn rest_size<T: Real>(&[rest]: &[T; 1]) -> T {
                rest.simd_abs()
            }
        }
    };
}

fn content<T: Real>([x1, x2, x3, x4]: &[Point3<T>; 4]) -> (T, [Vector3<T>; 3]) {
    let (a, b, c) = (x2 - x1, x3 - x1, x4 - x1);
    let cross = [b.cross(&c), c.cross(&a), a.cross(&b)];
    (a.dot(&cross[0]) * T::constant(1.0 / 6.0), cross)
}

fn gradient<T: Real>([bc, ca, ab]: [Vector3<T>; 3]) -> [Vector3<T>; 4] {
    let sixth = T::constant(1.0 / 6.0);
    [-((bc + ca + ab) * sixth), bc * sixth, ca * sixth, ab * sixth]
}

content!(
    /// The correct content.
    Content,
    gradient,
    content_wgsl!("return Eval(v, array<vec3f, N>(-(((bc + ca) + ab) * sixth), bc * sixth, ca * sixth, ab * sixth));")
);
content!(
    /// The factor 1/6 is in the value but not in the gradient.
    WithoutSixth,
    |[bc, ca, ab]| [-(bc + ca + ab), bc, ca, ab],
    content_wgsl!("return Eval(v, array<vec3f, N>(-((bc + ca) + ab), bc, ca, ab));")
);
content!(
    /// A gradient of the shader lacks a term.
    LacksTerm,
    gradient,
    content_wgsl!("return Eval(v, array<vec3f, N>(-((bc + ca) * sixth), bc * sixth, ca * sixth, ab * sixth));")
);
