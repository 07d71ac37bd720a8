//! Ranges: every number of a scene is checked here, once, and named with its key when it is out of range.

use std::path::Path;

use cutis_mesh::Grading;

use super::*;
use crate::Error;

/// Names the file and collects nothing: the first bad value is reported.
struct Check<'a> {
    file: &'a Path,
}

impl Check<'_> {
    fn require(&self, ok: bool, key: &str, value: impl ToString, why: &str) -> Result<(), Error> {
        if ok {
            return Ok(());
        }
        Err(Error::SceneKey {
            file: self.file.into(),
            key: key.into(),
            value: value.to_string(),
            why: why.into(),
        })
    }

    fn positive(&self, key: &str, value: f64) -> Result<(), Error> {
        self.require(
            value.is_finite() && value > 0.0,
            key,
            format!("{value:?}"),
            "must be a finite number above 0",
        )
    }

    fn not_negative(&self, key: &str, value: f64) -> Result<(), Error> {
        self.require(
            value.is_finite() && value >= 0.0,
            key,
            format!("{value:?}"),
            "must be a finite number, 0 or more",
        )
    }

    fn share(&self, key: &str, value: f64) -> Result<(), Error> {
        self.require((0.0..=1.0).contains(&value), key, format!("{value:?}"), "must lie between 0 and 1")
    }

    fn point(&self, key: &str, value: [f64; 3]) -> Result<(), Error> {
        let finite = value.iter().all(|v| v.is_finite());
        self.require(finite, key, format!("{value:?}"), "must be three finite numbers")
    }

    /// `corners` as given and, if they make a zone, the zone.
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

    fn plane(&self, key: &str, plane: &PlaneSection) -> Result<(), Error> {
        self.point(&format!("{key}.point_mm"), plane.point_mm)?;
        self.point(&format!("{key}.normal"), plane.normal)?;
        let length = plane.normal.iter().map(|v| v * v).sum::<f64>();
        let normal = format!("{:?}", plane.normal);
        self.require(
            length > 0.0 && length.is_finite(),
            &format!("{key}.normal"),
            normal,
            "must not be the zero vector",
        )
    }
}

impl Scene {
    /// Checks every value.
    ///
    /// # Errors
    /// [`Error::SceneKey`] with the first key whose value cannot be used.
    pub(super) fn validate(&self, file: &Path) -> Result<(), Error> {
        let check = Check { file };
        self.validate_body(&check)?;
        self.validate_chainmail(&check)?;
        self.validate_constraints(&check)?;
        for (n, i) in self.incision.iter().enumerate() {
            check.point(&format!("incision[{n}].from_mm"), i.from_mm)?;
            check.point(&format!("incision[{n}].to_mm"), i.to_mm)?;
            check.positive(&format!("incision[{n}].depth_mm"), i.depth_mm)?;
            check.positive(&format!("incision[{n}].width_mm"), i.width_mm)?;
            self.validate_time(&check, &format!("incision[{n}].at_s"), i.at_s)?;
            let to = format!("{:?}", i.to_mm);
            check.require(
                i.from_mm != i.to_mm,
                &format!("incision[{n}].to_mm"),
                to,
                "must differ from from_mm",
            )?;
        }
        for (n, h) in self.handle.iter().enumerate() {
            check.point(&format!("handle[{n}].at_mm"), h.at_mm)?;
            check.point(&format!("handle[{n}].move_mm"), h.move_mm)?;
            check.positive(&format!("handle[{n}].radius_mm"), h.radius_mm)?;
            check.positive(&format!("handle[{n}].over_s"), h.over_s)?;
        }
        let s = &self.solver;
        let named = s.adapter.as_ref().is_none_or(|adapter| !adapter.trim().is_empty());
        check.require(
            named,
            "solver.adapter",
            "\"\"",
            "must be a part of an adapter's name, or its index; `cutis devices` lists them",
        )?;
        check.positive("solver.dt_s", s.dt_s)?;
        check.require(s.substeps > 0, "solver.substeps", s.substeps, "must be 1 or more")?;
        check.require(s.iterations > 0, "solver.iterations", s.iterations, "must be 1 or more")?;
        let (lowest, highest) = if s.formulation == FormulationChoice::Vbd { (0.0, 2.0) } else { (1.0, 1.0) };
        let relaxed = s.relaxation == 1.0 || (s.relaxation > lowest && s.relaxation < highest);
        let why = "must be above 0 and below 2 with solver.formulation = \"vbd\", and 1 otherwise";
        check.require(relaxed, "solver.relaxation", s.relaxation, why)?;
        check.require(
            s.threads <= 1024,
            "solver.threads",
            s.threads,
            "must be at most 1024; 0 takes all cores",
        )?;
        check.point("solver.gravity_m_s2", s.gravity_m_s2)?;
        check.not_negative("solver.damping_per_s", s.damping_per_s)
    }

    /// The time of an incision: ChainMail alone can cut what has begun to move, and what is never cut is no incision.
    fn validate_time(&self, check: &Check<'_>, key: &str, at_s: f64) -> Result<(), Error> {
        check.not_negative(key, at_s)?;
        let why = "must be 0 with model = \"pbd\", whose incisions are there from the start";
        check.require(at_s == 0.0 || self.model == Model::Chainmail, key, at_s, why)?;
        let last = f64::from(self.run.frames.saturating_sub(1)) * self.solver.dt_s;
        let why = format!("must not lie after the beginning of the last frame, at {last} s (run.frames)");
        check.require(at_s <= last || at_s == 0.0, key, at_s, &why)
    }

    fn validate_chainmail(&self, check: &Check<'_>) -> Result<(), Error> {
        if let Some(chainmail) = &self.chainmail {
            chainmail.table(check.file, &self.tissue)?;
        }
        let even = self.model != Model::Chainmail || self.lattice.grading.is_none();
        let why = "must be left out with model = \"chainmail\", whose links all have the lattice's one step";
        check.require(even, "lattice.grading", "", why)
    }

    fn validate_body(&self, check: &Check<'_>) -> Result<(), Error> {
        let v = &self.volume;
        match (&v.path, &v.phantom) {
            (Some(path), None) => {
                let name = path.to_string_lossy();
                check.require(!name.is_empty(), "volume.path", "", "must name a NIfTI file")?;
            }
            (None, Some(_)) => {}
            _ => {
                let why = "must have exactly one of `path` (a NIfTI file) and `phantom` (a size and a seed)";
                check.require(false, "volume", "", why)?;
            }
        }
        let l = &self.lattice;
        check.require(
            l.spacing_mm.is_none() || l.vertices.is_none(),
            "lattice",
            "",
            "must have at most one of `spacing_mm` and `vertices`",
        )?;
        if let Some(spacing) = l.spacing_mm {
            check.positive("lattice.spacing_mm", spacing)?;
        }
        if let Some(n) = l.vertices {
            let why = "must be at least 2 along each axis";
            check.require(n.iter().all(|&n| n >= 2), "lattice.vertices", format!("{n:?}"), why)?;
        }
        self.validate_leaving_out(check)?;
        let air = self.tissue.air_below_hu;
        check.require(air.is_finite(), "tissue.air_below_hu", air, "must be a finite HU value")?;
        for (n, plane) in self.tissue.cut_planes.iter().enumerate() {
            check.plane(&format!("tissue.cut_planes[{n}]"), plane)?;
        }
        let bone = self.fixed.bone_above_hu.unwrap_or(0.0);
        check.require(bone.is_finite(), "fixed.bone_above_hu", bone, "must be a finite HU value")?;
        for (n, plane) in self.fixed.planes.iter().enumerate() {
            check.plane(&format!("fixed.planes[{n}]"), plane)?;
        }
        for (n, b) in self.fixed.boxes.iter().enumerate() {
            check.corners(&format!("fixed.boxes[{n}]"), b.min_mm, b.max_mm)?;
        }
        Ok(())
    }

    fn validate_leaving_out(&self, check: &Check<'_>) -> Result<(), Error> {
        let acts = !self.incision.is_empty() || !self.handle.is_empty();
        if let Some(region) = &self.lattice.region {
            let corners = [region.min_mm, region.max_mm];
            check.zone("lattice.region", region.around_mm, corners, region.zone(), acts)?;
        }
        if let Some(grading) = &self.lattice.grading {
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

    fn validate_constraints(&self, check: &Check<'_>) -> Result<(), Error> {
        let c = &self.constraints;
        if let Some(d) = &c.distance {
            check.positive("constraints.distance.youngs_modulus_pa", d.youngs_modulus_pa)?;
            check.share("constraints.distance.stiffness", d.stiffness)?;
        }
        if let Some(v) = &c.volume {
            check.positive("constraints.volume.bulk_modulus_pa", v.bulk_modulus_pa)?;
            check.share("constraints.volume.stiffness", v.stiffness)?;
        }
        let Some(s) = &c.stc else { return Ok(()) };
        check.positive("constraints.stc.area_modulus_n_per_m", s.area_modulus_n_per_m)?;
        check.share("constraints.stc.stiffness", s.stiffness)?;
        check.not_negative("constraints.stc.amplification", s.amplification)?;
        check.positive("constraints.stc.rest_area_scale", s.rest_area_scale)?;
        let paper_elsewhere = s.form == StcForm::Paper && self.solver.formulation != FormulationChoice::Pbd;
        let why = "works with solver.formulation = \"pbd\" only; use \"energy\" with xpbd and vbd";
        check.require(!paper_elsewhere, "constraints.stc.form", "paper", why)?;
        let positive_stiffness = s.form == StcForm::Energy || s.stiffness > 0.0;
        let why = "must be above 0 for the paper form, whose clamp is 1/stiffness";
        check.require(positive_stiffness, "constraints.stc.stiffness", s.stiffness, why)?;
        if let Some(near) = &s.near_incision {
            check.positive("constraints.stc.near_incision.radius_mm", near.radius_mm)?;
            check.positive("constraints.stc.near_incision.rest_area_factor", near.rest_area_factor)?;
            check.positive("constraints.stc.near_incision.stiffness_factor", near.stiffness_factor)?;
        }
        Ok(())
    }
}
