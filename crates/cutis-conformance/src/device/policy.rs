//! Opening a GPU: which one, and whether one is required.

use cutis_gpu::{Gpu, GpuError, GpuOptions};

use crate::ConformanceError;

/// Environment variables that make a missing adapter an error. Any value counts except the empty
/// one, `0` and `false`.
pub const REQUIRE: [&str; 2] = ["CI", "CUTIS_REQUIRE_GPU"];

/// Opens the first adapter of the machine. Returns `None` if there is none and no variable of
/// [`REQUIRE`] is set; the reason is printed to standard error.
///
/// # Errors
/// [`ConformanceError::DeviceRequired`] if there is no adapter and a variable is set.
/// [`ConformanceError::Gpu`] if there is an adapter and it fails.
pub fn open() -> Result<Option<Gpu>, ConformanceError> {
    let set = |variable: &&str| {
        std::env::var_os(variable).is_some_and(|value| !["", "0", "false"].map(Into::into).contains(&value))
    };
    decide(Gpu::open(&GpuOptions::default()), REQUIRE.into_iter().find(set))
}

fn decide(
    opened: Result<Gpu, GpuError>,
    required: Option<&'static str>,
) -> Result<Option<Gpu>, ConformanceError> {
    match (opened, required) {
        (Ok(gpu), _) => Ok(Some(gpu)),
        (Err(source @ GpuError::NoAdapter), Some(variable)) => {
            Err(ConformanceError::DeviceRequired { variable, source })
        }
        (Err(error @ GpuError::NoAdapter), None) => {
            eprintln!("skipped, no GPU: {error}");
            Ok(None)
        }
        (Err(error), _) => Err(error.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_missing_adapter_that_is_not_required_is_skipped() {
        assert!(matches!(decide(Err(GpuError::NoAdapter), None), Ok(None)));
        let required = decide(Err(GpuError::NoAdapter), Some("CI"));
        let error = required.map(|_| ()).unwrap_err();
        assert!(matches!(error, ConformanceError::DeviceRequired { variable: "CI", .. }));
        assert!(error.to_string().starts_with("CI is set"), "{error}");
        let broken = GpuError::Device { adapter: "a".to_owned(), reason: "b".to_owned() };
        assert!(matches!(decide(Err(broken), None), Err(ConformanceError::Gpu(_))));
    }
}
