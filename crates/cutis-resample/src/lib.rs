//! cutis-resample
