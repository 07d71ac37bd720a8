//! A block of tissue with a membrane on top that is at rest, and a cut through the membrane.

use cutis_coloring::greedy;
use cutis_constraints::{Constraint, SkinStrip, SkinStripAtRest, SkinStripMaterial, SkinStripTurn};
use cutis_solver::{Formulation, Settings, Stiffness, System, SystemBuilder, Values};
use nalgebra::{Point3, Vector3};

use super::{Failure, Problem};
use crate::at_rest::block::{Block, Elements};

/// The block of the study of scans at rest, of `size` vertices along each axis.
///
/// XPBD gets strips that contain their loads, and the loads of the strips that the cut removed.
/// Vertex block descent gets strips with a load on each vertex. Both have the same energy up to a
/// constant. PBD gets nothing: it has no moduli, and its loads depend on the substeps and
/// iterations.
///
/// # Errors
/// A material or a system is refused.
pub fn wound(size: [usize; 3]) -> Result<Problem, Failure> {
    let block = Block::new(size, true)?;
    let [left, right] = block.lips();
    let scan = block.scan.clone();
    let opening = move |x: &[Point3<f64>]| {
        let moved = |lip: &[u32]| {
            lip.iter().map(|&v| x[v as usize].x - scan[v as usize].x).sum::<f64>() / lip.len() as f64
        };
        1e3 * (moved(&right) - moved(&left))
    };
    Ok(Problem {
        name: "membrane",
        what: format!(
            "a block of {} × {} × {} vertices with a membrane at rest on top, 15 and 5 N/m along and across, \
             moduli of 60 and 40 N/m, cut through along the middle, across the lines of tension",
            size[0], size[1], size[2]
        ),
        xpbd: xpbd(&block)?,
        vbd: Some(vbd(&block)?),
        pbd: None,
        settings: Settings {
            formulation: Formulation::Xpbd,
            dt_s: 1.0 / 60.0,
            damping_per_s: 10.0,
            ..Settings::default()
        },
        instants: vec![1, 4],
        compared_at: 5,
        most_frames: 90,
        opening: Some((Box::new(opening), "mm")),
        few_settings: true,
    })
}

fn xpbd(block: &Block) -> Result<System<f32>, Failure> {
    let [_, removed] = block.loads();
    let builder = add_strips::<SkinStripAtRest>(tissue(block)?, block)?;
    let builder = add_strips::<SkinStripTurn>(builder, block)?;
    Ok(builder.loads(&single(&removed))?.build())
}

fn vbd(block: &Block) -> Result<System<f32>, Failure> {
    let [kept, removed] = block.loads();
    let loads: Vec<_> = kept.iter().zip(&removed).map(|(kept, removed)| kept + removed).collect();
    Ok(add_strips::<SkinStrip>(tissue(block)?, block)?.loads(&single(&loads))?.build())
}

/// The block without its skin.
fn tissue(block: &Block) -> Result<SystemBuilder<f32>, Failure> {
    let builder = SystemBuilder::<f32>::in_place(&block.scan, &block.inverse_masses)?;
    add(add(builder, &block.springs)?, &block.volumes)
}

fn add<C: Constraint<N>, const N: usize>(
    builder: SystemBuilder<f32>,
    elements: &Elements<C, N>,
) -> Result<SystemBuilder<f32>, Failure>
where
    C::Material: Default,
{
    let Elements { vertices, compliances, .. } = elements;
    let groups = greedy(vertices, count(vertices))?;
    Ok(builder.add_from_rest::<C, N>(vertices, &Default::default(), stiffness(compliances), &groups)?)
}

/// Adds one type of strip on the skin that the cut left. The parameters come from the positions as
/// the solver stores them, so that the strips are exactly at rest.
fn add_strips<C: Constraint<3, Material = SkinStripMaterial>>(
    builder: SystemBuilder<f32>,
    block: &Block,
) -> Result<SystemBuilder<f32>, Failure> {
    let strips = &block.strips[0];
    let scan: Vec<Point3<f32>> = block.scan.iter().map(|x| x.cast()).collect();
    let elements = strips.vertices.iter().zip(&strips.materials);
    let params: Vec<C::Params<f32>> =
        elements.map(|(e, material)| C::from_rest(&e.map(|v| scan[v as usize]), material)).collect();
    let groups = greedy(&strips.vertices, scan.len())?;
    Ok(builder.add::<C, 3>(&strips.vertices, &params, stiffness(&strips.compliances), &groups)?)
}

fn stiffness(compliances: &[f64]) -> Stiffness<f32> {
    Stiffness::Compliance(Values::Each(compliances.iter().map(|&compliance| compliance as f32).collect()))
}

fn count<const N: usize>(elements: &[[u32; N]]) -> usize {
    elements.iter().flatten().max().map_or(0, |&last| last as usize + 1)
}

fn single(loads: &[Vector3<f64>]) -> Vec<Vector3<f32>> {
    loads.iter().map(|load| load.cast()).collect()
}

#[cfg(test)]
mod tests {
    use cutis_newton::{Options, Problem as Newton, relative_rms};

    use super::*;

    const SIZE: [usize; 3] = [9, 9, 4];

    fn equilibrium(system: &System<f32>) -> Vec<Point3<f64>> {
        let newton = Newton::of(&system.to_f64(), [0.0; 3]).unwrap();
        newton.equilibrium(newton.positions(), &Options::default()).unwrap().positions
    }

    #[test]
    fn both_bodies_open_to_the_same_equilibrium() {
        let block = Block::new(SIZE, true).unwrap();
        let wanted = equilibrium(&xpbd(&block).unwrap());
        let error = |x: &[Point3<f64>]| relative_rms(x, &wanted, &block.scan);
        let mut other = vbd(&block).unwrap();
        assert!(error(&equilibrium(&other)) < 1e-4);

        // Controls: without the loads of the removed strips nothing opens, and without any load the
        // skin shrinks.
        let [kept, _] = block.loads();
        other.set_loads(&single(&kept)).unwrap();
        assert!(error(&equilibrium(&other)) > 0.9);
        other.set_loads(&[]).unwrap();
        assert!(error(&equilibrium(&other)) > 0.9);
    }

    #[test]
    fn the_block_is_at_rest_until_it_is_cut() {
        let block = Block::new(SIZE, false).unwrap();
        let moved = largest_motion(&equilibrium(&xpbd(&block).unwrap()), &block);
        let opened = Block::new(SIZE, true).unwrap();
        let cut = largest_motion(&equilibrium(&xpbd(&opened).unwrap()), &opened);
        assert!(moved < 1e-7 && cut > 1e-4, "{moved:e} m, {cut:e} m");
    }

    /// Largest displacement in m.
    fn largest_motion(x: &[Point3<f64>], block: &Block) -> f64 {
        x.iter().zip(&block.scan).map(|(x, scan)| (x - scan).norm()).fold(0.0, f64::max)
    }
}
