//! The warning about skin that is too stiff for the substeps of XPBD.

use super::BodyParts;

/// Warns if the skin is too stiff for the substeps. `frequency` is that of a skin element alone,
/// 1/s.
///
/// One projection per substep moves a vertex as far as its inertia lets it within `h`. Beyond
/// `h·frequency` of about one half the skin is softer than its modulus, and the more so on a finer
/// lattice. Skin that pulls then opens the wound too little. Skin that resists the load of a scan
/// at rest lets the wound open too far. With 2 projections per 1/frequency, the openings of the
/// area form on the phantom were within 5 % of those with many more.
pub(super) fn too_stiff(parts: &BodyParts<'_>, frequency: f64) -> Option<String> {
    let solver = parts.solver;
    let projections = f64::from(solver.substeps) * f64::from(solver.iterations);
    let needed = (2.0 * solver.dt_s * frequency / f64::from(solver.iterations)).ceil();
    let does = if parts.at_rest { "opens too far" } else { "opens less than the modulus asks for" };
    (projections < 1.5 * solver.dt_s * frequency).then(|| {
        format!(
            "skin tension is stiffer than {} substeps can follow on this lattice: the wound {does}; about \
             {needed} substeps would do (or formulation = \"vbd\", a coarser lattice, or a lower modulus)",
            solver.substeps
        )
    })
}
