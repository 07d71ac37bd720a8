//! The load that a cut sets free in a scan at rest: the negative of the force that a removed
//! constraint had in the scan.

use cutis_constraints::Constraint;
use cutis_solver::{Pbd, project};
use nalgebra::Vector3;

use super::BodyParts;

/// How strongly a removed constraint acted.
pub(super) enum Strength {
    /// Its compliance `α`; the force is `−(C/α)∇C`.
    Compliance(f64),
    /// Its PBD stiffness per iteration.
    Pbd(f64),
}

impl BodyParts<'_> {
    /// Load in N on each vertex of a removed constraint `C` with these parameters: the negative of
    /// its force in the scan.
    ///
    /// PBD has no forces. There the load moves a vertex as far in each substep as the projections
    /// of the constraint would have, in the opposite direction.
    pub(super) fn freed_load<C: Constraint<N>, const N: usize>(
        &self,
        vertices: &[u32; N],
        params: &C::Params<f64>,
        strength: &Strength,
    ) -> [Vector3<f64>; N] {
        let x = vertices.map(|v| self.position(v));
        match *strength {
            Strength::Compliance(compliance) => {
                let eval = C::eval(&x, params);
                eval.grad.map(|gradient| gradient * (eval.c / compliance))
            }
            Strength::Pbd(stiffness) => {
                let w = vertices.map(|v| f64::from(self.inverse_masses[v as usize]));
                let moved = project::<C, N, f64, Pbd>(&x, &w, params, Pbd, stiffness, 0.0).corrections;
                let h = self.solver.settings().substep_s();
                let per_substep = f64::from(self.solver.iterations) / (h * h);
                std::array::from_fn(|i| if w[i] > 0.0 { moved[i] * (-per_substep / w[i]) } else { moved[i] })
            }
        }
    }
}
