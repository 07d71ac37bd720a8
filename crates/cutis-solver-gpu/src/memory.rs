//! What a body needs on a device.

use cutis_solver::{
    ConstraintSet, Descent, Formulation, KinematicHandle, MemoryPart, Settings, System, Values,
};

use crate::descent::{Share, VertexForceRow};

/// Bytes on the device, part by part; no device is needed to know them. Measures that are asked for later (residuals, the
/// positions of some vertices) come on top.
pub fn device_bytes(system: &System<f32>, settings: &Settings) -> Vec<MemoryPart> {
    let vertices = system.vertices().len();
    // Position, position before the substep, velocity: four numbers each.
    let mut parts = vec![MemoryPart { name: "vertices", bytes: vertices * 3 * size_of::<[f32; 4]>() }];
    let descends = settings.formulation == Formulation::Vbd;
    for kind in system.kinds() {
        if descends {
            parts.push(MemoryPart { name: kind.name(), bytes: pulling_bytes(system, &**kind) });
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
        // The vertices of all colors, and the forces of the largest one.
        let bytes = Descent::new(system, settings).map_or(0, |descent| {
            let largest = descent.groups().iter().map(<[u32]>::len).max().unwrap_or(0);
            size_of_val(descent.groups().order.as_slice()) + largest * size_of::<VertexForceRow>()
        });
        parts.push(MemoryPart { name: "vertex forces", bytes });
    }
    let held: usize =
        system.handles().iter().map(|handle: &KinematicHandle<f32>| handle.vertices().len()).sum();
    if held > 0 {
        parts.push(MemoryPart { name: "handles", bytes: held * size_of::<[u32; 5]>() });
    }
    parts
}

/// A kind in vertex block descent, if all lies in one slab: the constraints on vertices that move, and where they name them.
fn pulling_bytes(system: &System<f32>, kind: &dyn ConstraintSet<f32>) -> usize {
    let moves: Vec<bool> = system.vertices().iter().map(|vertex| vertex.inverse_mass() > 0.0).collect();
    let mut pulled = vec![false; moves.len()];
    let (mut constraints, mut places) = (0, 0);
    for tuple in kind.indices().chunks_exact(kind.arity()) {
        let mut moving = 0;
        for &vertex in tuple.iter().filter(|&&vertex| moves[vertex as usize]) {
            pulled[vertex as usize] = true;
            moving += 1;
        }
        places += moving;
        constraints += usize::from(moving > 0);
    }
    let shares = pulled.iter().filter(|pulled| **pulled).count();
    // Tuple, parameters, inverse compliance and rest size.
    let row = (kind.arity() + kind.param_count() + 2) * size_of::<f32>();
    constraints * row + places * size_of::<u32>() + shares * size_of::<Share>()
}
