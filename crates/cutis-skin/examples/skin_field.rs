//! Computes normals, directions and depths on the skin of a synthetic torso.
//!
//! Run it with `cargo run -p cutis-skin --example skin_field`.
#![expect(clippy::print_stdout, reason = "an example that prints its results")]

use cutis_mesh::{Lattice, SkinMode, SkinOptions, Split, Tissue, TissueMask, skin};
use cutis_skin::{BodySkin, Directions, SkinField, Strokes, depth_mm};
use cutis_volume::phantom::Phantom;
use cutis_volume::{Table, TableKind, sample};
use nalgebra::Point3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let phantom = Phantom::new([96, 96, 72], 1)?;
    let volume = phantom.volume()?;
    let lattice = Lattice::new(sample::lattice_grid(volume.grid(), "5.0".parse()?)?, Split::Kuhn6)?;
    let hu = lattice.sample(&volume)?;
    let alpha = Table::preset(TableKind::Alpha, "paper")?;
    let air: Vec<bool> = hu.iter().map(|&hu| alpha.is_air(hu)).collect();
    let body = TissueMask::find(&lattice, &Tissue { air: &air, cut_away: &[], largest_component: true })?;
    let found = skin::detect(&lattice, &air, SkinMode::Exterior, &SkinOptions::default())?;
    let (triangles, _) = body.skin(&found);
    let skin = BodySkin::new(&lattice, &hu, body.vertices(), &triangles)?;
    println!("skin      {} triangles", triangles.len());

    // Two closed curves around the trunk, as 3D Slicer saves them.
    let positions: Vec<Point3<f64>> =
        triangles.iter().map(|t| lattice.mm(lattice.grid().point(t[0] as usize))).collect();
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("langer.mrk.json");
    let curves = [-60.0, 60.0].map(|z_mm| closed_curve(&positions, z_mm));
    std::fs::write(&path, format!("{{\"markups\": [{}]}}", curves.join(", ")))?;
    let strokes = Strokes::read(&path)?;

    let (site, _) = phantom.incision_site();
    let nearest = |a: &&Point3<f64>, b: &&Point3<f64>| {
        let [a, b] = [a, b].map(|p| (**p - Point3::from(site)).norm());
        a.total_cmp(&b)
    };
    let at_site = positions.iter().min_by(nearest).and_then(|p| positions.iter().position(|q| q == p));
    for (name, directions) in [
        ("around", Directions::Around([0.0, 0.0, 1.0])),
        ("along", Directions::Along([0.0, 0.0, 1.0])),
        ("strokes", Directions::Strokes(strokes)),
    ] {
        let field = SkinField::new(&skin, &directions)?;
        println!("{name:<9} covers {:.1} % of the skin", 100.0 * field.coverage);
        if let Some(t) = at_site {
            let data = field.cell_data();
            println!("          on the belly {:.2?}, weight {:.2}", data.directions[t], data.weights[t]);
        }
    }

    let depths = depth_mm(&skin, 15.0)?;
    let vertices = body.vertices().iter().filter(|&&vertex| vertex).count();
    let shallow = depths.iter().filter(|depth| depth.is_finite()).count();
    println!("depth     {shallow} of {vertices} vertices lie within 15 mm of the skin");
    Ok(())
}

/// A curve around the trunk at one height: in each sector of 20° one point of the skin. Slicer
/// saves LPS coordinates, in which x and y have the other sign.
fn closed_curve(positions: &[Point3<f64>], z_mm: f64) -> String {
    let sector = |p: &Point3<f64>| (p.y.atan2(p.x).to_degrees() / 20.0).floor() as i32;
    let at_height = |p: &&Point3<f64>| (p.z - z_mm).abs() < 5.0;
    let in_sector = |n: i32| positions.iter().filter(at_height).find(|p| sector(p) == n);
    let point = |p: &Point3<f64>| format!("{{\"position\": [{}, {}, {}]}}", -p.x, -p.y, p.z);
    let points: Vec<String> = (-9..9).filter_map(in_sector).map(point).collect();
    let points = points.join(", ");
    format!("{{\"type\": \"ClosedCurve\", \"coordinateSystem\": \"LPS\", \"controlPoints\": [{points}]}}")
}
