//! The range of every number of the sections that cut and close the body.

use super::validate::Check;
use super::*;
use crate::Error;

impl Scene {
    /// Checks the sections that cut and close the body.
    ///
    /// # Errors
    /// [`Error::SceneKey`] with the first key whose value cannot be used.
    pub(super) fn validate_cuts(&self, check: &Check<'_>) -> Result<(), Error> {
        self.validate_incisions(check)?;
        self.validate_names(check)?;
        self.validate_excisions(check)?;
        self.validate_underminings(check)?;
        self.validate_sutures(check)
    }

    fn validate_incisions(&self, check: &Check<'_>) -> Result<(), Error> {
        for (n, incision) in self.incision.iter().enumerate() {
            let key = |field: &str| format!("incision[{n}].{field}");
            self.validate_path(check, &key, incision)?;
            check.positive(&key("depth_mm"), incision.depth_mm)?;
            incision.width_mm.map_or(Ok(()), |width_mm| check.positive(&key("width_mm"), width_mm))?;
            let later = self.model.cuts_later() || incision.width_mm.is_none();
            let model = serde_json::json!(self.model);
            let why = format!("must be 0: with model = {model} incisions with a width exist from the start");
            check.require(incision.at_s == 0.0 || later, &key("at_s"), incision.at_s, &why)?;
            self.validate_time(check, &key("at_s"), incision.at_s)?;
            if let Some(speed) = incision.speed_mm_s {
                let key = key("speed_mm_s");
                check.positive(&key, speed)?;
                let why = "must be left out next to width_mm: an incision with a width is made at once";
                check.require(incision.width_mm.is_none(), &key, speed, why)?;
            }
        }
        Ok(())
    }

    /// The path of an incision: two ends, or two or more points.
    fn validate_path(
        &self,
        check: &Check<'_>,
        key: &dyn Fn(&str) -> String,
        incision: &IncisionSection,
    ) -> Result<(), Error> {
        let IncisionSection { from_mm, to_mm, path_mm, .. } = incision;
        for (name, end) in [("from_mm", from_mm), ("to_mm", to_mm)] {
            let (key, shown) = (key(name), format!("{:?}", end.unwrap_or_default()));
            let why = "must be left out next to path_mm, whose points hold the ends";
            check.require(end.is_none() || path_mm.is_empty(), &key, shown, why)?;
            let why = "is missing: give from_mm and to_mm, path_mm, or markups";
            check.require(end.is_some() || !path_mm.is_empty(), &key, "", why)?;
            end.map_or(Ok(()), |end| check.point(&key, end))?;
        }
        if path_mm.is_empty() {
            let shown = format!("{:?}", to_mm.unwrap_or_default());
            return check.require(from_mm != to_mm, &key("to_mm"), shown, "must differ from from_mm");
        }
        let (key, count) = (key("path_mm"), path_mm.len());
        check.require(count >= 2, &key, format!("{path_mm:?}"), "must have two points or more")?;
        path_mm.iter().enumerate().try_for_each(|(n, &point)| check.point(&format!("{key}[{n}]"), point))?;
        let straight = incision.width_mm.is_none() || count == 2;
        let why = "must have two points next to width_mm: only a cut without a width can bend";
        check.require(straight, &key, format!("{count} points"), why)
    }

    /// A cut after the last frame would never be made, unless the run ends at rest.
    fn validate_time(&self, check: &Check<'_>, key: &str, at_s: f64) -> Result<(), Error> {
        check.not_negative(key, at_s)?;
        let last = self.last_frame_s();
        let why = format!("must not lie after the beginning of the last frame, at {last} s (run.frames)");
        check.require(at_s <= last || at_s == 0.0, key, at_s, &why)
    }

    fn validate_names(&self, check: &Check<'_>) -> Result<(), Error> {
        let names: Vec<Option<&str>> = self.wound_names().collect();
        for (n, name) in names.iter().enumerate() {
            let Some(name) = name else { continue };
            let key = match n.checked_sub(self.incision.len()) {
                None => format!("incision[{n}].name"),
                Some(n) => format!("excision[{n}].name"),
            };
            let shown = format!("{name:?}");
            check.require(!name.trim().is_empty(), &key, &shown, "must not be empty")?;
            let why = "must be the name of one wound only";
            check.require(!names[..n].contains(&Some(name)), &key, &shown, why)?;
        }
        Ok(())
    }

    /// Depth in mm and time in s of a wound without a width.
    fn cut_of(&self, wound: usize) -> Option<[f64; 2]> {
        let without_width = |incision: &IncisionSection| incision.width_mm.is_none();
        match self.incision.get(wound) {
            Some(incision) => without_width(incision).then_some([incision.depth_mm, incision.at_s]),
            None => {
                let excision = self.excision.get(wound.checked_sub(self.incision.len())?)?;
                Some([excision.depth_mm, excision.at_s])
            }
        }
    }

    fn validate_underminings(&self, check: &Check<'_>) -> Result<(), Error> {
        for (n, undermining) in self.undermining.iter().enumerate() {
            let key = |field: &str| format!("undermining[{n}].{field}");
            let of_wound = self.wound(&undermining.wound).and_then(|wound| self.cut_of(wound));
            let why = "must be the number or the name of a wound without width_mm";
            check.require(of_wound.is_some(), &key("wound"), &undermining.wound, why)?;
            let Some([depth_mm, at_s]) = of_wound else { continue };
            check.positive(&key("distance_mm"), undermining.distance_mm)?;
            check.positive(&key("depth_mm"), undermining.depth_mm)?;
            let why = format!("must be at most the depth of its wound, {depth_mm} mm");
            let shallow = undermining.depth_mm <= depth_mm;
            check.require(shallow, &key("depth_mm"), undermining.depth_mm, &why)?;
            self.validate_time(check, &key("at_s"), undermining.at_s)?;
            let why = format!("must not be before its wound, at {at_s} s");
            check.require(undermining.at_s >= at_s, &key("at_s"), undermining.at_s, &why)?;
            undermining.speed_mm_s.map_or(Ok(()), |speed| check.positive(&key("speed_mm_s"), speed))?;
        }
        Ok(())
    }

    fn validate_excisions(&self, check: &Check<'_>) -> Result<(), Error> {
        for (n, ExcisionSection { path_mm, depth_mm, at_s, .. }) in self.excision.iter().enumerate() {
            let key = |field: &str| format!("excision[{n}].{field}");
            let path = key("path_mm");
            path_mm.iter().enumerate().try_for_each(|(n, &at)| check.point(&format!("{path}[{n}]"), at))?;
            let closed = path_mm.len() >= 4 && path_mm.first() == path_mm.last();
            let why = "must be a closed outline: three points or more, and the first one again at the end";
            check.require(closed, &path, format!("{path_mm:?}"), why)?;
            check.positive(&key("depth_mm"), *depth_mm)?;
            self.validate_time(check, &key("at_s"), *at_s)?;
        }
        Ok(())
    }

    fn validate_sutures(&self, check: &Check<'_>) -> Result<(), Error> {
        for (n, suture) in self.suture.iter().enumerate() {
            let key = |field: &str| format!("suture[{n}].{field}");
            let count = self.wounds();
            let why = format!("must be the number or the name of a wound; there are {count}, from 0");
            let wound = self.wound(&suture.wound);
            check.require(wound.is_some(), &key("wound"), &suture.wound, &why)?;
            let incision = wound.and_then(|wound| self.incision.get(wound));
            let closes = incision.is_none_or(|incision| incision.width_mm.is_none());
            let why =
                "must be an incision without width_mm: a suture cannot close a slit whose tissue is gone";
            check.require(closes, &key("wound"), &suture.wound, why)?;
            self.validate_stitches(check, &key, suture)?;
            check.positive(&key("bite_mm"), suture.bite_mm)?;
            check.positive(&key("thread_n_per_m"), suture.thread_n_per_m)?;
            check.not_negative(&key("at_s"), suture.at_s)?;
            check.not_negative(&key("tighten_s"), suture.tighten_s)?;
            check.positive(&key("tighten_to"), suture.tighten_to)?;
            let why = "must be at most 1: a longer thread does not close the wound";
            check.require(suture.tighten_to <= 1.0, &key("tighten_to"), suture.tighten_to, why)?;
            let Some(release_s) = suture.release_s else { continue };
            check.not_negative(&key("release_s"), release_s)?;
            let why = format!("must be after at_s = {} s", suture.at_s);
            check.require(release_s > suture.at_s, &key("release_s"), release_s, &why)?;
        }
        Ok(())
    }

    /// The places of the stitches of a suture: at equal distances, or in pairs.
    fn validate_stitches(
        &self,
        check: &Check<'_>,
        key: &dyn Fn(&str) -> String,
        suture: &SutureSection,
    ) -> Result<(), Error> {
        let SutureSection { every_mm, pairs_mm, .. } = suture;
        for (n, [a, b]) in pairs_mm.iter().enumerate() {
            let key = format!("{}[{n}]", key("pairs_mm"));
            check.point(&key, *a)?;
            check.point(&key, *b)?;
            check.require(a != b, &key, format!("{a:?}"), "must be two different points")?;
        }
        let one = every_mm.is_some() == pairs_mm.is_empty();
        let shown = every_mm.map(|mm| mm.to_string()).unwrap_or_default();
        check.require(
            one,
            &key("every_mm"),
            shown,
            "must be given, or pairs_mm in its place, and not both",
        )?;
        every_mm.map_or(Ok(()), |every| check.positive(&key("every_mm"), every))?;
        let (key, depth_mm) = (key("depth_mm"), suture.depth_mm);
        check.not_negative(&key, depth_mm)?;
        let why = "must be 0 next to pairs_mm, whose points are on the skin";
        check.require(depth_mm == 0.0 || pairs_mm.is_empty(), &key, depth_mm, why)?;
        let wound = self.wound(&suture.wound).unwrap_or_default();
        let incision = self.incision.get(wound).map(|incision| incision.depth_mm);
        let excision = || Some(self.excision.get(wound.checked_sub(self.incision.len())?)?.depth_mm);
        let wound_mm = incision.or_else(excision).unwrap_or(f64::INFINITY);
        let why = format!("must be less than the depth of the wound, {wound_mm} mm");
        check.require(depth_mm < wound_mm, &key, depth_mm, &why)
    }
}
