//! Memory of a body on a device.

use cutis_solver::{
    ConstraintSet, Descent, Formulation, KinematicHandle, MemoryPart, Settings, System, Values,
};

use crate::descent::{PackedVertexForce, VertexEntries};

/// Returns the memory on the device by part. No device is needed to compute it. Measurements
/// (residuals, the positions of some vertices) allocate additional memory on their first use.
pub fn device_bytes(system: &System<f32>, settings: &Settings) -> Vec<MemoryPart> {
    let vertices = system.vertices().len();
    // Position, position at the start of the substep, and velocity have four numbers each.
    let mut parts = vec![MemoryPart { name: "vertices", bytes: vertices * 3 * size_of::<[f32; 4]>() }];
    if !system.loads().is_empty() {
        parts.push(MemoryPart { name: "loads", bytes: vertices * size_of::<[f32; 4]>() });
    }
    let descends = settings.formulation == Formulation::Vbd;
    for kind in system.kinds() {
        if descends {
            parts.push(MemoryPart { name: kind.name(), bytes: descent_bytes(system, &**kind) });
            continue;
        }
        let each = match kind.stiffness().values() {
            Values::Uniform(_) => 0,
            Values::Each(_) => 1,
        };
        let numbers = kind.arity() + kind.param_count() + each;
        parts.push(MemoryPart { name: kind.name(), bytes: kind.len() * numbers * size_of::<f32>() });
    }
    if settings.keeps_multipliers() {
        let count: usize = system.kinds().iter().map(|kind| kind.len()).sum();
        parts.push(MemoryPart { name: "multipliers", bytes: count * size_of::<f32>() });
    }
    if descends {
        // The indices of the vertices of all colors, and the forces of the largest color.
        let bytes = Descent::new(system, settings).map_or(0, |descent| {
            let largest = descent.groups().iter().map(<[u32]>::len).max().unwrap_or(0);
            size_of_val(descent.groups().order.as_slice()) + largest * size_of::<PackedVertexForce>()
        });
        parts.push(MemoryPart { name: "vertex forces", bytes });
    }
    let kinematic: usize =
        system.handles().iter().map(|handle: &KinematicHandle<f32>| handle.vertices().len()).sum();
    if kinematic > 0 {
        parts.push(MemoryPart { name: "handles", bytes: kinematic * size_of::<[u32; 5]>() });
    }
    parts
}

/// Returns the memory of a kind in vertex block descent for a body of one slab: the constraints on
/// moving vertices, and their entries.
fn descent_bytes(system: &System<f32>, kind: &dyn ConstraintSet<f32>) -> usize {
    let moves: Vec<bool> = system.vertices().iter().map(|vertex| vertex.inverse_mass() > 0.0).collect();
    let mut has_force = vec![false; moves.len()];
    let (mut constraints, mut entries) = (0, 0);
    for tuple in kind.indices().chunks_exact(kind.arity()) {
        let mut moving = 0;
        for &vertex in tuple.iter().filter(|&&vertex| moves[vertex as usize]) {
            has_force[vertex as usize] = true;
            moving += 1;
        }
        entries += moving;
        constraints += usize::from(moving > 0);
    }
    let vertices = has_force.iter().filter(|has_force| **has_force).count();
    // A constraint has its tuple, its parameters, the inverse compliance and the rest size.
    let constraint = (kind.arity() + kind.param_count() + 2) * size_of::<f32>();
    constraints * constraint + entries * size_of::<u32>() + vertices * size_of::<VertexEntries>()
}
