//! A block of tissue with fibers in it and a skin that resists bending, combined with a constraint
//! of Cutis. Both backends agree.

use cutis_conformance::device;
use cutis_constraints::Distance;
use cutis_gpu::AdapterKind;
use cutis_solver::{Formulation, Settings, Solver, SolverReference, Stiffness, System, SystemBuilder};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;
use nalgebra::Point3;
use third_party_constraints::{DihedralBending, Fiber, FiberStretch};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Cells along x, y and z.
const CELLS: [usize; 3] = [8, 3, 2];
/// Edge of a cell in m.
const EDGE: f64 = 0.01;
/// Rest stretch of the fibers.
const CONTRACTION: f64 = 0.8;

/// Positions, tetrahedra, edges and hinges of the upper face.
struct Block {
    positions: Vec<Point3<f64>>,
    tets: Vec<[u32; 4]>,
    edges: Vec<[u32; 2]>,
    hinges: Vec<[u32; 4]>,
}

fn vertex(i: usize, j: usize, k: usize) -> u32 {
    (i + (CELLS[0] + 1) * (j + (CELLS[1] + 1) * k)) as u32
}

/// Six tetrahedra around the diagonal of each cell; two triangles on each cell of the upper face.
fn block() -> Block {
    let [nx, ny, nz] = CELLS;
    let mut positions = Vec::new();
    for k in 0..=nz {
        for j in 0..=ny {
            positions.extend((0..=nx).map(|i| Point3::new(i as f64, j as f64, k as f64) * EDGE));
        }
    }
    let (mut tets, mut triangles) = (Vec::new(), Vec::new());
    for (i, j, k) in (0..nx).flat_map(|i| (0..ny).flat_map(move |j| (0..nz).map(move |k| (i, j, k)))) {
        for axes in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            let mut corner = [i, j, k];
            let mut tet = [vertex(i, j, k); 4];
            for (place, axis) in tet[1..].iter_mut().zip(axes) {
                corner[axis] += 1;
                *place = vertex(corner[0], corner[1], corner[2]);
            }
            tets.push(tet);
        }
        if k == nz - 1 {
            let [a, b, c, d] =
                [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| vertex(i, j, nz));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let pairs = |tet: &[u32; 4]| {
        let [a, b, c, d] = *tet;
        [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]].map(|[a, b]| [a.min(b), a.max(b)])
    };
    let mut edges: Vec<[u32; 2]> = tets.iter().flat_map(pairs).collect();
    edges.sort_unstable();
    edges.dedup();
    Block { positions, tets, edges, hinges: hinges(&triangles) }
}

/// The two triangles at each inner edge: the edge, in the direction of the first triangle, and then
/// the opposite vertices.
fn hinges(triangles: &[[u32; 3]]) -> Vec<[u32; 4]> {
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]];
    let all: Vec<[u32; 3]> = triangles.iter().flat_map(sides).collect();
    let opposite = |a: u32, b: u32| all.iter().find(|side| side[..2] == [b, a]).map(|side| side[2]);
    let hinge = |&[a, b, c]: &[u32; 3]| Some([a, b, c, opposite(a, b).filter(|_| a < b)?]);
    all.iter().filter_map(hinge).collect()
}

/// The block, fixed at one end, with fibers along x that contract. Fibers and hinges are optional,
/// for comparison.
fn system(formulation: Formulation, with_fibers: bool, with_hinges: bool) -> Result<System<f32>> {
    let Block { positions, tets, edges, hinges } = block();
    let count = positions.len();
    let fixed = |p: &Point3<f64>| p.x < EDGE / 2.0;
    let inverse_masses: Vec<f64> = positions.iter().map(|p| if fixed(p) { 0.0 } else { 1e3 }).collect();
    let stiffness = |pbd: f32, compliance: f32| match formulation {
        Formulation::Pbd => Stiffness::pbd(pbd),
        Formulation::Xpbd | Formulation::Vbd => Stiffness::compliance(compliance),
    };
    let groups = cutis_coloring::greedy(&edges, count)?;
    let mut builder = SystemBuilder::<f32>::new(&positions, &inverse_masses)?.add_from_rest::<Distance, 2>(
        &edges,
        &Default::default(),
        stiffness(0.2, 1e-3),
        &groups,
    )?;
    if with_fibers {
        let fiber = Fiber { direction: [1.0, 0.0, 0.0], rest_stretch: CONTRACTION };
        let groups = cutis_coloring::greedy(&tets, count)?;
        builder = builder.add_from_rest::<FiberStretch, 4>(&tets, &fiber, stiffness(0.5, 12.0), &groups)?;
    }
    if with_hinges {
        let groups = cutis_coloring::greedy(&hinges, count)?;
        builder = builder.add_from_rest::<DihedralBending, 4>(&hinges, &(), stiffness(0.5, 1e2), &groups)?;
    }
    Ok(builder.build())
}

fn settings(formulation: Formulation, iterations: u32) -> Settings {
    let gravity_m_s2 = [0.0, 0.0, -1.0];
    Settings { formulation, iterations, gravity_m_s2, damping_per_s: 2.0, ..Settings::default() }
}

const RUNS: [(Formulation, u32); 3] = [(Formulation::Pbd, 1), (Formulation::Xpbd, 1), (Formulation::Xpbd, 3)];
const FRAMES: usize = 10;

fn run(solver: &mut dyn Solver<f32>) -> Result<Vec<Point3<f32>>> {
    solver.step(FRAMES)?;
    Ok(solver.positions()?)
}

/// Mean x of the free end.
fn end(positions: &[Point3<f32>]) -> f64 {
    let free = block()
        .positions
        .iter()
        .zip(positions)
        .filter(|(rest, _)| rest.x > EDGE * (CELLS[0] as f64 - 0.5))
        .map(|(_, p)| f64::from(p.x))
        .collect::<Vec<_>>();
    free.iter().sum::<f64>() / free.len() as f64
}

#[test]
fn the_block_contracts_along_its_fibers() -> Result<()> {
    let run = |with_fibers| -> Result<f64> {
        let system = system(Formulation::Xpbd, with_fibers, true)?;
        Ok(end(&run(&mut SolverCpu::new(system, settings(Formulation::Xpbd, 1), None)?)?))
    };
    let length = EDGE * CELLS[0] as f64;
    let (passive, active) = (run(false)? / length, run(true)? / length);
    println!("length over rest length: {passive:.3} without fibers, {active:.3} with");
    assert!(passive > 0.98 && active < 0.9 && active > CONTRACTION, "{passive} {active}");
    Ok(())
}

#[test]
fn the_backends_agree() -> Result<()> {
    let gpu = device::open()?;
    for (formulation, iterations) in RUNS {
        let settings = settings(formulation, iterations);
        let reference = run(&mut SolverReference::new(system(formulation, true, true)?, settings)?)?;
        let threaded = run(&mut SolverCpu::new(system(formulation, true, true)?, settings, Some(2))?)?;
        assert_eq!(threaded, reference, "{formulation:?}");
        // Controls: both kinds affect the result.
        for (with_fibers, with_hinges) in [(false, true), (true, false)] {
            let other = system(formulation, with_fibers, with_hinges)?;
            let other = run(&mut SolverReference::new(other, settings)?)?;
            assert!(
                largest_distance(&other, &reference) > 1e-3 * EDGE,
                "{formulation:?} {with_fibers} {with_hinges}"
            );
        }
        let Some(gpu) = &gpu else { continue };
        let on_device = run(&mut SolverGpu::new(gpu, system(formulation, true, true)?, settings)?)?;
        if gpu.adapter().kind == AdapterKind::Software {
            assert_eq!(on_device, reference, "{formulation:?}");
        } else {
            // A device that fuses operations differs by rounding, which grows during ten frames.
            let difference = largest_distance(&on_device, &reference);
            assert!(difference < 1e-5 * EDGE, "{formulation:?}: {difference} m");
        }
    }
    Ok(())
}

fn largest_distance(a: &[Point3<f32>], b: &[Point3<f32>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from((a - b).norm())).fold(0.0, f64::max)
}
