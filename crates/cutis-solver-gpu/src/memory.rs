//! What a body needs on a device.

use cutis_solver::{Carried, MemoryPart, Settings, System, Values};

/// Bytes on the device, part by part; no device is needed to know them. Measures that are asked for later (residuals, the
/// positions of some vertices) come on top.
pub fn device_bytes(system: &System<f32>, settings: &Settings) -> Vec<MemoryPart> {
    let vertices = system.vertices().len();
    // Position, position before the substep, velocity: four numbers each.
    let mut parts = vec![MemoryPart { name: "vertices", bytes: vertices * 3 * size_of::<[f32; 4]>() }];
    for kind in system.kinds() {
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
    let carried: usize = system.handles().iter().map(|handle: &Carried<f32>| handle.vertices().len()).sum();
    if carried > 0 {
        parts.push(MemoryPart { name: "handles", bytes: carried * size_of::<[u32; 5]>() });
    }
    parts
}
