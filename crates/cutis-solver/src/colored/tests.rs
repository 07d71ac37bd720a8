//! Tests of each unsafe block with a tiny body, on one thread and on two, against the serial code.
//! Miri runs them in seconds: `cargo +nightly miri test -p cutis-solver --lib colored::`.

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Constraint, Distance, Volume};
use nalgebra::Point3;

use super::*;
use crate::{Columns, Formulation, Settings, Simulation, Stiffness, SystemBuilder, VertexStore};

/// Two tetrahedra that share no vertex, connected by an edge. All are deformed.
fn system(each: bool) -> System<f64> {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point3::from);
    let moved = corners.map(|p| Point3::new(p.x * 1.2 + 3.0, p.y - 0.1 * p.z, p.z * 0.7));
    let positions = [corners, moved].concat();
    let tets = [[0, 1, 2, 3], [4, 5, 6, 7]];
    let edges = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [6, 7]];
    let stiffness = |n: usize| match each {
        true => Stiffness::Compliance(crate::Values::Each((1..=n).map(|k| 0.01 * k as f64).collect())),
        false => Stiffness::compliance(0.01),
    };
    SystemBuilder::<f64>::new(&positions, &[0.0, 1.0, 2.0, 1.0, 1.0, 2.0, 1.0, 0.5])
        .unwrap()
        .add::<Distance, 2>(&edges, &[[0.8]; 7], stiffness(7), &greedy(&edges, 8).unwrap())
        .unwrap()
        .add::<Volume, 4>(&tets, &[[0.3]; 2], stiffness(2), &Groups::from_colors(&[0, 0]).unwrap())
        .unwrap()
        .build()
}

/// Runs `work` on `threads` threads at the same time.
fn on_threads(threads: usize, work: &(dyn Fn(usize) + Sync)) {
    std::thread::scope(|scope| {
        for worker in 1..threads {
            scope.spawn(move || work(worker));
        }
        work(0);
    });
}

/// Runs `work` with the vertices in one of the two forms.
fn stored<T: Scalar>(vertices: &mut [Vertex<T>], by_column: bool, work: impl FnOnce(VertexStore<'_, T>)) {
    if !by_column {
        return work(vertices.into());
    }
    let mut columns = Columns::of(vertices);
    work((&mut columns).into());
    (0..).zip(vertices).for_each(|(index, vertex)| *vertex = columns.get(index));
}

/// All vertices after one sweep over all colors, and the multipliers of the kinds.
fn swept(
    each: bool,
    keeps_multipliers: bool,
    by_column: bool,
    run: impl Fn(ConstraintColor<'_, f64>),
) -> Vec<Vec<f64>> {
    let mut system = system(each);
    let (vertices, kinds) = system.projection_parts();
    let step = Step::Xpbd { inverse_h_squared: 100.0 };
    let mut kept = Vec::new();
    for kind in kinds {
        let set = &**kind;
        let mut multipliers = vec![0.25; if keeps_multipliers { set.len() } else { 0 }];
        for color in 0..set.colors() {
            stored(vertices, by_column, |vertices| {
                let multipliers = &mut multipliers;
                run(ConstraintColor { set, color, tile: None, vertices, step, multipliers });
            });
        }
        kept.push(multipliers);
    }
    kept.push(vertices.iter().flat_map(|vertex| vertex.components()).collect());
    kept
}

#[test]
fn shared_constraints_have_the_bits_of_serial_ones() {
    for (each, keeps_multipliers) in [(false, false), (false, true), (true, true)] {
        let serial = swept(each, keeps_multipliers, false, |color| color.project());
        assert_eq!(swept(each, keeps_multipliers, true, |color| color.project()), serial);
        for (threads, by_column) in [(1, false), (1, true), (2, false), (2, true)] {
            let shared = swept(each, keeps_multipliers, by_column, |color| {
                let color = Colored::new(color, SimdLevel::best(), threads);
                on_threads(threads, &|worker| while color.project_next_chunk(worker) {});
                assert!(!color.project_next_chunk(0), "no chunk is left");
            });
            assert_eq!(shared, serial, "{threads} threads");
        }
    }
}

/// All vertices after one symmetric sweep of vertex block descent.
fn descended(each: bool, run: impl Fn(VertexColor<'_, f64>)) -> Vec<Vertex<f64>> {
    let mut system = system(each);
    let settings = Settings { formulation: Formulation::Vbd, dt_s: 0.1, ..Settings::default() };
    let descent = Descent::new(&system, &settings).unwrap();
    let simulation = Simulation::new(system.clone(), settings).unwrap();
    for &pass in simulation.schedule().color_passes_of(0) {
        run(VertexColor { system: &mut system, descent: &descent, pass });
    }
    system.vertices
}

#[test]
fn shared_vertices_have_the_bits_of_serial_ones() {
    for each in [false, true] {
        let serial = descended(each, |color| color.descend());
        assert_ne!(serial, system(each).vertices, "the sweep moves vertices");
        for threads in [1, 2] {
            let shared = descended(each, |color| {
                let color = ColoredVertices::new(color, SimdLevel::best());
                on_threads(threads, &|_| while color.move_next_chunk() {});
            });
            assert_eq!(shared, serial, "{threads} threads");
        }
    }
}

/// Several chunks for two threads. The last chunk has a remainder without SIMD lanes.
#[test]
fn threads_take_each_chunk_once() {
    let count = 2 * CHUNK as u32 + 3;
    let positions: Vec<_> = (0..2 * count).map(|n| Point3::new(f64::from(n), 0.0, 0.0)).collect();
    let edges: Vec<_> = (0..count).map(|n| [2 * n, 2 * n + 1]).collect();
    let groups = Groups::from_colors(&vec![0; edges.len()]).unwrap();
    let build = || {
        SystemBuilder::<f64>::in_place(&positions, &vec![1.0; positions.len()])
            .unwrap()
            .add::<Distance, 2>(&edges, &vec![[0.5]; edges.len()], Stiffness::compliance(0.01), &groups)
            .unwrap()
            .build()
    };
    let step = Step::Xpbd { inverse_h_squared: 100.0 };
    let run = |run: &dyn Fn(ConstraintColor<'_, f64>)| {
        let (mut system, mut multipliers) = (build(), vec![0.0; edges.len()]);
        let (vertices, kinds) = system.projection_parts();
        run(ConstraintColor {
            set: &*kinds[0],
            color: 0,
            tile: None,
            vertices: vertices.into(),
            step,
            multipliers: &mut multipliers,
        });
        (system.vertices, multipliers)
    };
    let serial = run(&|color| color.project());
    let shared = run(&|color| {
        let color = Colored::new(color, SimdLevel::best(), 2);
        assert_eq!(color.chunks(), 3);
        on_threads(2, &|worker| while color.project_next_chunk(worker) {});
    });
    assert!(shared == serial);
    assert!(serial.1.iter().all(|&multiplier| multiplier != 0.0));
}

/// A kind whose constraints advance by a stride, with its multipliers.
type Swept<T> = (Vec<Vertex<T>>, Vec<T>);

/// Springs between two rows of vertices, or tetrahedra between four rows, at the places `places` of
/// a row. Parameters and compliances are the same for all constraints or differ.
fn in_rows<T: Scalar, C: Constraint<N>, const N: usize>(
    places: &[u32],
    varied: bool,
    by_column: bool,
    scale: f64,
    run: impl Fn(ConstraintColor<'_, T>),
) -> Swept<T>
where
    C::Params<T>: From<[T; 1]>,
{
    let row = places.iter().max().unwrap() + 1;
    let tuples: Vec<[u32; N]> =
        places.iter().map(|place| std::array::from_fn(|corner| row * corner as u32 + place)).collect();
    // Corners of a deformed cube, so that each constraint is violated.
    let corner = |n: u32| [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.0, 1.2, 0.1], [0.2, 0.0, 0.9]][n as usize];
    let positions: Vec<Point3<f64>> = (0..N as u32 * row)
        .map(|n| Point3::from(corner(n / row)) * (1.0 + 0.01 * f64::from(n % 17)))
        .collect();
    let masses: Vec<f64> = (0..positions.len()).map(|n| (n % 5) as f64).collect();
    let value = |k: usize| T::constant(if varied { scale * (1.0 + 0.1 * (k % 7) as f64) } else { scale });
    let params: Vec<C::Params<T>> = (0..tuples.len()).map(|k| [value(k)].into()).collect();
    let stiffness = match varied {
        true => Stiffness::Compliance(crate::Values::Each((0..tuples.len()).map(value).collect())),
        false => Stiffness::compliance(T::constant(scale)),
    };
    let groups = Groups::from_colors(&vec![0; tuples.len()]).unwrap();
    let mut system = SystemBuilder::<T>::in_place(&positions, &masses)
        .unwrap()
        .add::<C, N>(&tuples, &params, stiffness, &groups)
        .unwrap()
        .build();
    let mut multipliers: Vec<T> = (0..tuples.len()).map(|k| T::constant(0.01 * k as f64)).collect();
    let (vertices, kinds) = system.projection_parts();
    let step = Step::Xpbd { inverse_h_squared: T::constant(100.0) };
    let set = &*kinds[0];
    stored(vertices, by_column, |vertices| {
        let multipliers = &mut multipliers;
        run(ConstraintColor { set, color: 0, tile: None, vertices, step, multipliers });
    });
    (system.vertices, multipliers)
}

/// Compares every level with the serial code, for constraints at some places of their rows.
fn check_rows<T: Scalar, C: Constraint<N>, const N: usize>(places: &[u32])
where
    C::Params<T>: From<[T; 1]>,
{
    // Miri takes the case with most reads.
    for varied in if cfg!(miri) { vec![true] } else { vec![false, true] } {
        let serial = in_rows::<T, C, N>(places, varied, false, 0.5, |color| color.project());
        assert!(serial.1.iter().any(|&multiplier| multiplier != T::zero()));
        for (level, by_column) in SimdLevel::available().into_iter().flat_map(|l| [(l, false), (l, true)]) {
            let shared = |scale| {
                in_rows::<T, C, N>(places, varied, by_column, scale, |color| {
                    let color = Colored::new(color, level, 2);
                    on_threads(2, &|worker| while color.project_next_chunk(worker) {});
                })
            };
            assert!(shared(0.5) == serial, "{level:?}, varied: {varied}, by column: {by_column}");
            assert!(shared(0.50001) != serial, "the comparison can fail");
        }
    }
}

#[test]
fn runs_of_every_stride_have_the_bits_of_serial_constraints() {
    let (count, strides) = if cfg!(miri) { (41, vec![1, 2]) } else { (1100, vec![1, 2, 4, 5, 9]) };
    for stride in strides {
        let row: Vec<u32> = (0..count).map(|k| k * stride).collect();
        check_rows::<f32, Distance, 2>(&row);
        if !cfg!(miri) {
            check_rows::<f32, Volume, 4>(&row);
            check_rows::<f64, Volume, 4>(&row);
        }
    }
}

#[test]
fn broken_runs_have_the_bits_of_serial_constraints() {
    let count = if cfg!(miri) { 33 } else { 1100 };
    // Rows of eleven places with a gap, and strides that change along a row.
    let gaps: Vec<u32> = (0..count).map(|k| 20 * (k / 11) + k % 11).collect();
    check_rows::<f64, Distance, 2>(&gaps);
    if !cfg!(miri) {
        let mixed: Vec<u32> = (0..count).map(|k| if k < count / 2 { k } else { 2 * k }).collect();
        let backwards: Vec<u32> = (0..count).rev().collect();
        for places in [gaps, mixed, backwards] {
            check_rows::<f32, Distance, 2>(&places);
            check_rows::<f32, Volume, 4>(&places);
        }
    }
}

/// All vertices of a body of several tiles after two sweeps in the order of `passes`: pairs of a
/// tile and a color. `None` stands for a sweep over whole colors.
fn tiled(tiles: Option<fn(usize) -> Vec<usize>>, project: fn(ConstraintColor<'_, f32>)) -> Vec<Vertex<f32>> {
    let lattice = cutis_test_kit::Kuhn::new([5, 4, 20], 0.1);
    let masses: Vec<f32> = lattice.positions.iter().map(|p| if p.z == 0.0 { 0.0 } else { 1.0 }).collect();
    let positions: Vec<Point3<f64>> =
        lattice.positions.iter().map(|p| Point3::new(p.x * 1.2, p.y + 0.1 * p.z, p.z * p.z)).collect();
    let groups = Groups::from_colors(&lattice.tet_colors).unwrap();
    let mut system = SystemBuilder::<f32>::in_place(&positions, &masses)
        .unwrap()
        .add::<Volume, 4>(&lattice.tets, &vec![[2e-4]; lattice.tets.len()], Stiffness::pbd(0.8), &groups)
        .unwrap()
        .build();
    let (vertices, kinds) = system.projection_parts();
    let (set, step) = (&*kinds[0], Step::Pbd);
    assert!(set.tiles() > 3);
    for _ in 0..2 {
        let order =
            tiles.map_or_else(|| vec![None], |order| order(set.tiles()).into_iter().map(Some).collect());
        for tile in order {
            for color in 0..set.colors() {
                let vertices = (&mut *vertices).into();
                project(ConstraintColor { set, color, tile, vertices, step, multipliers: &mut [] });
            }
        }
    }
    system.vertices
}

#[test]
#[cfg_attr(miri, ignore = "too slow, and serial code has no unsafe part")]
fn tiles_have_the_bits_of_whole_colors() {
    let serial = |color: ConstraintColor<'_, f32>| color.project();
    let shared = |color: ConstraintColor<'_, f32>| {
        let color = Colored::new(color, SimdLevel::best(), 2);
        on_threads(2, &|worker| while color.project_next_chunk(worker) {});
    };
    let whole = tiled(None, serial);
    assert!(tiled(None, shared) == whole);
    for project in [serial, shared] {
        assert!(tiled(Some(|count| (0..count).collect()), project) == whole);
        let backwards = tiled(Some(|count| (0..count).rev().collect()), project);
        assert!(backwards != whole, "the order of the tiles matters");
    }
}

#[test]
#[should_panic(expected = "vertices that do not exist")]
fn a_set_for_more_vertices_is_rejected() {
    let mut system = system(false);
    let (vertices, kinds) = system.projection_parts();
    let (vertices, step) = ((&mut vertices[..7]).into(), Step::Pbd);
    Colored::new(
        ConstraintColor { set: &*kinds[0], color: 0, tile: None, vertices, step, multipliers: &mut [] },
        SimdLevel::best(),
        1,
    );
}

#[test]
#[should_panic(expected = "one multiplier per constraint")]
fn too_few_multipliers_are_rejected() {
    let mut system = system(false);
    let (vertices, kinds) = system.projection_parts();
    let (vertices, multipliers, step) = (vertices.into(), &mut [0.0; 6][..], Step::Pbd);
    Colored::new(
        ConstraintColor { set: &*kinds[0], color: 0, tile: None, vertices, step, multipliers },
        SimdLevel::best(),
        1,
    );
}
