//! Builds a mesh of a synthetic torso, finds its skin, cuts it and writes the result as VTU files.
//!
//! Run it with `cargo run -p cutis-mesh --example phantom_incision`.
#![expect(clippy::print_stdout, reason = "an example that prints its results")]

use cutis_mesh::vtk::{self, Cells, DataArray, Piece, Space, Values};
use cutis_mesh::{Cut, Incision, Lattice, SkinMode, Slit, Split, Tissue, TissueMask};
use cutis_volume::phantom::Phantom;
use cutis_volume::{Table, TableKind, sample};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let phantom = Phantom::new([96, 96, 72], 1)?;
    let volume = phantom.volume()?;

    // A lattice over the CT. Points below −449 HU are air.
    let lattice = Lattice::new(sample::lattice_grid(volume.grid(), "5.0".parse()?)?, Split::Kuhn6)?;
    let hu = lattice.sample(&volume)?;
    let alpha = Table::preset(TableKind::Alpha, "paper")?;
    let air: Vec<bool> = hu.iter().map(|&hu| alpha.is_air(hu)).collect();

    // The body is the largest component. The scanner table is dropped.
    let tissue = Tissue { air: &air, cut_away: &[], largest_component: true };
    let (body, skin) = TissueMask::find_with_skin(&lattice, &tissue, SkinMode::Exterior, None)?;
    let mut mesh = body.mesh(&hu)?;
    println!("mesh   {} vertices, {} tetrahedra", mesh.positions.len(), mesh.tets.len());
    println!("other  {} tetrahedra of {} components dropped", body.dropped_tets(), body.components() - 1);
    let density = Table::preset(TableKind::Density, "schneider2000")?;
    let mass_kg: f32 = mesh.masses(&|hu| density.at(hu)).iter().sum();
    println!("mass   {mass_kg:.1} kg");

    let (on_body, _) = body.skin(&skin);
    println!("skin   {} triangles, {:.1} % coverage", skin.report.triangles, 100.0 * skin.report.coverage);

    let (from, to) = phantom.incision_site();
    let incision = Incision { path_mm: vec![from, to], depth_mm: 24.0, width_mm: Some(4.0) };
    let slits = Slit::on_lattice(&lattice, &on_body, &[incision])?;
    let (mut triangles, _) = mesh.divide_skin(&on_body);
    let cut = Cut::of_slits(&mesh, &triangles, slits)?;
    let removed = cut.apply(&mut mesh, &mut triangles);
    let gape = cut.gapes[0].measure(&mesh.positions);
    println!("cut    {} tetrahedra removed, {:.1} mm wide at rest", removed.tets.len(), gape.mean_mm);

    let folder = tempfile::tempdir()?;
    for (name, cells) in [("tissue.vtu", Cells::Tets(&mesh.tets)), ("skin.vtu", Cells::Triangles(&triangles))]
    {
        let data = [DataArray { name: "hu", values: Values::Scalars(&mesh.hu) }];
        let piece =
            Piece { frame: &mesh.frame, positions: &mesh.positions, cells, data: &data, cell_data: &[] };
        let path = folder.path().join(name);
        vtk::write_vtu(&path, Space::Lps, &piece)?;
        println!("wrote  {name}, {} KB", std::fs::metadata(&path)?.len() / 1000);
    }
    // `folder` is temporary and is removed here.
    Ok(())
}
