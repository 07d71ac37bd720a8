// The finest matrix applies to differences between neighbors: the block on the diagonal is the sum
// of the row. Rounding is then relative to the strain and not to the displacement.
fn relative(neighbor: Unknowns, own: Unknowns) -> Unknowns {
    return difference(neighbor, own);
}
