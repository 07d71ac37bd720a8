//! cutis-mesh
