// Colors constraints: in each round, a constraint that has the highest priority at all of its
// vertices takes the lowest color that is free at them.
struct Settings {
    // Vertices per constraint.
    arity: u32,
    // Number of the first constraint of this part.
    first: u32,
    // Color that bit 0 of the masks stands for.
    base: u32,
    unused: u32,
}

// Vertices of the constraints of this part, one constraint after the other.
@group(0) @binding(0) var<storage, read> tuples: array<u32>;
// Color of each constraint of this part, or one of the states below.
@group(0) @binding(1) var<storage, read_write> colors: array<u32>;
// Highest priority at each vertex in this round.
@group(0) @binding(2) var<storage, read_write> highest: array<atomic<u32>>;
// Colors of the constraints at each vertex, one bit for each color.
@group(0) @binding(3) var<storage, read_write> masks: array<vec4u>;
// Whether a constraint is left, and whether one is deferred.
@group(0) @binding(4) var<storage, read_write> found: array<atomic<u32>, 2>;
@group(0) @binding(5) var<uniform> settings: Settings;

// The constraint has no color yet.
const LEFT = 0xffffffffu;
// All colors of the masks are taken at its vertices; it waits for the next ones.
const DEFERRED = 0xfffffffeu;

// A permutation of the numbers of 32 bits, so that no two constraints have the same priority.
fn priority(number: u32) -> u32 {
    var x = number;
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

@compute @workgroup_size(64)
fn propose(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k >= arrayLength(&colors) || colors[k] != LEFT) {
        return;
    }
    let own = priority(settings.first + k);
    for (var n = 0u; n < settings.arity; n++) {
        atomicMax(&highest[tuples[k * settings.arity + n]], own);
    }
}

@compute @workgroup_size(64)
fn choose(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k >= arrayLength(&colors) || colors[k] != LEFT) {
        return;
    }
    let own = priority(settings.first + k);
    var wins = true;
    for (var n = 0u; n < settings.arity; n++) {
        wins = wins && atomicLoad(&highest[tuples[k * settings.arity + n]]) == own;
    }
    if (!wins) {
        atomicStore(&found[0], 1u);
        return;
    }
    // No other constraint at these vertices wins in this round, so nothing else reads or writes
    // their masks.
    var taken = vec4u(0u);
    for (var n = 0u; n < settings.arity; n++) {
        taken |= masks[tuples[k * settings.arity + n]];
    }
    var word = 0u;
    while (word < 4u && taken[word] == 0xffffffffu) {
        word++;
    }
    if (word == 4u) {
        colors[k] = DEFERRED;
        atomicStore(&found[1], 1u);
        return;
    }
    let bit = firstTrailingBit(~taken[word]);
    colors[k] = settings.base + 32u * word + bit;
    for (var n = 0u; n < settings.arity; n++) {
        masks[tuples[k * settings.arity + n]][word] |= 1u << bit;
    }
}

// Prepares the next colors: deferred constraints are left again.
@compute @workgroup_size(64)
fn resume(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k < arrayLength(&colors) && colors[k] == DEFERRED) {
        colors[k] = LEFT;
    }
}
