//! A step allocates no memory, and absent parts of a scene take none. This test has its own binary,
//! because it counts every allocation of the process.

use std::alloc::{GlobalAlloc, Layout, System as SystemAllocator};
use std::sync::atomic::{AtomicUsize, Ordering};

use cutis_coloring::Groups;
use cutis_constraints::{Distance, Volume};
use cutis_solver::{Formulation, Settings, Solver, SolverReference, Stiffness, System, SystemBuilder};
use cutis_solver_cpu::SolverCpu;
use cutis_test_kit::Kuhn;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is forwarded unchanged to the system's allocator.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's contract is that of the system's allocator.
        unsafe { SystemAllocator.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's contract is that of the system's allocator.
        unsafe { SystemAllocator.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A lattice with nearly all constraints in rows.
fn body(volumes: bool) -> System<f32> {
    let lattice = Kuhn::new([40, 18, 18], 0.1);
    let count = lattice.positions.len();
    let system = SystemBuilder::<f32>::new(&lattice.positions, &vec![1.0; count])
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &Default::default(),
            Stiffness::compliance(1e-4),
            &Groups::from_colors(&lattice.edge_colors).unwrap(),
        )
        .unwrap();
    if !volumes {
        return system.build();
    }
    let groups = Groups::from_colors(&lattice.tet_colors).unwrap();
    let compliance = Stiffness::compliance(1e-6);
    system
        .add_from_rest::<Volume, 4>(&lattice.tets, &Default::default(), compliance, &groups)
        .unwrap()
        .build()
}

fn settings(iterations: u32) -> Settings {
    Settings { formulation: Formulation::Xpbd, iterations, ..Settings::default() }
}

/// Returns the number of allocations in `steps` calls of `step`. A first call is not counted.
fn allocations(solver: &mut dyn Solver<f32>, steps: usize) -> usize {
    solver.step(1).unwrap();
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    for _ in 0..steps {
        solver.step(1).unwrap();
    }
    ALLOCATIONS.load(Ordering::Relaxed) - before
}

/// This is a single test, so that no other test allocates at the same time.
#[test]
fn steps_allocate_nothing_and_memory_is_only_for_parts_in_use() {
    for iterations in [1, 2] {
        let mut reference = SolverReference::new(body(true), settings(iterations)).unwrap();
        assert_eq!(allocations(&mut reference, 3), 0);
        for threads in [1, 2, 8] {
            let mut solver = SolverCpu::new(body(true), settings(iterations), Some(threads)).unwrap();
            assert_eq!(allocations(&mut solver, 3), 0, "{threads} threads");
        }
    }
    let descent = Settings { formulation: Formulation::Vbd, ..settings(2) };
    for threads in [1, 8] {
        let mut solver = SolverCpu::new(body(true), descent, Some(threads)).unwrap();
        assert_eq!(allocations(&mut solver, 3), 0, "descent, {threads} threads");
    }
    // Control: the counter counts an allocation.
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    drop(std::hint::black_box(vec![1u8]));
    assert!(ALLOCATIONS.load(Ordering::Relaxed) > before);

    let names = |volumes, iterations| {
        let solver = SolverReference::new(body(volumes), settings(iterations)).unwrap();
        solver.bytes().iter().map(|part| part.name).collect::<Vec<_>>()
    };
    assert_eq!(names(false, 1), ["vertices", "distance"]);
    assert_eq!(names(true, 1), ["vertices", "distance", "volume"]);
    assert_eq!(names(true, 2), ["vertices", "distance", "volume", "multipliers"]);
    let descending = SolverReference::new(body(true), descent).unwrap();
    assert_eq!(descending.bytes().last().map(|part| part.name), Some("incidences"));

    let on_threads = SolverCpu::new(body(false), settings(1), Some(2)).unwrap();
    let names: Vec<_> = on_threads.bytes().iter().map(|part| part.name).collect();
    assert_eq!(names, ["vertices", "distance", "columns"]);

    // A vertex has 4 + 3 + 3 numbers. A spring has two indices and a length. To these come color
    // offsets, a few runs of each color, and two indices for sixteen springs in a row.
    let lattice = Kuhn::new([40, 18, 18], 0.1);
    let solver = SolverReference::new(body(false), settings(1)).unwrap();
    let bytes: Vec<usize> = solver.bytes().iter().map(|part| part.bytes).collect();
    assert_eq!(bytes[0], lattice.positions.len() * 40);
    let offsets = solver.simulation().system().kinds()[0].offsets().len();
    let runs = bytes[1] - (lattice.edges.len() * 12 + offsets * 4);
    let most = offsets * 72 + lattice.edges.len() / 16 * 8;
    assert!(runs <= most, "{runs} bytes for {offsets} colors");
}
