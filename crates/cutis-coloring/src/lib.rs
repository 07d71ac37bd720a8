//! cutis-coloring
