// Rows with three unknowns, in vectors with four numbers per node.
const ROW_UNKNOWNS: u32 = 3u;
const ROW_LANES: u32 = 4u;
