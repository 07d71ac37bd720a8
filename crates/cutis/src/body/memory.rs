//! The memory that a lattice takes, compared with what the system can give. A lattice that is too
//! fine is refused by name before anything of its size is allocated.

use std::fs;
use std::path::Path;

use cutis_solver::Formulation;
use cutis_volume::{Grid, VolumeError};

use super::BodySections;
use crate::Error;
use crate::model::ModelChoice;
use crate::scene::{LatticeSection, RunEnd, Scene};

/// Peak of the memory per lattice point while the body is found, bytes. `cutis skin` took 12.7 on
/// the phantom, for 0.2 to 5.9 million points.
const BYTES_PER_POINT: u64 = 13;

/// Tetrahedra per point of tissue of a lattice that is split into five per cell.
const TETS_PER_POINT: u64 = 5;

/// Peak of the memory per tetrahedron of a scene, bytes. `cutis check` of the phantom took 33 with
/// ChainMail, 79 with XPBD and 176 to 190 with vertex block descent, a membrane and materials, for
/// 3.5 to 10.7 million tetrahedra, besides the lattice points. A search for the state of rest comes
/// on top.
pub(super) fn bytes_per_tet(scene: &Scene) -> u64 {
    let of_model = match (scene.model, scene.solver.formulation) {
        (ModelChoice::Chainmail, _) => 33,
        (ModelChoice::Pbd, Formulation::Vbd) => 175,
        (ModelChoice::Pbd, _) => 79,
    };
    let of_search = match scene.run.until {
        RunEnd::Frames => 0,
        RunEnd::Rest => cutis_rest::Body::SEARCH_BYTES_PER_VERTEX as u64 / TETS_PER_POINT,
    };
    of_model + of_search
}

/// Refuses a lattice of `points` points whose body cannot be found in the memory of this machine.
pub(super) fn check_points(sections: &BodySections<'_>, points: usize) -> Result<(), Error> {
    refuse_above(available(), sections, points as u64 * BYTES_PER_POINT, &format!("{points} lattice points"))
}

/// Refuses a lattice with `points` points in tissue whose body is certainly too large, before the
/// body is built. Pieces besides the largest one may be left out, so that only twice the memory is
/// refused here. A scene with a region or a graded lattice is judged later.
pub(super) fn check_tissue(sections: &BodySections<'_>, points: usize) -> Result<(), Error> {
    let LatticeSection { region, grading, .. } = sections.lattice;
    if region.is_some() || grading.is_some() {
        return Ok(());
    }
    let tets = TETS_PER_POINT.saturating_mul(points as u64);
    let needed = tets.saturating_mul(sections.bytes_per_tet);
    let available = available().filter(|&available| needed / 2 > available);
    refuse_above(available, sections, needed, &format!("about {tets} tetrahedra"))
}

/// Refuses a body whose estimate is far too large, before its lattice is sampled. The estimate may
/// hold a table that is left out later, so that only one and a half times the memory is refused.
pub(super) fn check_estimate(sections: &BodySections<'_>, tets: Option<u64>) -> Result<(), Error> {
    let tets = tets.unwrap_or(0);
    let needed = tets.saturating_mul(sections.bytes_per_tet);
    let available = available().filter(|&available| needed / 3 * 2 > available);
    refuse_above(available, sections, needed, &format!("about {tets} tetrahedra"))
}

/// Refuses a body of `tets` tetrahedra that cannot be simulated in the memory of this machine.
pub(super) fn check_tets(sections: &BodySections<'_>, tets: usize) -> Result<(), Error> {
    refuse_above(available(), sections, tets as u64 * sections.bytes_per_tet, &format!("{tets} tetrahedra"))
}

/// The error of a spacing that is too large for the scan, or so small that the points of the
/// lattice cannot be counted. Other errors name the section.
pub(super) fn lattice_size(sections: &BodySections<'_>, scan: &Grid, error: VolumeError) -> Error {
    let (VolumeError::LatticeSize { vertices, most, .. }, Some(spacing)) =
        (&error, sections.lattice.spacing_mm)
    else {
        return sections.file.blame("lattice")(error);
    };
    let steps = scan.affine.spacing_mm();
    let sides: [f64; 3] = std::array::from_fn(|axis| scan.shape[axis].saturating_sub(1) as f64 * steps[axis]);
    let shortest = sides.into_iter().fold(f64::INFINITY, f64::min);
    let points: f64 = vertices.iter().product();
    let why = match points > *most as f64 {
        true => {
            let fits = (*most).min(available().map_or(*most, |available| available / BYTES_PER_POINT));
            format!(
                "gives {points:.2e} lattice points over a scan of {:.0} x {:.0} x {:.0} mm; use {:.2} or more",
                sides[0],
                sides[1],
                sides[2],
                (spacing * (points / fits as f64).cbrt() * 100.0).ceil() / 100.0
            )
        }
        false => {
            format!("is more than the scan has along its shortest side, {shortest:.1} mm; use at most that")
        }
    };
    sections.file.bad_key("lattice.spacing_mm", &spacing.to_string(), &why)
}

/// Refuses a lattice of `points` points outside a scene.
pub(super) fn check_request(points: usize) -> Result<(), Error> {
    let (needed, available) = (points as u64 * BYTES_PER_POINT, available().unwrap_or(u64::MAX));
    if needed <= available {
        return Ok(());
    }
    let why = format!("{}; use a larger spacing", comparison(needed, available, &format!("{points} points")));
    Err(Error::Request { what: "--lattice".into(), why })
}

fn refuse_above(
    available: Option<u64>,
    sections: &BodySections<'_>,
    needed: u64,
    what: &str,
) -> Result<(), Error> {
    let Some(available) = available.filter(|&available| needed > available) else { return Ok(()) };
    let LatticeSection { spacing_mm, vertices, .. } = sections.lattice;
    let (key, value) = match (spacing_mm, vertices) {
        (Some(spacing), _) => ("lattice.spacing_mm", spacing.to_string()),
        (None, Some(vertices)) => ("lattice.vertices", format!("{vertices:?}")),
        (None, None) => ("lattice", String::new()),
    };
    // The memory goes with the number of points, which goes with the third power of the step.
    let factor = (needed as f64 / available as f64).cbrt();
    let remedy = match spacing_mm {
        Some(spacing) => format!("use {:.2} or more", (spacing * factor * 100.0).ceil() / 100.0),
        None => format!("use a spacing_mm that is {factor:.1} times as large"),
    };
    let zones =
        "or leave tissue out (lattice.region), or use fewer points far from the cut (lattice.grading)";
    let why = format!("{}; {remedy}, {zones}", comparison(needed, available, what));
    Err(sections.file.bad_key(key, &value, &why))
}

fn comparison(needed: u64, available: u64, what: &str) -> String {
    let gb = |bytes: u64| bytes as f64 / 1e9;
    format!("{what} take about {:.1} GB of memory, and {:.1} GB are available", gb(needed), gb(available))
}

/// Memory that the system can give to this process, bytes: what is free, within the limits of its
/// control group and of its address space. None if the system does not tell. Linux only.
fn available() -> Option<u64> {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let meminfo = read("/proc/meminfo");
    let free = kib(&meminfo, "MemAvailable:").map(|free| free + kib(&meminfo, "SwapFree:").unwrap_or(0));
    let address_space = soft_limit(&read("/proc/self/limits"), "Max address space")
        .map(|limit| limit.saturating_sub(kib(&read("/proc/self/status"), "VmSize:").unwrap_or(0)));
    [free, address_space, control_group(&read("/proc/self/cgroup"))].into_iter().flatten().min()
}

/// What a control group of version 2 leaves of its limit, the least of the group and those above.
fn control_group(groups: &str) -> Option<u64> {
    let group = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let root = Path::new("/sys/fs/cgroup");
    let number = |file: &Path| fs::read_to_string(file).ok()?.trim().parse::<u64>().ok();
    let left = |folder: &Path| {
        Some(number(&folder.join("memory.max"))?.saturating_sub(number(&folder.join("memory.current"))?))
    };
    let folder = root.join(group);
    folder.ancestors().take_while(|folder| folder.starts_with(root)).filter_map(left).min()
}

/// A number of KiB in a file of `/proc`, as bytes.
fn kib(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// The soft limit in `/proc/self/limits`, bytes. None if it is unlimited.
fn soft_limit(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LoadedScene;

    #[test]
    fn the_files_of_the_system_are_understood() {
        let meminfo = "MemTotal:       24000000 kB\nMemAvailable:    1000 kB\nSwapFree:  0 kB\n";
        assert_eq!(kib(meminfo, "MemAvailable:"), Some(1_024_000));
        assert_eq!(kib(meminfo, "VmSize:"), None);
        let limits = "Limit                     Soft Limit           Hard Limit           Units\n\
                      Max address space         4096000              unlimited            bytes\n";
        assert_eq!(soft_limit(limits, "Max address space"), Some(4_096_000));
        assert_eq!(soft_limit(&limits.replace("4096000", "unlimited"), "Max address space"), None);
        assert_eq!(control_group("12:cpu:/old\n"), None);
    }

    #[test]
    fn a_lattice_that_needs_more_than_there_is_names_its_key() {
        let loaded = crate::demo(&[]).unwrap();
        let sections = BodySections::of(&loaded);
        refuse_above(Some(8_000_000_000), &sections, 8_000_000_000, "n").unwrap();
        refuse_above(None, &sections, u64::MAX, "n").unwrap();
        let error = refuse_above(Some(1_000_000_000), &sections, 8_000_000_000, "n points").unwrap_err();
        let text = error.to_string();
        let spacing = loaded.scene.lattice.spacing_mm.unwrap();
        for words in ["lattice.spacing_mm", "n points take about 8.0 GB", "1.0 GB are available"] {
            assert!(text.contains(words), "{text}");
        }
        assert!(text.contains(&format!("use {:.2} or more", 2.0 * spacing)), "{text}");
        assert!(error.is_bad_input());
    }

    /// A search for the state of rest needs the memory of its vertices, too.
    #[test]
    fn a_search_for_rest_counts() {
        let mut loaded = crate::demo(&[]).unwrap();
        let per_tet = |until: RunEnd, loaded: &mut LoadedScene| {
            loaded.scene.run.until = until;
            BodySections::of(loaded).bytes_per_tet
        };
        let (frames, rest) = (per_tet(RunEnd::Frames, &mut loaded), per_tet(RunEnd::Rest, &mut loaded));
        let of_vertex = cutis_rest::Body::SEARCH_BYTES_PER_VERTEX as u64;
        assert_eq!((rest - frames) * TETS_PER_POINT, of_vertex);
    }

    /// Far too much tissue is refused before the body is built, unless a region leaves most of it
    /// out.
    #[test]
    fn far_too_much_tissue_is_refused_early() {
        let mut loaded = crate::demo(&[]).unwrap();
        let most = 1 << 50;
        check_tissue(&BodySections::of(&loaded), most).unwrap();
        loaded.scene.lattice.region = None;
        let sections = BodySections::of(&loaded);
        check_tissue(&sections, 1000).unwrap();
        check_estimate(&sections, None).unwrap();
        check_estimate(&sections, Some(1000)).unwrap();
        if available().is_some() {
            let early = check_estimate(&sections, Some(most as u64)).unwrap_err().to_string();
            assert!(early.contains("about 1125899906842624 tetrahedra take"), "{early}");
            let text = check_tissue(&sections, most).unwrap_err().to_string();
            assert!(text.contains("tetrahedra take about") && text.contains("lattice.spacing_mm"), "{text}");
        }
    }
}
