//! The page as HTML.

use std::fmt::Write as _;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use cutis_render::Plane;
use sha2::{Digest, Sha256};

use super::Figure;
use super::summary;
use super::tables;
use super::text::{escape, items};
use crate::output::report::Report;
use crate::output::slices::SlicePair;
use crate::run::frames::FrameRow;

const STYLE: &str = include_str!("assets/page.css");

/// The files of the script, in order. They share one scope.
const SCRIPT: [&str; 8] = [
    include_str!("assets/math.js"),
    include_str!("assets/surface.js"),
    include_str!("assets/shaders.js"),
    include_str!("assets/renderer.js"),
    include_str!("assets/camera.js"),
    include_str!("assets/time.js"),
    include_str!("assets/compare.js"),
    include_str!("assets/main.js"),
];

/// The interactive view. The script shows what is hidden here.
const VIEW: &str = include_str!("assets/view.html");

/// The parts of a page.
pub(super) struct Page<'a> {
    pub(super) report: &'a Report,
    pub(super) figures: &'a [Figure],
    pub(super) slices: &'a [SlicePair],
    pub(super) rows: &'a [FrameRow],
    /// Plots over time.
    pub(super) over_time: &'a [String],
    /// A plot of the search for rest.
    pub(super) search: Option<String>,
    /// Whether the page has data for the view.
    pub(super) has_view: bool,
    /// The frame from which the run resumed.
    pub(super) resumed: Option<u32>,
    pub(super) scene: &'a str,
}

impl Page<'_> {
    /// The page. `data` returns the script elements with its data, and receives the length of the
    /// page without them in bytes.
    pub(super) fn html(&self, data: impl FnOnce(usize) -> String) -> String {
        let report = self.report;
        let script = format!("(() => {{\n\"use strict\";\n{}}})();\n", SCRIPT.join("\n"));
        let mut out = String::new();
        let mut put = |text: &str| out.push_str(text);
        put("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n");
        put(&policy(STYLE, &script));
        put("<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n");
        put("<meta name=\"color-scheme\" content=\"light dark\">\n");
        put(&format!(
            "<title>{}</title>\n<style>{STYLE}</style></head>\n<body><main>",
            escape(&title(report))
        ));
        put(&summary::heading(report));
        put(&summary::result(report, self.rows));
        if !report.warnings.is_empty() {
            let notes = items(&report.warnings);
            put(&format!("<div class=\"warn\"><b>Notes on this result</b><ul>{notes}</ul></div>"));
        }
        if self.has_view {
            put(VIEW);
            put(&self.view_notes());
        }
        put(&slices(self.slices));
        put(&pictures(self.figures));
        put(&plots("<h2>Over time</h2>", self.over_time));
        put(&tables::history(report));
        put(&tables::materials(&report.materials));
        put("<h2>How it was computed</h2>");
        put(&summary::computation(report));
        put(&plots("", self.search.as_slice()));
        put(&tables::computation(report));
        if !report.left_out.is_empty() {
            put(&format!("<h3>Left out by the scene</h3><ul>{}</ul>", items(&report.left_out)));
        }
        put(&format!("<h2>Scene as it ran</h2><pre tabindex=\"0\">{}</pre></main>\n", scene(self.scene)));
        out.push_str(&data(out.len() + script.len()));
        let _ = writeln!(out, "<script>{script}</script></body></html>");
        out
    }

    /// What a reader of the view has to know.
    fn view_notes(&self) -> String {
        let mut out = String::new();
        if let Some(frame) = self.resumed {
            let _ = write!(
                out,
                "<p class=\"note\">The run resumed from a checkpoint: the view has no state between the scan \
                 and frame {frame}.</p>"
            );
        }
        if !self.report.scene.excision.is_empty() {
            out.push_str(
                "<p class=\"note\">The view shows no tissue that is taken out, also before that.</p>",
            );
        }
        out
    }
}

/// Plots next to each other under a heading; nothing without plots.
fn plots(heading: &str, plots: &[String]) -> String {
    if plots.is_empty() {
        return String::new();
    }
    let figure = |plot: &String| format!("<figure class=\"plot\">{plot}</figure>");
    format!("{heading}<div class=\"plots\">{}</div>", plots.iter().map(figure).collect::<String>())
}

/// The policy of the page: nothing is loaded, and only this style and this script are used.
fn policy(style: &str, script: &str) -> String {
    let hash = |text: &str| STANDARD.encode(Sha256::digest(text));
    format!(
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; \
         style-src 'sha256-{}'; script-src 'sha256-{}'; base-uri 'none'; form-action 'none'\">\n",
        hash(style),
        hash(script)
    )
}

/// The name of the scene, so that the pages of several runs differ.
fn title(report: &Report) -> String {
    let scene = report.inputs.first().and_then(|input| Path::new(&input.path).file_stem());
    scene.map_or_else(|| "Cutis run".into(), |name| format!("{} - Cutis run", name.to_string_lossy()))
}

/// Largest number of bytes of a scene that the page shows.
const MOST_OF_SCENE: usize = 200_000;

/// A scene as text. The rest of a long one is left out, which the page says.
fn scene(toml: &str) -> String {
    if toml.len() <= MOST_OF_SCENE {
        return escape(toml);
    }
    let end = toml.floor_char_boundary(MOST_OF_SCENE);
    let left = toml.len() - end;
    format!("{}\n# {left} more bytes are in report.json", escape(&toml[..end]))
}

fn image(png: &[u8], alt: &str) -> String {
    format!("<img alt=\"{}\" src=\"data:image/png;base64,{}\">", escape(alt), STANDARD.encode(png))
}

fn pictures(figures: &[Figure]) -> String {
    if figures.is_empty() {
        return String::new();
    }
    let mut out = String::from("<h2>Pictures</h2><div class=\"pictures\">");
    let (wide, narrow): (Vec<_>, Vec<_>) = figures.iter().partition(|figure| figure.wide);
    for Figure { caption, wide, png, small, .. } in narrow.into_iter().chain(wide) {
        let class = if *wide { "wide" } else { "narrow" };
        let (image, caption) = (image(small.as_ref().unwrap_or(png), caption), escape(caption));
        let _ = write!(out, "<figure class=\"{class}\">{image}<figcaption>{caption}</figcaption></figure>");
    }
    out + "</div>"
}

/// The slices in three planes. Without the script the two of a plane are next to each other.
fn slices(pairs: &[SlicePair]) -> String {
    if pairs.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "<section aria-labelledby=\"slices-title\"><h2 id=\"slices-title\">The CT before and after</h2>\
         <p>Lines: the skin of the model <b class=\"before\">before</b> and <b class=\"after\">after</b>.</p>\
         <div class=\"slices\">",
    );
    for SlicePair { plane, at_mm, png: [before, after] } in pairs {
        let (name, axis) = match plane {
            Plane::Axial => ("Axial", 'z'),
            Plane::Coronal => ("Coronal", 'y'),
            Plane::Sagittal => ("Sagittal", 'x'),
        };
        let [before, after] = [(before, "before"), (after, "after")]
            .map(|(png, when)| image(png, &format!("{name} slice of the CT {when}")));
        let _ = write!(
            out,
            "<figure class=\"compare\"><div class=\"two\">{before}{after}</div>\
             <label hidden>before <input type=\"range\" min=\"0\" max=\"100\" value=\"50\" \
             aria-label=\"{name} slice: share that shows the CT after, in percent\"> after</label>\
             <figcaption>{name}, {axis} = {at_mm:.1} mm</figcaption></figure>"
        );
    }
    out + "</div></section>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_scene_is_cut_between_letters() {
        assert_eq!(scene("a < b"), "a &lt; b");
        let long = "ä".repeat(MOST_OF_SCENE);
        let shown = scene(&long);
        assert!(
            shown.len() < MOST_OF_SCENE + 100 && shown.ends_with("# 200000 more bytes are in report.json")
        );
    }

    #[test]
    fn the_policy_names_the_hashes_of_style_and_script() {
        // `printf x | openssl dgst -sha256 -binary | base64`
        let hash = "LXEWQrcmsEQBYnyp+6wy9chTD7GQPMTbAiWHF5IaSIE=";
        let policy = policy("x", "y");
        assert!(policy.contains(&format!("style-src 'sha256-{hash}'")), "{policy}");
        assert!(!policy.contains(&format!("script-src 'sha256-{hash}'")), "{policy}");
        assert!(policy.contains("default-src 'none'"));
    }
}
