//! The warning about substeps that are so short that rounding loses forces.

use super::BodyParts;

/// Share of the tension lost by rounding above which it is reported.
const MOST: f64 = 0.02;

/// Warns if rounding loses a part of a tension in N/m.
///
/// A position in `f32` has 24 bits. In a substep `h` a vertex of mass `m` at a coordinate `x` does
/// not notice a force below `m·x·2⁻²⁴/h²`, because its position does not change. Such errors add up
/// from vertex to vertex like a random walk: over `n` vertices the tension is wrong by about `√n`
/// of them. On a sheet of 160 vertices across, the loss against `f64` is
/// about half of this (`tests/all/rounding.rs`).
pub(super) fn lost_in_rounding(parts: &BodyParts<'_>, tension_n_per_m: f64) -> Option<String> {
    let step = parts.body.mesh.lattice.longest_step_mm() / 1e3;
    let h = parts.solver.dt_s / f64::from(parts.solver.substeps);
    let mut corners: Vec<u32> = parts.body.skin.iter().flatten().copied().collect();
    corners.sort_unstable();
    corners.dedup();
    corners.retain(|&v| parts.inverse_masses[v as usize] > 0.0);
    let mass = corners.iter().map(|&v| 1.0 / f64::from(parts.inverse_masses[v as usize])).sum::<f64>()
        / corners.len().max(1) as f64;
    let (mut far, mut low, mut high) = (0.0, [f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &v in &corners {
        let position = parts.position(v);
        far = f64::max(far, position.coords.amax());
        for axis in 0..3 {
            (low[axis], high[axis]) = (low[axis].min(position[axis]), high[axis].max(position[axis]));
        }
    }
    let across = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max) / step;
    let share = lost_share(mass, far, h, tension_n_per_m * step, across);
    (share > MOST).then(|| {
        let substeps = (f64::from(parts.solver.substeps) * (MOST / share).sqrt()).floor().max(1.0);
        format!(
            "{} substeps are so many that rounding loses about {:.0} % of the skin's tension: use at most \
             {substeps} substeps with more iterations, or formulation = \"vbd\"",
            parts.solver.substeps,
            (100.0 * share).min(100.0)
        )
    })
}

/// Share of a force in N at each vertex that rounding loses over `across` vertices. The vertices
/// have a mass in kg and coordinates up to `far` in m, and a substep takes `h` seconds.
fn lost_share(mass: f64, far: f64, h: f64, force: f64, across: f64) -> f64 {
    let least = mass * far * 2f64.powi(-24) / (h * h);
    if force > 0.0 { across.sqrt() * least / force } else { 0.0 }
}
