// A sparse matrix of small blocks in slices (sliced ELLPACK: Monakov, Lokhmotov and Avetisyan,
// HiPEAC 2010). A workgroup computes the rows of a slice, and each thread one unknown of a row. All
// rows of a slice have the same number of blocks, some of which are zero, so that neighboring
// threads read neighboring numbers.
//
// Needs ROW_UNKNOWNS and ROW_LANES: the unknowns of a row, and the numbers that a vector has for
// them, with zeros to a multiple of four.
struct Chunk {
    // The first slice of this part of the matrix.
    first: u32,
    // Number of rows of the whole matrix.
    rows: u32,
    unused_1: u32, unused_2: u32,
}

@group(0) @binding(0) var<uniform> chunk: Chunk;
// The first block of each slice, and the end of the last one.
@group(0) @binding(1) var<storage, read> starts: array<u32>;
// The column of each block: those of the first block of each row, then those of the second ones.
@group(0) @binding(2) var<storage, read> columns: array<u32>;
// The blocks in the same order. The first columns of the blocks come first, then the second ones.
@group(0) @binding(3) var<storage, read> values: array<f32>;

// Rows of a slice, and their unknowns.
const ROWS: u32 = 64u / ROW_LANES;
const HEIGHT: u32 = ROWS * ROW_UNKNOWNS;

// What a thread computes.
struct Place {
    slice: u32,
    // The row in its slice, and in the whole matrix.
    row: u32,
    node: u32,
    // The unknown in its slice.
    unknown: u32,
    // The number in a vector.
    number: u32,
    exists: bool,
}

fn place_of(slice: u32, thread: u32) -> Place {
    let number = (chunk.first + slice) * 64u + thread;
    let node = number / ROW_LANES;
    let lane = thread % ROW_LANES;
    let row = thread / ROW_LANES;
    return Place(
        slice,
        row,
        min(node, chunk.rows - 1u),
        row * ROW_UNKNOWNS + min(lane, ROW_UNKNOWNS - 1u),
        number,
        node < chunk.rows && lane < ROW_UNKNOWNS,
    );
}

// The node in the column of a block.
fn column_of(place: Place, block: u32) -> u32 {
    return columns[block * ROWS + place.row];
}

// The place of the first number of the thread's row of a block.
fn row_of(place: Place, block: u32) -> u32 {
    return block * COLUMN_UNKNOWNS * HEIGHT + place.unknown;
}
