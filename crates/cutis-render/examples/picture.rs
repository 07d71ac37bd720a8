//! Draws a phantom from the front and in three slices, and writes the pictures as one PNG file into
//! the folder for temporary files.
#![forbid(unsafe_code)]
#![expect(clippy::print_stdout, reason = "the example prints its result")]

use std::error::Error;

use cutis_render::{Plane, Side, SliceView, View, raymarch, side_by_side, slice};
use cutis_volume::phantom::Phantom;

fn main() -> Result<(), Box<dyn Error>> {
    let phantom = Phantom::new([96, 96, 60], 3)?;
    let volume = phantom.volume()?;
    let skin = raymarch(&volume, &View { width: 400, height: 400, ..View::new(Side::Anterior) })?;
    let cut =
        |plane, at_mm| slice(&volume, &SliceView { long_side: Some(400), ..SliceView::new(plane, at_mm) });
    let (axial, coronal, sagittal) =
        (cut(Plane::Axial, 0.0)?, cut(Plane::Coronal, 0.0)?, cut(Plane::Sagittal, 0.0)?);
    let picture = side_by_side(&[
        (&skin, "anterior"),
        (&axial, "axial"),
        (&coronal, "coronal"),
        (&sagittal, "sagittal"),
    ])?;
    let path = std::env::temp_dir().join("cutis-render-phantom.png");
    picture.write_png(&path)?;
    println!("{} x {} pixels: {}", picture.width, picture.height, path.display());
    Ok(())
}
