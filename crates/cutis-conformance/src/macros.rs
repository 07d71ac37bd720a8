//! The macro that turns the battery into tests.

/// Expands to a module of tests: every check of the battery for a constraint type over `N`
/// vertices.
///
/// ```
/// use cutis_conformance::{Subject, conformance};
/// use cutis_constraints::{Distance, SkinTension, SkinTensionMaterial};
///
/// // With the default material, in a module `conformance`.
/// conformance!(Distance, 2);
/// // With a module name, for several types in one file, and with a subject.
/// conformance!(mod stc: SkinTension, 3, Subject::new([
///     SkinTensionMaterial { rest_area_scale: 0.8, amplification: 3.0 },
/// ]));
/// ```
///
/// The last argument is a [`Subject`](crate::Subject). It may be omitted if the material has a
/// default; the subject is then `Subject::default()`. Without an adapter the checks on a GPU are
/// skipped, and the reason is printed to standard error. If one of the variables
/// [`REQUIRE`](crate::device::REQUIRE) is set, they fail instead.
#[macro_export]
macro_rules! conformance {
    ($constraint:ty, $n:literal $(, $subject:expr)? $(,)?) => {
        $crate::conformance!(mod conformance: $constraint, $n $(, $subject)?);
    };
    (mod $name:ident: $constraint:ty, $n:literal $(,)?) => {
        $crate::conformance!(mod $name: $constraint, $n, $crate::Subject::default());
    };
    (mod $name:ident: $constraint:ty, $n:literal, $subject:expr $(,)?) => {
        #[cfg(test)]
        mod $name {
            #[allow(unused_imports)]
            use super::*;

            type Tested = $crate::Subject<$constraint, $n>;

            fn subject() -> Tested {
                $subject
            }

            $crate::conformance!(@host gradient momentum scale parameters precision lanes degenerate wgsl);

            #[test]
            fn projection() -> ::std::result::Result<(), $crate::ConformanceError> {
                $crate::checks::projection(&subject())?.assert_passed();
                Ok(())
            }

            $crate::conformance!(@device
                evaluation_on_gpu evaluation, projection_on_gpu projection, degenerate_on_gpu degenerate);
        }
    };
    (@host $($check:ident)*) => {
        $(
            #[test]
            fn $check() {
                $crate::checks::$check(&subject()).assert_passed();
            }
        )*
    };
    (@device $($test:ident $check:ident),*) => {
        $(
            #[test]
            fn $test() -> ::std::result::Result<(), $crate::ConformanceError> {
                if let Some(gpu) = $crate::device::open()? {
                    $crate::device::$check(&subject(), &gpu)?.assert_passed();
                }
                Ok(())
            }
        )*
    };
}
