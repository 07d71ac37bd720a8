//! cutis-render
