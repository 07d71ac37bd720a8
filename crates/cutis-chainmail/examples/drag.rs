//! Drags one element of a small block with a rigid core, relaxes the block, and prints the
//! positions along the middle row.
#![forbid(unsafe_code)]
#![expect(clippy::print_stdout, reason = "the example prints its result")]

use std::error::Error;

use cutis_chainmail::{Chain, Drag, Material, Order};

fn main() -> Result<(), Box<dyn Error>> {
    let shape = [9, 5, 5];
    let soft = Material::isotropic(0.5, 1.5, 0.5, 0.0);
    let (is_soft, is_rigid) = (0, 1);
    let material = |element: usize| {
        let column = element % shape[0];
        if (3..6).contains(&column) { is_rigid } else { is_soft }
    };
    let materials = (0..shape.iter().product()).map(material).collect();
    let mut block = Chain::new(shape, [1.0; 3], &[soft, Material::RIGID], materials)?;

    // The first column is fixed; the center of the last one is pulled away by two steps.
    let fixed: Vec<u32> = (0..block.places() as u32).step_by(shape[0]).collect();
    block.fix(&fixed)?;
    let grabbed = block.element([8, 2, 2]);
    let report = block.drag(&[Drag { element: grabbed, to: [10.0, 2.0, 2.0] }], Order::Fifo)?;
    println!("{} of {} elements moved", report.elements, block.places());
    println!("{} links are beyond their limits", block.violations().links);
    print_row("after the drag", &block);

    let energy = block.energy_mm2();
    let relaxed = block.relax(10_000, &[grabbed]);
    println!("{} sweeps: energy {:.2} -> {:.2} mm²", relaxed.sweeps, energy, block.energy_mm2());
    print_row("after relaxation", &block);
    Ok(())
}

/// Prints the x coordinates of the middle row in steps.
fn print_row(when: &str, block: &Chain) {
    let row: Vec<String> =
        (0..9).map(|i| format!("{:.2}", block.position(block.element([i, 2, 2]))[0])).collect();
    println!("x {when}: {}", row.join(" "));
}
