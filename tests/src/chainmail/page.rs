//! The page of the results, its table and its charts.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use cutis::RunFolder;
use cutis::report::Machine;
use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};

use super::compare::{Comparison, RING_MM, STAYED_MM};
use super::runs::Whole;
use super::{Failure, Origin};

/// The answers of one comparison.
pub(super) fn table(comparison: &Comparison) -> String {
    let mut out = format!(
        "| {} at {} mm, {} vertices | longest frame, ms | frames | all frames, s | moved > {STAYED_MM} mm | mean difference, mm | 95 % | \
         largest |\n|---|---|---|---|---|---|---|---|\n",
        comparison.scene, comparison.spacing_mm, comparison.vertices
    );
    for answer in &comparison.answers {
        let [mean, most, largest] = answer.differs_mm;
        let _ = writeln!(
            out,
            "| {} | {:.2} | {} | {:.2} | {} | {mean:.2} | {most:.2} | {largest:.2} |",
            answer.name, answer.frame_ms, answer.frames, answer.all_s, answer.moved
        );
    }
    out
}

/// How far the displacement reaches.
fn chart(comparison: &Comparison) -> String {
    let curves: Vec<Vec<[f64; 2]>> = comparison
        .answers
        .iter()
        .map(|answer| {
            let middle = |(n, mm): (usize, &f64)| [(n as f64 + 0.5) * RING_MM, *mm];
            answer.rings_mm.iter().enumerate().map(middle).collect()
        })
        .collect();
    let named = comparison.answers.iter().zip(&curves);
    let series: Vec<Series<'_>> =
        named.map(|(answer, points)| Series { name: answer.name, points, mark: Mark::Line }).collect();
    let axis = |label| Axis { label, scale: Scale::Linear };
    line_chart(
        &format!("{}: how far a drag reaches", comparison.scene),
        axis("distance from what is dragged / mm"),
        axis("mean displacement / mm"),
        &series,
    )
}

/// Writes page, charts and the phantom's pictures.
pub(super) fn write(
    origin: &Origin,
    wholes: &[Whole],
    comparisons: &[Comparison],
    checks: &[(String, bool)],
    demo: &Path,
    folder: &Path,
) -> Result<(), Failure> {
    let machine = Machine::here();
    let load = |load: &Option<String>| load.clone().unwrap_or_else(|| "unknown".into());
    let mut page = format!(
        "# ChainMail on scans, and beside position-based dynamics\n\n\
         Written by `cargo xtask chainmail --write` at commit {}, on {}, {} cores, {}, in {:.0} s; load of the machine {} at \
         the start, {} at the end.\n\n## Grab, drag, relax, cut\n\nScenes of `fixtures/scenes/`. Skin is grabbed and drawn \
         aside over half a second, cut 0.1 s later, and relaxed on, at most 20 sweeps per frame. *opening*: mean distance of \
         the lips just before the cut and at the end. *energy*: after the last drag, and at the end. Times of propagation and relaxation \
         are means over all frames, *longest* is that of one frame.\n\n\
         | scene | elements | links | moved | violated links | energy, mm² | sweeps | propagation, ms | relaxation, ms | \
         longest, ms | opening, mm | resampling, s |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        origin.commit.as_deref().unwrap_or("unknown"),
        machine.cpu,
        machine.cores,
        machine.system,
        origin.took_s,
        load(&origin.load[0]),
        load(&origin.load[1]),
    );
    for whole in wholes {
        let told = whole.report.chainmail.clone().unwrap_or_default();
        let sizes = &whole.report.sizes;
        let _ = writeln!(
            page,
            "| {} | {} | {} | {} | {} | {:.0} → {:.0} | {} | {:.2} | {:.2} | {:.1} | {:.2} → {:.2} | {:.2} |",
            whole.scene,
            sizes.vertices,
            sizes.edges,
            told.moved,
            told.violated_links,
            told.energy_before,
            told.energy_after,
            told.relax_sweeps,
            whole.part_ms("propagation"),
            whole.part_ms("relaxation"),
            whole.slowest_ms,
            whole.opening_mm[0],
            whole.opening_mm[1],
            whole.stage_s("resample the CT"),
        );
    }
    page.push_str(
        "\nThe phantom, cut and not yet moved, and at the end:\n\n![before](chainmail-before.png) \
         ![after](chainmail-after.png)\n\n![slice across the wound](chainmail-slice.png)\n\n\
         ## Beside position-based dynamics\n\nThe same scan, the same lattice and the same drag, without an incision, until all is at rest. \
         Springs of 5 kPa and volumes of 50 kPa, fixed as in the scene. *Difference*: of the displacements from those of vertex block \
         descent, whose settled bodies are within 0.1 % of equilibrium (`accuracy.md`), over all vertices that moved by more than \
         1 mm in either.\n\n",
    );
    for comparison in comparisons {
        let file = format!("chainmail-{}.svg", comparison.scene.trim_end_matches("-chainmail"));
        fs::write(folder.join(&file), chart(comparison))?;
        let _ = writeln!(page, "{}\n![how far the drag reaches]({file})\n", table(comparison));
    }
    page.push_str(WHEN);
    page.push_str("\n## Checks\n\nThe command fails unless all hold.\n\n");
    for (what, holds) in checks {
        let _ = writeln!(page, "- {what}: {}", if *holds { "holds" } else { "**fails**" });
    }
    for reason in &origin.skipped {
        let _ = writeln!(page, "- left out: {reason}");
    }
    fs::write(folder.join("chainmail.md"), page)?;
    let demo = RunFolder(demo.into());
    for (from, to) in [(demo.before(), "before"), (demo.after(), "after"), (demo.slice(), "slice")] {
        fs::copy(from, folder.join(format!("chainmail-{to}.png")))?;
    }
    Ok(())
}

/// When to use which.
const WHEN: &str = "\
## When to use which

ChainMail where a hand moves tissue and the picture must follow at once: it costs what moves, a drag lands exactly where it is told in the \
same frame, it takes any mix of rigid and soft at no cost in stability, and cuts at any time. What it gives is the least that the limits \
allow, then smoothed: it reaches less far than elasticity (see the charts), it keeps no volume, and its limits are no moduli, so that neither \
forces nor the opening of a wound under the skin's own tension can be had from it. With `k` = 0 and as many sweeps as it takes, relaxation \
ends where no element alone can lower the energy, much nearer to elasticity, in about a fifth of the time that XPBD needs to come to rest: a way to a body \
at rest rather than to a frame. Position-based dynamics where the deformation itself is the \
question: how far a wound opens, what the skin's tension does, how a body sags; its materials are physical, its errors are measured \
(`accuracy.md`), and it costs some hundred times more per frame on these scenes. A scene can be run by either, if it names `[constraints]`, which ChainMail \
leaves aside, and cuts at the start: `--set model=…`.
";
