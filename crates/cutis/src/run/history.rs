//! The rows of the frames before a checkpoint, as bytes.
//!
//! Layout, little-endian: number of wounds, sutures, handles and rows (u32 each), then the rows.
//! Each row holds f64 values: frame, time in s, five for each wound (the lengths of its gape in mm
//! and the number of its bins), two for each suture and one for each handle, N. The wall times are
//! left out, so that a state has the same bytes on each machine.

use cutis_mesh::WoundGape;

use super::frames::FrameRow;

/// Length of a history without rows, bytes.
pub(super) const EMPTY: usize = 16;

/// Appends the rows, which have the same wounds, sutures and handles.
pub(super) fn encode(rows: &[FrameRow], bytes: &mut Vec<u8>) {
    let count = |of: fn(&FrameRow) -> usize| rows.first().map_or(0, of);
    let counts = [
        count(|row| row.gapes.len()),
        count(|row| row.sutures.len()),
        count(|row| row.handles.len()),
        rows.len(),
    ];
    counts.iter().for_each(|&count| bytes.extend_from_slice(&(count as u32).to_le_bytes()));
    for row in rows {
        let gapes = row.gapes.iter().flat_map(|gape| {
            [gape.mean_mm, gape.mid_mm, gape.mean_distance_mm, gape.mid_distance_mm, gape.bins as f64]
        });
        let values = [f64::from(row.frame), row.time_s].into_iter().chain(gapes);
        let values = values.chain(row.sutures.iter().flatten().copied()).chain(row.handles.iter().copied());
        values.for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
    }
}

/// The rows at the beginning of `bytes`, and what follows them. None if the bytes do not hold them.
pub(super) fn decode(bytes: &[u8]) -> Option<(Vec<FrameRow>, &[u8])> {
    let (head, bytes) = bytes.split_at_checked(EMPTY)?;
    let count = |n: usize| usize::try_from(u32::from_le_bytes(head[4 * n..][..4].try_into().ok()?)).ok();
    let (wounds, sutures, handles, rows) = (count(0)?, count(1)?, count(2)?, count(3)?);
    let width = 2 + 5 * wounds + 2 * sutures + handles;
    let (values, rest) = bytes.split_at_checked(width.checked_mul(8 * rows)?)?;
    let values: Vec<f64> = values.as_chunks::<8>().0.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect();
    let row = |values: &[f64]| {
        let (head, values) = values.split_at(2);
        let (gapes, values) = values.split_at(5 * wounds);
        let (sutures, handles) = values.split_at(2 * sutures);
        let gape = |of: &[f64; 5]| WoundGape {
            mean_mm: of[0],
            mid_mm: of[1],
            mean_distance_mm: of[2],
            mid_distance_mm: of[3],
            bins: of[4] as usize,
        };
        FrameRow {
            frame: head[0] as u32,
            time_s: head[1],
            ms: None,
            gapes: gapes.as_chunks::<5>().0.iter().map(gape).collect(),
            sutures: sutures.as_chunks::<2>().0.to_vec(),
            handles: handles.to_vec(),
        }
    };
    Some((values.chunks_exact(width).map(row).collect(), rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_survive_and_damage_is_noticed() {
        let gape = |mean_mm| WoundGape {
            mean_mm,
            mid_mm: -0.5,
            mean_distance_mm: 3.0,
            mid_distance_mm: 4.0,
            bins: 17,
        };
        let row = |frame: u32| FrameRow {
            frame,
            time_s: 0.1 * f64::from(frame),
            ms: None,
            gapes: vec![gape(0.25 * f64::from(frame)), gape(1.0)],
            sutures: vec![[0.5, 0.25]],
            handles: vec![2.0, 3.0, f64::from(frame)],
        };
        for rows in [vec![], vec![row(0)], vec![row(0), row(1), row(2)]] {
            let mut bytes = Vec::new();
            encode(&rows, &mut bytes);
            bytes.extend_from_slice(b"rest");
            let (back, rest) = decode(&bytes).unwrap();
            assert_eq!((&back, rest), (&rows, b"rest".as_slice()));
            assert!(decode(&bytes[..bytes.len() - 5]).is_none() && decode(&[255; 100]).is_none());
        }
    }
}
