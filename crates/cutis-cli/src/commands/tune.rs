//! `tune`: tables of the settings that were measured.

use std::path::{Path, PathBuf};

use cutis::tune::{Candidate, Demand, Omission, RegionTrial, RestTrial, WoundError};
use cutis::{Error, Scene, TuneOptions, Tuning};

use super::pretty;
use crate::args::{Change, TuneArgs};
use crate::terminal::{Terminal, print};

pub(super) fn tune(scene: &Path, change: &Change, args: &TuneArgs, json: bool) -> Result<(), Error> {
    let loaded = change.applied(Scene::load(scene, &change.overrides(None))?);
    let demand = match (args.budget_ms, args.error) {
        (Some(ms), _) => Demand::BudgetMs(ms),
        (None, Some(percent)) => Demand::Error(percent / 100.0),
        (None, None) => Demand::Default,
    };
    let out = args.out.clone().unwrap_or_else(|| default_copy(scene));
    let options = TuneOptions {
        demand,
        out,
        overwrite: args.force,
        minutes: args.minutes,
        region: !args.whole_body,
        omissions: !args.settings_only,
    };
    let tuning = cutis::tune(&loaded, &options, &Terminal::new())?;
    print(&if json { pretty(&tuning) } else { tables(&tuning) });
    tuning.unmet().map_or(Ok(()), Err)
}

/// The scene's name with `-tuned`, in the current folder.
fn default_copy(scene: &Path) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or_default().to_owned();
    name.push("-tuned.toml");
    name.into()
}

fn tables(tuning: &Tuning) -> String {
    let reference = &tuning.reference;
    let order = reference.order.map_or("no limit seen".into(), |order| format!("order {order:.1}"));
    let levels: Vec<String> = reference.substeps.iter().map(u32::to_string).collect();
    let mut lines = vec![
        format!(
            "reference        {} substeps in f64 on the CPU, {:.0} s; extrapolated ({order}); uncertainty about {:.2} %",
            levels.join(", "),
            reference.seconds,
            100.0 * reference.error
        ),
        format!(
            "                 displacement {:.3} mm RMS{}",
            reference.displacement_mm,
            reference
                .growths_mm
                .iter()
                .map(|mm| format!("; the wound opens by {mm:.3} mm"))
                .collect::<String>()
        ),
        format!("target           {}", tuning.demand),
        String::new(),
        row("", "setting", "ms/frame", "error", "opening", "difference"),
    ];
    let measured = tuning.candidates.iter().filter(|candidate| candidate.error.is_some());
    lines.extend(measured.map(|candidate| candidate_row(candidate, tuning)));
    lines.push(
        "  > picked, * on the Pareto front (no cheaper setting is as accurate), = the scene's own".into(),
    );
    lines.extend(abandoned(tuning));
    lines.push(at_rest(&tuning.rest));
    if !tuning.regions.is_empty() {
        lines.push("regions around the action, compared with the whole body".into());
        lines.push(region_row(
            "",
            "region",
            "ms/frame",
            "time",
            "MB saved",
            "error",
            "difference of the opening",
        ));
        lines.extend(tuning.regions.iter().map(region));
    }
    if !tuning.omissions.is_empty() {
        lines.push("ablation: what the scene saves, and how its result changes, without".into());
        lines.push(omission_row("", "ms/frame", "ms once", "MB", "change", "difference of the opening"));
        lines.extend(tuning.omissions.iter().map(omission));
    }
    lines.extend(tuning.warnings.iter().map(|warning| format!("note: {warning}")));
    if let Some(file) = &tuning.scene_file {
        lines.push(format!("written:         {}", file.display()));
    }
    lines.join("\n")
}

/// The settings that were abandoned, grouped by reason.
fn abandoned(tuning: &Tuning) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for candidate in &tuning.candidates {
        let Some(why) = candidate.abandoned.as_deref() else { continue };
        let setting = candidate.setting.to_string();
        match reasons.iter_mut().find(|(reason, _)| *reason == why) {
            Some((_, settings)) => settings.push(setting),
            None => reasons.push((why, vec![setting])),
        }
    }
    let line = |(why, settings): (&str, Vec<String>)| format!("  {why}: {}", settings.join("; "));
    let head = (!reasons.is_empty()).then(|| "not measured to the end:".to_owned());
    head.into_iter().chain(reasons.into_iter().map(line)).collect()
}

/// The search for rest, compared with the last frame of the reference.
fn at_rest(trial: &RestTrial) -> String {
    let (Some(ms), Some(stated), Some(apart)) = (trial.ms, trial.stated_error, trial.difference) else {
        return format!("search for rest  not measured: {}", trial.skipped.as_deref().unwrap_or("no reason"));
    };
    let opens =
        |wound: &WoundError| format!("; the wound opens by {:.3} mm, {}", wound.growth_mm, difference(wound));
    let wounds = trial.wounds.iter().map(opens);
    format!(
        "search for rest  {:.2} s, to an error of {:.2} %; {:.2} % from the last frame of the reference{}",
        1e-3 * ms,
        100.0 * stated,
        100.0 * apart,
        wounds.collect::<String>()
    )
}

fn candidate_row(candidate: &Candidate, tuning: &Tuning) -> String {
    let picked = tuning.picked.as_ref().is_some_and(|picked| picked.setting == candidate.setting);
    let marks: String = [(picked, '>'), (candidate.pareto, '*'), (candidate.own, '=')]
        .iter()
        .map(|&(holds, mark)| if holds { mark } else { ' ' })
        .collect();
    let list =
        |of: &dyn Fn(&WoundError) -> String| candidate.wounds.iter().map(of).collect::<Vec<_>>().join(", ");
    row(
        &marks,
        &candidate.setting.to_string(),
        &candidate.ms_per_frame.map(|ms| format!("{ms:.2}")).unwrap_or_default(),
        &candidate.error.map(|error| format!("{:.2} %", 100.0 * error)).unwrap_or_default(),
        &list(&|wound| format!("{:.3} mm", wound.growth_mm)),
        &list(&difference),
    )
}

/// Difference of a wound's opening. The percentage is a dash if the reference did not open.
fn difference(wound: &WoundError) -> String {
    let percent = wound.difference_percent.map_or("-".into(), |percent| format!("{percent:+.1} %"));
    format!("{:+.3} mm ({percent})", wound.difference_mm)
}

fn region(trial: &RegionTrial) -> String {
    let graded = trial.grading_mm.map_or(String::new(), |mm| format!(", graded from {mm} mm"));
    let what = format!("{} mm{graded}", trial.around_mm);
    if let Some(why) = &trial.skipped {
        return format!("     {what:26} not measured: {why}");
    }
    let percent =
        |share: Option<f64>| share.map(|share| format!("{:.1} %", 100.0 * share)).unwrap_or_default();
    region_row(
        if trial.picked { ">" } else { "" },
        &what,
        &trial.ms_per_frame.map(|ms| format!("{ms:.2}")).unwrap_or_default(),
        &percent(trial.time_share),
        &format!("{:.1}", trial.saved_bytes as f64 / 1e6),
        &percent(trial.error),
        &trial.wounds.iter().map(difference).collect::<Vec<_>>().join(", "),
    )
}

fn region_row(mark: &str, what: &str, ms: &str, time: &str, saved: &str, error: &str, wound: &str) -> String {
    format!("{mark:4} {what:26} {ms:>9} {time:>8} {saved:>9} {error:>8}  {wound}").trim_end().to_owned()
}

fn omission(omission: &Omission) -> String {
    if let Some(why) = &omission.skipped {
        return format!("  {:40} not measured: {why}", omission.what);
    }
    let wounds: Vec<String> = omission.wounds.iter().map(difference).collect();
    omission_row(
        &omission.what,
        &omission.saved_ms_per_frame.map(|ms| format!("{ms:.2}")).unwrap_or_default(),
        &omission.saved_ms.map(|ms| format!("{ms:.0}")).unwrap_or_default(),
        &format!("{:.1}", omission.saved_bytes as f64 / 1e6),
        &omission.change.map(|change| format!("{:.1} %", 100.0 * change)).unwrap_or_default(),
        &wounds.join(", "),
    )
}

fn omission_row(what: &str, time: &str, once: &str, bytes: &str, change: &str, wound: &str) -> String {
    format!("  {what:40} {time:>10} {once:>8} {bytes:>8} {change:>8}  {wound}").trim_end().to_owned()
}

fn row(marks: &str, setting: &str, time: &str, error: &str, opening: &str, difference: &str) -> String {
    format!("{marks:4} {setting:16} {time:>10} {error:>10} {opening:>12}  {difference}").trim_end().to_owned()
}
