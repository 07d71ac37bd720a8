// Rows with six unknowns, in vectors with eight numbers per node.
const ROW_UNKNOWNS: u32 = 6u;
const ROW_LANES: u32 = 8u;
