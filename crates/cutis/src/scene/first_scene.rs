//! A scene to start from, for a volume: with a first cut at the front of the body.

use std::path::Path;

use cutis_volume::{ReadOptions, Volume};
use nalgebra::Point3;

use super::template;
use crate::Error;

/// Values below are air, as in the template.
const AIR_HU: f32 = -449.0;
/// Distance of the samples that look for tissue, mm.
const STEP_MM: f64 = 1.0;
/// Thickness of tissue that is not a sheet or a tube in front of the body, mm.
const THICK_MM: f64 = 8.0;
/// Half of the length of the cut, mm.
const HALF_MM: f64 = 30.0;
/// Largest share of half of the cut in the width of the body, and in the height of the scan. The
/// ends of the cut are as far from the ends of the scan as the cut is long.
const HALF_SHARE: (f64, f64) = (0.15, 1.0 / 6.0);
/// Distance of the skin from the straight line between the ends of the cut, mm, that is flat.
const FLAT_MM: f64 = 5.0;
/// Part of the width of the body, to each side of its middle, in which the cut may lie.
const ASIDE: f64 = 0.25;
/// Share of the depth of the body, from the front, behind which everything is fixed.
const FREE_SHARE: f64 = 0.6;

/// The commented scene of [`template`] for a volume. Its cut runs up the front of the body, across
/// the lines of tension of the trunk, where a cut opens most. A comment has a cut across the body,
/// for a limb. What lies behind is fixed, as on a table. All is a beginning, to be changed.
///
/// # Errors
/// [`Error::Volume`] if the volume cannot be read, and [`Error::Request`] if there is no tissue in
/// its middle.
pub fn template_for(path: &Path, options: &ReadOptions) -> Result<String, Error> {
    let loaded = cutis_volume::read(path, options)?;
    let site = Site::find(&loaded.volume).ok_or_else(|| Error::Request {
        what: "VOLUME".into(),
        why: format!(
            "{} has no tissue at the front of its middle slice, above {AIR_HU} HU and {THICK_MM} mm thick: \
             `cutis inspect` shows its HU; without VOLUME the command prints a scene to fill in",
            path.display()
        ),
    })?;
    let mut volume = format!("path = {}", toml::Value::String(path.to_string_lossy().into_owned()));
    if let Some(number) = options.series {
        volume += &format!("\nseries = {number}");
    }
    if options.resample {
        volume += "\nresample = true";
    }
    // Adding zero removes the sign of a rounded -0.
    let point = |mm: [f64; 3]| format!("{:?}", mm.map(|mm| (mm * 10.0).round() / 10.0 + 0.0));
    let lines = [
        ("path = ", volume),
        ("from_mm = ", format!("from_mm = {}", point(site.up_mm[0]))),
        ("to_mm = ", format!("to_mm = {}", point(site.up_mm[1]))),
        ("# from_mm = ", format!("# from_mm = {}{FOR_LIMB}", point(site.across_mm[0]))),
        ("# to_mm = ", format!("# to_mm = {}", point(site.across_mm[1]))),
        (
            "# planes = ",
            format!("planes = [{{ point_mm = {}, normal = [0.0, -1.0, 0.0] }}]", point(site.behind_mm)),
        ),
    ];
    let changed = |line: &str| match lines.iter().find(|(start, _)| line.starts_with(start)) {
        Some((_, new)) => format!("{new}\n"),
        None => format!("{line}\n"),
    };
    Ok(template().lines().map(changed).collect())
}

/// Says when the second cut is the one to take.
const FOR_LIMB: &str = "    # for preset = \"limb\" or \"arm\": their lines run along z";

/// Where a first cut is possible, world mm.
#[derive(Debug, PartialEq)]
struct Site {
    /// The ends of a cut along z.
    up_mm: [[f64; 3]; 2],
    /// The ends of a cut along x.
    across_mm: [[f64; 3]; 2],
    /// Where the fixed part of the body begins.
    behind_mm: [f64; 3],
}

impl Site {
    /// Looks at the slice in the middle of the volume, from the front.
    fn find(volume: &Volume) -> Option<Self> {
        let (low, high) = bounds(volume);
        let z = (low.z + high.z) / 2.0;
        let columns = samples(low.x, high.x);
        let front = |x: f64| front(volume, x, z, [low.y, high.y]);
        let with_tissue: Vec<(f64, f64)> = columns.filter_map(|x| Some((x, front(x)?))).collect();
        let (first, last) = (with_tissue.first()?.0, with_tissue.last()?.0);
        // The middle of the widest part without a gap: an arm next to the body does not count.
        let gap = |pair: &[(f64, f64)]| pair[1].0 - pair[0].0 > 1.5 * STEP_MM;
        let ends: Vec<usize> = (1..with_tissue.len()).filter(|&n| gap(&with_tissue[n - 1..=n])).collect();
        let starts = [0].into_iter().chain(ends.iter().copied());
        let stops = ends.iter().copied().chain([with_tissue.len()]);
        let widest = starts.zip(stops).max_by_key(|(start, stop)| stop - start)?;
        let part = &with_tissue[widest.0..widest.1];
        let (left, right) = (part.first().map_or(first, |c| c.0), part.last().map_or(last, |c| c.0));
        let (middle, width) = ((left + right) / 2.0, right - left);
        let half = HALF_MM.min(HALF_SHARE.0 * width).min(HALF_SHARE.1 * (high.z - low.z));
        let place = |x: f64, z: f64| Some([x, self::front(volume, x, z, [low.y, high.y])?, z]);
        let y = front(middle)?;
        let back = samples(low.y, high.y).find(|&y| is_tissue(volume, [middle, y, z]))?;
        let behind = y - FREE_SHARE * (y - back);
        let aside = samples(0.0, ASIDE * width).flat_map(|by| [middle - by, middle + by]);
        // The sides of a round body are too near to the part that is fixed.
        let free = |points: &Vec<[f64; 3]>| points.iter().all(|[_, y, _]| y - behind >= 2.0 * half);
        let across_mm = [place(middle - half, z)?, place(middle + half, z)?];
        // Where the front is steep, as at a chin, the cut runs across the body.
        let up_mm = flattest(aside, |x| line(|by| place(x, z + by), half).filter(free))
            .filter(|[from, to]| (from[1] - to[1]).abs() <= 2.0 * half)
            .unwrap_or(across_mm);
        Some(Self { up_mm, across_mm, behind_mm: [middle, behind, z] })
    }
}

/// The points of the skin along a line of length `2 half`. None if the skin has a gap there.
fn line(place: impl Fn(f64) -> Option<[f64; 3]>, half: f64) -> Option<Vec<[f64; 3]>> {
    let count = (2.0 * half / STEP_MM).ceil().max(1.0);
    (0..=count as usize).map(|n| place(half * (2.0 * n as f64 / count - 1.0))).collect()
}

/// The ends of the first flat line, or of the flattest one if none is flat.
fn flattest(
    places: impl Iterator<Item = f64>,
    line: impl Fn(f64) -> Option<Vec<[f64; 3]>>,
) -> Option<[[f64; 3]; 2]> {
    let mut best: Option<(f64, [[f64; 3]; 2])> = None;
    for points in places.filter_map(line) {
        let (Some(&from), Some(&to)) = (points.first(), points.last()) else { continue };
        let last = (points.len() - 1) as f64;
        let off =
            |(n, point): (usize, &[f64; 3])| (point[1] - from[1] - (to[1] - from[1]) * n as f64 / last).abs();
        let off = points.iter().enumerate().map(off).fold(0.0, f64::max);
        if best.is_none_or(|(least, _)| off < least) {
            best = Some((off, [from, to]));
        }
        if off <= FLAT_MM {
            break;
        }
    }
    best.map(|(_, ends)| ends)
}

/// The first y from the front at which thick tissue begins.
fn front(volume: &Volume, x: f64, z: f64, [low, high]: [f64; 2]) -> Option<f64> {
    let needed = (THICK_MM / STEP_MM) as usize;
    let mut run = 0;
    let found = samples(low, high).rev().find(|&y| {
        run = if is_tissue(volume, [x, y, z]) { run + 1 } else { 0 };
        run == needed
    })?;
    Some(found + (needed - 1) as f64 * STEP_MM)
}

fn is_tissue(volume: &Volume, mm: [f64; 3]) -> bool {
    let index = volume.grid().affine.to_index(mm.into());
    let shape = volume.grid().shape;
    let inside = (0..3).all(|axis| (0.0..=(shape[axis] - 1) as f64).contains(&index[axis]));
    inside && volume.trilinear(index) > AIR_HU
}

/// Values from `low` to `high`.
fn samples(low: f64, high: f64) -> impl DoubleEndedIterator<Item = f64> {
    (0..=((high - low) / STEP_MM) as usize).map(move |n| low + n as f64 * STEP_MM)
}

/// Lowest and highest coordinates of the voxel centers, world mm.
fn bounds(volume: &Volume) -> (Point3<f64>, Point3<f64>) {
    let shape = volume.grid().shape;
    let corner = |n: usize| -> Point3<f64> {
        volume.grid().mm([0, 1, 2].map(|axis| if n >> axis & 1 == 1 { shape[axis] - 1 } else { 0 }))
    };
    let start = corner(0);
    (1..8).map(corner).fold((start, start), |(low, high), at| (low.inf(&at), high.sup(&at)))
}

#[cfg(test)]
mod tests {
    use cutis_volume::{Affine, Grid};
    use nalgebra::Vector3;

    use super::*;
    use crate::Scene;

    /// A block of tissue from x = 10 to 90, y = 20 to 60, and an arm from x = 110 to 120, in a
    /// volume whose axes run to the left and to the back.
    fn block() -> Volume {
        let affine = Affine::from_rows([
            [-2.0, 0.0, 0.0, 140.0],
            [0.0, -2.0, 0.0, 100.0],
            [0.0, 0.0, 2.0, -20.0],
            [0.0, 0.0, 0.0, 1.0],
        ]);
        let grid = Grid { shape: [71, 51, 21], affine: affine.unwrap() };
        let hu = |n: usize| {
            let [x, y, _] = grid.mm(grid.point(n)).into();
            let body = (10.0..=90.0).contains(&x) || (110.0..=120.0).contains(&x);
            // A sheet in front of the body.
            let inside = (20.0..=60.0).contains(&y) || (80.0..=82.0).contains(&y);
            if body && inside { 40 } else { -1000 }
        };
        Volume::new(grid, (0..grid.len()).map(hu).collect(), 1.0, 0.0).unwrap()
    }

    #[test]
    fn the_cut_runs_up_the_front_of_the_widest_part() {
        let site = Site::find(&block()).unwrap();
        // The scan is 40 mm high, so that a cut of 13.3 mm is as far from its ends.
        let expected = [[50.0, 60.5, -6.67], [50.0, 60.5, 6.67], [43.3, 60.5, 0.0], [56.7, 60.5, 0.0]];
        for (found, expected) in site.up_mm.into_iter().chain(site.across_mm).zip(expected) {
            let distance = (Vector3::from(found) - Vector3::from(expected)).norm();
            assert!(distance <= 2.0, "{found:?} is not {expected:?}");
        }
        assert!((site.behind_mm[1] - (60.5 - 0.6 * 41.0)).abs() < 2.0, "{site:?}");
        let air = Volume::new(*block().grid(), vec![-1000; block().grid().len()], 1.0, 0.0).unwrap();
        assert_eq!(Site::find(&air), None);
    }

    /// A ridge and a hole in the middle of the front. The cut lies next to them.
    #[test]
    fn the_cut_avoids_uneven_and_open_skin() {
        let grid = *block().grid();
        let ridge = |n: usize| {
            let [x, y, z] = grid.mm(grid.point(n)).into();
            let hole = (44.0..=50.0).contains(&x) && (1.0..5.0).contains(&z);
            let front = if (50.0..=56.0).contains(&x) && z > 0.0 { 74.0 } else { 60.0 };
            let inside = (10.0..=90.0).contains(&x) && (20.0..=front).contains(&y) && !hole;
            if inside { 40 } else { -1000 }
        };
        let volume = Volume::new(grid, (0..grid.len()).map(ridge).collect(), 1.0, 0.0).unwrap();
        let [from, to] = Site::find(&volume).unwrap().up_mm;
        assert!(from[0] == to[0] && (from[1] - to[1]).abs() <= FLAT_MM, "{from:?} {to:?}");
        assert!(!(44.0..=56.0).contains(&from[0]) && (30.0..=70.0).contains(&from[0]), "{from:?}");
    }

    #[test]
    fn the_scene_of_a_volume_is_valid_and_names_it() {
        let here = tempfile::tempdir().unwrap();
        let path = here.path().join("a \"b\".nii.gz");
        cutis_volume::write(&path, &block()).unwrap();
        let text = template_for(&path, &ReadOptions { resample: true, ..ReadOptions::default() }).unwrap();
        let loaded = Scene::parse(&text, Path::new("scene.toml"), here.path(), &[]).unwrap();
        assert_eq!(loaded.scene.volume.path.as_deref(), Some(&*path));
        assert!(loaded.scene.volume.resample && loaded.scene.fixed.planes.len() == 1);
        assert_ne!(text, template());
        let missing = template_for(&here.path().join("none.nii"), &ReadOptions::default());
        assert!(matches!(missing, Err(Error::Volume(_))), "{missing:?}");
    }
}
