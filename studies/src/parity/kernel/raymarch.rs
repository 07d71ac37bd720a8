//! A picture by ray marching, in single precision on the device and in double precision on the CPU.
//! No adapter is exact.

use cutis_gpu::Gpu;
use cutis_render::{Image, Side, View, raymarch, raymarch_gpu};
use cutis_volume::phantom::Phantom;

use crate::parity::bench::{Bench, Effort, Failure};
use crate::parity::comparison::{Figures, Measured, Ring};

/// Largest mean difference of a channel (0 to 255) due to single precision: ten times the
/// difference on the software driver of Mesa.
const MEAN: f64 = 0.002;

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let name = "ray march: a picture of the phantom";
    let (size, pixels) = if bench.effort == Effort::Quick { (48, 80) } else { (80, 160) };
    let phantom = Phantom::new([size; 3], 3)?.volume()?;
    let view = |direction| View {
        width: pixels,
        height: pixels,
        annotate: false,
        ..View::new(Side::From(direction))
    };
    let [x, y, z] = [0.4, 1.0, 0.3];
    let looked_at = view([x, y, z]);
    let expected = raymarch(&phantom, &looked_at)?;
    let measure = |gpu: &Gpu, view: &View<'_>| Ok(compared(&raymarch_gpu(gpu, &phantom, view)?, &expected));
    bench.compare(Ring::Oracle, name, |gpu, _| measure(gpu, &looked_at))?;
    let (sin, cos) = 1f64.to_radians().sin_cos();
    let controls = [
        ("turned by 1 degree", view([x * cos + y * sin, y * cos - x * sin, z])),
        ("threshold 10 HU higher", View { threshold_hu: looked_at.threshold_hu + 10.0, ..looked_at }),
        ("occlusion 2 mm shorter", View { occlusion_mm: looked_at.occlusion_mm - 2.0, ..looked_at }),
    ];
    for (what, view) in &controls {
        bench.control(Ring::Oracle, name, what, |gpu, _| measure(gpu, view))?;
    }
    Ok(())
}

fn compared(found: &Image, expected: &Image) -> Measured {
    let apart: Vec<u8> = found.rgb.iter().zip(&expected.rgb).map(|(a, b)| a.abs_diff(*b)).collect();
    let worst = apart.iter().map(|&d| f64::from(d)).sum::<f64>() / apart.len() as f64;
    let figures = Figures {
        compared: apart.len() as u64,
        differing: apart.iter().filter(|&&d| d > 0).count() as u64,
        worst,
        tolerance: MEAN,
        of: "1/255, on average",
    };
    let same_size = found.rgb.len() == expected.rgb.len();
    Measured::new(same_size && worst <= MEAN, figures)
}
