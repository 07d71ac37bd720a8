//! cutis
