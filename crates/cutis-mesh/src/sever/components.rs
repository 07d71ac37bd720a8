//! The parts into which severed edges divide a tetrahedron.

/// The edges of a tet, in the order of the bits of a mask.
pub(super) const EDGES: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

/// For each mask of severed edges, the part of each corner. Parts are numbered by their lowest
/// corner.
static PARTS: [[u8; 4]; 64] = {
    let mut table = [[0; 4]; 64];
    let mut mask = 0;
    while mask < 64 {
        table[mask] = parts(mask as u8);
        mask += 1;
    }
    table
};

/// The part of each corner of a tet.
pub(super) fn parts_of(severed: u8) -> [u8; 4] {
    PARTS[usize::from(severed & 63)]
}

/// Number of parts.
pub(super) fn count(parts: &[u8; 4]) -> u8 {
    1 + parts.iter().fold(0, |most, &part| if part > most { part } else { most })
}

const fn parts(severed: u8) -> [u8; 4] {
    // Each corner starts with its own number. Edges that hold pass the lower number on.
    let mut lowest = [0, 1, 2, 3];
    let mut round = 0;
    while round < 3 {
        let mut edge = 0;
        while edge < 6 {
            let (a, b) = EDGES[edge];
            if severed >> edge & 1 == 0 {
                let low = if lowest[a] < lowest[b] { lowest[a] } else { lowest[b] };
                lowest[a] = low;
                lowest[b] = low;
            }
            edge += 1;
        }
        round += 1;
    }
    let mut parts = [0; 4];
    let mut corner = 0;
    let mut next = 0;
    while corner < 4 {
        if lowest[corner] == corner as u8 {
            parts[corner] = next;
            next += 1;
        } else {
            parts[corner] = parts[lowest[corner] as usize];
        }
        corner += 1;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_share_a_part_if_and_only_if_edges_connect_them() {
        for severed in 0..64_u8 {
            let joined = |a: usize, b: usize| {
                let holds = |e: usize| severed >> e & 1 == 0;
                let mut seen = [false; 4];
                let mut stack = vec![a];
                while let Some(corner) = stack.pop() {
                    if std::mem::replace(&mut seen[corner], true) {
                        continue;
                    }
                    for (e, &(p, q)) in EDGES.iter().enumerate().filter(|(e, _)| holds(*e)) {
                        let _ = e;
                        if p == corner {
                            stack.push(q);
                        } else if q == corner {
                            stack.push(p);
                        }
                    }
                }
                seen[b]
            };
            let parts = parts_of(severed);
            for a in 0..4 {
                for b in 0..4 {
                    assert_eq!(parts[a] == parts[b], joined(a, b), "{severed:06b}");
                }
            }
            assert!(usize::from(count(&parts)) <= 4 && parts[0] == 0);
        }
        assert_eq!(parts_of(0), [0; 4]);
        assert_eq!(parts_of(63), [0, 1, 2, 3]);
        // The last corner alone.
        assert_eq!(parts_of(0b11_0100), [0, 0, 0, 1]);
    }
}
