//! Detection of parts of a body that nothing holds.

use nalgebra::{Point3, Vector3};

use crate::{NewtonError, Problem};

/// If the sum of a constraint's gradients is below this fraction of their sizes, it counts as zero.
/// Moving such a constraint as a whole costs no energy.
const NO_FORCE: f64 = 1e-9;

/// Refuses a body with a connected part that nothing holds.
///
/// A part is held if one of its vertices is fixed, or if a constraint ties it to a place. A
/// constraint ties it if its gradients do not sum to zero. Constraints whose gradients are all zero
/// tie nothing.
pub(crate) fn refuse(problem: &Problem, x: &[Point3<f64>]) -> Result<(), NewtonError> {
    let count = problem.masses().len();
    let mut parents: Vec<u32> = (0..count as u32).collect();
    let mut tied = vec![false; count];
    for elements in &problem.elastic.kinds {
        let evaluated = elements.evaluate(x);
        for (k, gradients) in evaluated.gradients.chunks_exact(elements.arity().max(1)).enumerate() {
            let vertices = elements.vertices(k);
            for &vertex in vertices {
                let (a, b) = (root(&mut parents, vertices[0]), root(&mut parents, vertex));
                parents[a.max(b) as usize] = a.min(b);
            }
            let sum: Vector3<f64> = gradients.iter().sum();
            let sizes: f64 = gradients.iter().map(Vector3::norm).sum();
            tied[vertices[0] as usize] |= sum.norm() > NO_FORCE * sizes;
        }
    }
    // A root is the lowest vertex of its part.
    let roots: Vec<u32> = (0..count as u32).map(|v| root(&mut parents, v)).collect();
    let mut held = vec![false; count];
    for (v, &root) in roots.iter().enumerate() {
        held[root as usize] |= tied[v] || problem.masses()[v].is_infinite();
    }
    match roots.iter().find(|&&root| !held[root as usize]) {
        None => Ok(()),
        Some(&root) => {
            let vertices = roots.iter().filter(|&&other| other == root).count();
            Err(NewtonError::Floating { vertex: root as usize, vertices })
        }
    }
}

/// Returns the lowest vertex of the part that contains `v`, as far as it is known. Shortens the
/// path to it.
fn root(parents: &mut [u32], mut v: u32) -> u32 {
    while parents[v as usize] != v {
        let above = parents[parents[v as usize] as usize];
        parents[v as usize] = above;
        v = above;
    }
    v
}
