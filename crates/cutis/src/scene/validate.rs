//! The range of every number of a scene. A value out of range is an error that names its key.

use cutis_mesh::{Grading, HalfSpace};
use cutis_solver::Formulation;

use super::*;
use crate::{Error, model};

/// Largest value that is added to the HU of a file. Offsets of 1000, 1024, 8192 and 32768 are in
/// use.
const MOST_OFFSET_HU: f32 = 32768.0;

/// Checks values of one scene file; the first bad value is an error.
pub(crate) struct Check<'a> {
    pub(crate) file: SceneFile<'a>,
}

impl Check<'_> {
    pub(crate) fn require(&self, ok: bool, key: &str, value: impl ToString, why: &str) -> Result<(), Error> {
        if ok { Ok(()) } else { Err(self.file.bad_key(key, &value.to_string(), why)) }
    }

    pub(crate) fn positive(&self, key: &str, value: f64) -> Result<(), Error> {
        let ok = value.is_finite() && value > 0.0;
        self.require(ok, key, format!("{value:?}"), "must be a finite number above 0")
    }

    pub(crate) fn not_negative(&self, key: &str, value: f64) -> Result<(), Error> {
        let ok = value.is_finite() && value >= 0.0;
        self.require(ok, key, format!("{value:?}"), "must be a finite number, 0 or more")
    }

    pub(crate) fn share(&self, key: &str, value: f64) -> Result<(), Error> {
        self.require((0.0..=1.0).contains(&value), key, format!("{value:?}"), "must lie between 0 and 1")
    }

    fn finite(&self, key: &str, value: f32) -> Result<(), Error> {
        self.require(value.is_finite(), key, value, "must be a finite HU value")
    }

    pub(crate) fn point(&self, key: &str, value: [f64; 3]) -> Result<(), Error> {
        let finite = value.iter().all(|v| v.is_finite());
        self.require(finite, key, format!("{value:?}"), "must be three finite numbers")
    }

    /// Checks a zone, given by `around_mm` or by two corners. `acts`: the scene has an incision or
    /// a handle.
    fn zone(
        &self,
        key: &str,
        around_mm: Option<f64>,
        corners: [Option<[f64; 3]>; 2],
        zone: Option<Zone>,
        acts: bool,
    ) -> Result<(), Error> {
        let why = "must have `around_mm`, or `min_mm` and `max_mm`, and not both";
        self.require(zone.is_some(), key, "", why)?;
        if let Some(around) = around_mm {
            self.positive(&format!("{key}.around_mm"), around)?;
            let why = "needs an incision or a handle to be around; without them give `min_mm` and `max_mm`";
            self.require(acts, &format!("{key}.around_mm"), around, why)?;
        }
        if let [Some(min), Some(max)] = corners {
            self.corners(key, min, max)?;
        }
        Ok(())
    }

    fn corners(&self, key: &str, min_mm: [f64; 3], max_mm: [f64; 3]) -> Result<(), Error> {
        self.point(&format!("{key}.min_mm"), min_mm)?;
        self.point(&format!("{key}.max_mm"), max_mm)?;
        let ordered = min_mm.iter().zip(&max_mm).all(|(low, high)| low <= high);
        self.require(ordered, &format!("{key}.max_mm"), format!("{max_mm:?}"), "must not lie below min_mm")
    }

    fn plane(&self, key: &str, plane: &HalfSpace) -> Result<(), Error> {
        self.point(&format!("{key}.point_mm"), plane.point_mm)?;
        self.point(&format!("{key}.normal"), plane.normal)?;
        let length = plane.normal.iter().map(|v| v * v).sum::<f64>();
        let ok = length > 0.0 && length.is_finite();
        let normal = format!("{:?}", plane.normal);
        self.require(ok, &format!("{key}.normal"), normal, "must not be the zero vector")
    }
}

impl Scene {
    /// Checks every value.
    ///
    /// # Errors
    /// [`Error::SceneKey`] with the first key whose value cannot be used.
    pub(super) fn validate(&self, file: SceneFile<'_>) -> Result<(), Error> {
        let check = Check { file };
        self.validate_volume(&check)?;
        self.validate_lattice(&check)?;
        self.validate_tissue(&check)?;
        self.validate_materials(&check)?;
        model::validate(self, &check)?;
        self.validate_solver(&check)?;
        self.validate_run(&check)?;
        self.validate_cuts(&check)?;
        self.validate_handles(&check)
    }

    fn validate_volume(&self, check: &Check<'_>) -> Result<(), Error> {
        let section = &self.volume;
        let file = section.path.is_some();
        let why = "is for a volume that is read: it needs `path`";
        if let Some(series) = section.series {
            check.require(file, "volume.series", series, why)?;
        }
        check.require(file || !section.resample, "volume.resample", section.resample, why)?;
        let (key, offset) = ("volume.offset_hu", section.offset_hu);
        let range = format!("must lie between -{MOST_OFFSET_HU} and {MOST_OFFSET_HU} HU");
        check.require(offset.abs() <= MOST_OFFSET_HU, key, offset, &range)?;
        let why = "must be left out next to `phantom`, whose values are HU";
        check.require(offset == 0.0 || section.phantom.is_none(), key, offset, why)?;
        match (&section.path, &section.phantom) {
            (Some(path), None) => {
                let name = path.to_string_lossy();
                check.require(
                    !name.is_empty(),
                    "volume.path",
                    "",
                    "must name a volume file or a DICOM folder",
                )
            }
            (None, Some(phantom)) => check.point("volume.phantom.turn_deg", phantom.turn_deg),
            _ => {
                let why = "must have exactly one of `path` (a volume file or a DICOM folder) and `phantom` (a size and a seed)";
                check.require(false, "volume", "", why)
            }
        }
    }

    fn validate_lattice(&self, check: &Check<'_>) -> Result<(), Error> {
        let lattice = &self.lattice;
        let one = lattice.spacing_mm.is_none() || lattice.vertices.is_none();
        check.require(one, "lattice", "", "must have at most one of `spacing_mm` and `vertices`")?;
        if let Some(spacing) = lattice.spacing_mm {
            check.positive("lattice.spacing_mm", spacing)?;
        }
        if let Some(n) = lattice.vertices {
            let why = "must be at least 2 along each axis";
            check.require(n.iter().all(|&n| n >= 2), "lattice.vertices", format!("{n:?}"), why)?;
        }
        let acts = self.cuts() || !self.handle.is_empty();
        if let Some(RegionSection::Zone(region)) = &lattice.region {
            let corners = [region.min_mm, region.max_mm];
            let zone = Zone::of(region.around_mm, region.min_mm, region.max_mm);
            check.zone("lattice.region", region.around_mm, corners, zone, acts)?;
        }
        if let Some(grading) = &lattice.grading {
            let corners = [grading.min_mm, grading.max_mm];
            check.zone("lattice.grading", grading.around_mm, corners, grading.zone(), acts)?;
            let (growth, coarsest) = (grading.growth, grading.coarsest);
            let fits = |value: f64, most: f64| value > 1.0 && value <= most;
            let why = "must be above 1 and at most 2";
            check.require(fits(growth, Grading::MOST_GROWTH), "lattice.grading.growth", growth, why)?;
            let why = "must be above 1 and at most 8";
            check.require(fits(coarsest, Grading::MOST_COARSE), "lattice.grading.coarsest", coarsest, why)?;
        }
        Ok(())
    }

    fn validate_tissue(&self, check: &Check<'_>) -> Result<(), Error> {
        check.finite("tissue.air_below_hu", self.tissue.air_below_hu)?;
        for (n, plane) in self.tissue.cut_planes.iter().enumerate() {
            check.plane(&format!("tissue.cut_planes[{n}]"), plane)?;
        }
        check.finite("fixed.bone_above_hu", self.fixed.bone_above_hu.unwrap_or(0.0))?;
        for (n, plane) in self.fixed.planes.iter().enumerate() {
            check.plane(&format!("fixed.planes[{n}]"), plane)?;
        }
        for (n, b) in self.fixed.boxes.iter().enumerate() {
            check.corners(&format!("fixed.boxes[{n}]"), b.min_mm, b.max_mm)?;
        }
        Ok(())
    }

    fn validate_handles(&self, check: &Check<'_>) -> Result<(), Error> {
        for (n, handle) in self.handle.iter().enumerate() {
            for (name, point) in [("at_mm", handle.at_mm), ("move_mm", handle.move_mm)] {
                let key = format!("handle[{n}].{name}");
                let why = "is missing: give at_mm and move_mm, or markups";
                check.require(point.is_some(), &key, "", why)?;
                check.point(&key, point.unwrap_or_default())?;
            }
            check.positive(&format!("handle[{n}].radius_mm"), handle.radius_mm)?;
            check.not_negative(&format!("handle[{n}].at_s"), handle.at_s)?;
            check.positive(&format!("handle[{n}].over_s"), handle.over_s)?;
        }
        Ok(())
    }

    fn validate_solver(&self, check: &Check<'_>) -> Result<(), Error> {
        let s = &self.solver;
        let energies = self.model == ModelChoice::Pbd && s.formulation != Formulation::Pbd;
        let why = "needs energies: model = \"pbd\" with solver.formulation = \"vbd\" or \"xpbd\"";
        check.require(energies || self.run.until == RunEnd::Frames, "run.until", "\"rest\"", why)?;
        let named = s.adapter.as_ref().is_none_or(|adapter| !adapter.trim().is_empty());
        let why = "must be a part of an adapter's name, or its index; `cutis devices` lists them";
        check.require(named, "solver.adapter", "\"\"", why)?;
        check.positive("solver.dt_s", s.dt_s)?;
        check.require(s.substeps > 0, "solver.substeps", s.substeps, "must be 1 or more")?;
        check.require(s.iterations > 0, "solver.iterations", s.iterations, "must be 1 or more")?;
        let (lowest, highest) = if s.formulation == Formulation::Vbd { (0.0, 2.0) } else { (1.0, 1.0) };
        let relaxed = s.relaxation == 1.0 || (s.relaxation > lowest && s.relaxation < highest);
        let why = "must be above 0 and below 2 with solver.formulation = \"vbd\", and 1 otherwise";
        check.require(relaxed, "solver.relaxation", s.relaxation, why)?;
        let why = "must be at most 1024; 0 uses all cores";
        check.require(s.threads <= 1024, "solver.threads", s.threads, why)?;
        check.point("solver.gravity_m_s2", s.gravity_m_s2)?;
        check.not_negative("solver.damping_per_s", s.damping_per_s)
    }

    fn validate_run(&self, check: &Check<'_>) -> Result<(), Error> {
        let error = self.run.error;
        check.require(error > 0.0 && error <= 1.0, "run.error", error, "must be above 0 and at most 1")?;
        let every = self.output.series_every;
        let why = "needs frames, or a state of rest: run.frames is 0, and run.until is not \"rest\"";
        let moves = self.run.frames > 0 || self.run.until == RunEnd::Rest;
        check.require(every == 0 || moves, "output.series_every", every, why)
    }
}
