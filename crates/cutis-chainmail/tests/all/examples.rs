//! Small examples with known results: rows, sheets, several materials, combs, bones.

use cutis_chainmail::{Chain, ChainError, Drag, Material, MaterialTable, NO_MATERIAL, Order};

const SOFT: Material = Material::isotropic(0.5, 2.0, 0.25, 0.0);

fn chain(shape: [usize; 3], materials: &[Material], of: impl Fn([usize; 3]) -> u8) -> Chain {
    let [nx, ny, nz] = shape;
    let places = (0..nx * ny * nz).map(|e| [e % nx, e / nx % ny, e / (nx * ny)]);
    Chain::new(shape, [1.0; 3], materials, places.map(of).collect()).unwrap()
}

fn drag(chain: &mut Chain, place: [usize; 3], by: [f64; 3]) -> cutis_chainmail::DragReport {
    let element = chain.element(place);
    let at = chain.position(element);
    let to = [0, 1, 2].map(|c| at[c] + by[c]);
    let moved = chain.drag(&[Drag { element, to }], Order::Fifo).unwrap();
    assert_eq!(chain.position(element), to);
    moved
}

/// Cuts the links along x behind a column, and returns how many there were.
fn cut_after_column(chain: &mut Chain, column: usize) -> usize {
    let nx = chain.shape()[0];
    chain.cut(|_, a, b| a as usize % nx == column && b == a + 1)
}

/// The x coordinates of the first row.
fn row(chain: &Chain) -> Vec<f64> {
    (0..chain.shape()[0]).map(|i| chain.position(i as u32)[0]).collect()
}

#[test]
fn a_row_follows_link_by_link() {
    let mut row_of_six = chain([6, 1, 1], &[SOFT], |_| 0);
    let moved = drag(&mut row_of_six, [5, 0, 0], [2.5, 0.0, 0.0]);
    assert_eq!(row(&row_of_six), [0.0, 1.0, 2.0, 3.5, 5.5, 7.5]);
    assert_eq!((moved.elements, row_of_six.violations().links), (3, 0));
    drag(&mut row_of_six, [5, 0, 0], [-4.0, 0.0, 0.0]);
    assert_eq!(row(&row_of_six), [0.0, 1.0, 2.0, 2.5, 3.0, 3.5]);
}

#[test]
fn a_sheet_shears() {
    let mut sheet = chain([5, 5, 1], &[SOFT], |_| 0);
    drag(&mut sheet, [0, 2, 0], [0.0, 1.0, 0.0]);
    // Across the links along x, each neighbor may lag a quarter of a step behind.
    let along =
        |j: usize| (0..5).map(|i| sheet.displacement(sheet.element([i, j, 0]))[1]).collect::<Vec<_>>();
    assert_eq!(along(2), [1.0, 0.75, 0.5, 0.25, 0.0]);
    // Behind the dragged element links shorten by half a step; ahead of it they lengthen by one.
    assert_eq!(along(3), [0.5, 0.25, 0.0, 0.0, 0.0]);
    assert_eq!(along(1), [0.0; 5]);
}

#[test]
fn rigid_parts_move_as_a_whole() {
    let mut bone_in_fat =
        chain([7, 1, 1], &[SOFT, Material::RIGID], |[i, ..]| u8::from((2..=4).contains(&i)));
    drag(&mut bone_in_fat, [6, 0, 0], [3.0, 0.0, 0.0]);
    // Soft links give way by 1, links between soft and bone by 0.5, links in bone by 0.
    assert_eq!(row(&bone_in_fat), [0.0, 2.0, 3.5, 4.5, 5.5, 7.0, 9.0]);
}

/// Number of links beyond their limits after a drag by the classic algorithm, and by the wave.
fn violated_links(body: Chain, place: [usize; 3], to: [f64; 3]) -> (usize, usize) {
    let (mut classic, mut wave) = (body.clone(), body);
    let drag = Drag { element: wave.element(place), to };
    classic.drag_classic(drag).unwrap();
    wave.drag(&[drag], Order::Fifo).unwrap();
    (classic.violations().links, wave.violations().links)
}

/// A rigid square in a soft sheet.
#[test]
fn classic_fails_with_several_materials_and_wave_does_not() {
    let inside = |n: usize| (4..8).contains(&n);
    let sheet = chain([12, 12, 1], &[SOFT, Material::RIGID], |[i, j, _]| u8::from(inside(i) && inside(j)));
    let (classic, wave) = violated_links(sheet, [2, 2, 0], [8.0, 9.0, 0.0]);
    assert!(classic > 0 && wave == 0, "{classic} {wave}");
}

/// A comb with teeth that are connected at its back only. Whether a tooth follows may depend on
/// another tooth.
#[test]
fn classic_fails_where_links_are_missing_and_wave_does_not() {
    let comb = chain([9, 8, 1], &[SOFT], |[i, j, _]| if i % 2 == 0 || j == 7 { 0 } else { NO_MATERIAL });
    let (classic, wave) = violated_links(comb, [0, 0, 0], [0.0, -20.0, 0.0]);
    assert!(classic > 0 && wave == 0, "{classic} {wave}");
}

/// In a box of one material both algorithms agree.
#[test]
fn classic_and_wave_agree_in_a_box_of_one_material() {
    for by in [[3.0, 0.0, 0.0], [-2.5, 4.0, 0.0], [5.0, -6.0, 7.0]] {
        let (mut classic, mut wave) = (chain([7, 6, 5], &[SOFT], |_| 0), chain([7, 6, 5], &[SOFT], |_| 0));
        let element = wave.element([3, 2, 2]);
        let to = [0, 1, 2].map(|c| wave.position(element)[c] + by[c]);
        classic.drag_classic(Drag { element, to }).unwrap();
        wave.drag(&[Drag { element, to }], Order::Fifo).unwrap();
        for element in 0..wave.places() as u32 {
            assert_eq!(classic.units(element), wave.units(element), "{by:?}: {element}");
        }
    }
}

#[test]
fn rigid_links_without_a_solution_are_reported() {
    let mut bar = chain([5, 1, 1], &[Material::RIGID], |_| 0);
    bar.fix(&[0]).unwrap();
    let report = drag(&mut bar, [4, 0, 0], [1.0, 0.0, 0.0]);
    let [found] = report.contradictions[..] else { panic!("{report:?}") };
    assert_eq!((found.held, found.fixed, found.other, found.axis, found.excess), (0, true, 1, 0, 1.0));
    assert_eq!((row(&bar), bar.violations().links), (vec![0.0, 2.0, 3.0, 4.0, 5.0], 1));
    // After the drag back, the violated link is within its limits again.
    let report = drag(&mut bar, [4, 0, 0], [-1.0, 0.0, 0.0]);
    assert!(report.contradictions.is_empty() && bar.violations().links == 0);
    assert_eq!(row(&bar), [0.0, 1.0, 2.0, 3.0, 4.0]);
}

#[test]
fn a_cut_body_is_two_bodies() {
    let mut body = chain([6, 4, 3], &[SOFT], |_| 0);
    assert_eq!((cut_after_column(&mut body, 2), cut_after_column(&mut body, 2)), (12, 0));
    drag(&mut body, [3, 1, 1], [4.0, 0.0, 0.0]);
    for element in 0..body.places() as u32 {
        let left = element % 6 < 3;
        assert!(!left || body.displacement(element) == [0.0; 3]);
    }
    let strained = body.energy_mm2();
    assert!(body.relax(1000, &[]).settled && body.energy_mm2() < 1e-6 * strained, "{strained}");
}

#[test]
fn relaxation_stops_at_k() {
    let energy = |k: f64| {
        let mut body = chain([20, 1, 1], &[Material { k, ..SOFT }], |_| 0);
        drag(&mut body, [19, 0, 0], [8.0, 0.0, 0.0]);
        let relaxed = body.relax(100_000, &[0, 19]);
        assert!(relaxed.settled, "{relaxed:?}");
        body.energy_mm2()
    };
    // Between two held ends, 19 springs share 8 steps.
    assert!((energy(0.0) - 0.5 * 64.0 / 19.0).abs() < 1e-6);
    let found = [0.0, 0.05, 0.2, 0.6].map(energy);
    assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{found:?}");
}

/// Elements of one class are relaxed together, also with the last of 64 materials. Equal materials
/// with random numbers prevent classes. All three bodies must move alike.
#[test]
fn elements_of_a_class_move_as_single_elements_do() {
    for k in [0.0, 0.01] {
        let material = Material { shear: [0.3, 0.2, 0.25], k, ..Material::isotropic(0.7, 1.6, 0.0, 0.0) };
        let body = |of: fn([usize; 3]) -> u8| chain([40, 9, 7], &[material; 64], of);
        let (mut eight, mut last) = (body(|_| 0), body(|_| 63));
        let mut one = body(|[i, j, k]| ((i * 37 + j * 101 + k * 59).pow(2) / 7 % 64) as u8);
        for chain in [&mut eight, &mut last, &mut one] {
            let grabbed = chain.element([20, 4, 3]);
            drag(chain, [20, 4, 3], [9.0, -4.0, 6.5]);
            let relaxed = chain.relax(25, &[grabbed, chain.element([0, 0, 0]), grabbed]);
            assert!(relaxed.moves > 10_000, "{relaxed:?}");
            // Later cuts, fixed elements and released elements count in the next relaxation.
            assert_eq!(cut_after_column(chain, 12), 9 * 7);
            assert!(chain.relax(5, &[]).moves > 10_000);
            chain.fix(&[chain.element([22, 4, 3])]).unwrap();
            let fixed = chain.position(chain.element([22, 4, 3]));
            assert!(chain.relax(25, &[]).moves > 10_000);
            assert_eq!(chain.position(chain.element([22, 4, 3])), fixed);
        }
        for element in 0..eight.places() as u32 {
            assert_eq!(eight.units(element), one.units(element), "{:?}", eight.position(element));
            assert_eq!(eight.units(element), last.units(element), "{:?}", eight.position(element));
        }
    }
}

#[test]
fn invalid_input_is_refused_and_nothing_moves() {
    let mut body = chain([3, 1, 1], &[SOFT], |[i, ..]| if i == 1 { NO_MATERIAL } else { 0 });
    body.fix(&[0]).unwrap();
    let mut refused = |drags: &[Drag]| body.drag(drags, Order::Fifo).unwrap_err();
    let to = |element, x| Drag { element, to: [x, 0.0, 0.0] };
    assert!(matches!(refused(&[to(2, 3.0), to(1, 0.0)]), ChainError::NoSuchElement { element: 1, .. }));
    assert!(matches!(refused(&[to(2, 3.0), to(3, 0.0)]), ChainError::NoSuchElement { element: 3, .. }));
    assert!(matches!(refused(&[to(2, f64::NAN)]), ChainError::TooFar { .. }));
    assert!(matches!(refused(&[to(2, 1.0), to(0, 1.0)]), ChainError::NotFree { element: 0, .. }));
    assert!(matches!(refused(&[to(2, 1.0), to(2, 2.0)]), ChainError::NotFree { element: 2, .. }));
    assert_eq!(row(&body), [0.0, 1.0, 2.0]);
    for (materials, of) in [(vec![], vec![0]), (vec![SOFT], vec![1]), (vec![SOFT], vec![0, 0])] {
        assert!(Chain::new([1; 3], [1.0; 3], &materials, of).is_err());
    }
    for wrong in [
        Material { shortest: [1.0, 1.1, 1.0], ..SOFT },
        Material { longest: [f64::NAN; 3], ..SOFT },
        Material { shear: [-1.0; 3], ..SOFT },
        Material { k: f64::INFINITY, ..SOFT },
    ] {
        assert!(matches!(Chain::new([1; 3], [1.0; 3], &[wrong], vec![0]), Err(ChainError::Material { .. })));
    }
    assert!(Chain::new([1; 3], [0.0, 1.0, 1.0], &[SOFT], vec![0]).is_err());
}

/// A saved state continues with the same bits, even if it has violated links.
#[test]
fn a_restored_chain_continues_like_the_saved_one() {
    let body = || {
        let mut chain =
            Chain::new([6, 3, 2], [1.0; 3], &[Material::isotropic(0.5, 1.5, 0.5, 0.0)], vec![0; 36]).unwrap();
        chain.fix(&[0, 6]).unwrap();
        chain
    };
    let pull = |x: f64| [Drag { element: 5, to: [x, 0.5, 0.0] }];
    let mut saved = body();
    saved.drag(&pull(20.0), Order::Fifo).unwrap();
    saved.relax(2, &[5]);
    assert!(!saved.strained().is_empty());
    let units: Vec<(u32, [i32; 3])> = (0..36).map(|element| (element, saved.units(element))).collect();
    let mut restored = body();
    restored.restore(&units, saved.strained()).unwrap();
    for chain in [&mut saved, &mut restored] {
        chain.drag(&pull(7.0), Order::Slabs).unwrap();
        assert_eq!(chain.violations().links, 0);
        assert!(chain.relax(50, &[5]).moves > 0);
    }
    assert!((0..36).all(|element| saved.units(element) == restored.units(element)));

    let wrong = |units: &[(u32, [i32; 3])], strained: &[u32]| body().restore(units, strained).unwrap_err();
    assert!(matches!(wrong(&[(36, [0; 3])], &[]), ChainError::NoSuchElement { element: 36, .. }));
    assert!(matches!(wrong(&[], &[99]), ChainError::NoSuchElement { element: 99, .. }));
    assert!(matches!(wrong(&[(1, [0, i32::MIN, 0])], &[]), ChainError::TooFar { element: 1, .. }));
}

#[test]
fn cut_links_and_cut_agree() {
    let body = || Chain::new([3, 3, 1], [1.0; 3], &[Material::RIGID], vec![0; 9]).unwrap();
    let (mut named, mut asked) = (body(), body());
    assert_eq!((named.links(), named.cut_links(&[[4, 1], [3, 4], [0, 4], [4, 77], [3, 4]])), (12, 2));
    assert_eq!(asked.cut(|_, a, b| [[1, 4], [3, 4]].contains(&[a, b])), 2);
    let neighbors =
        |chain: &Chain| (0..9).map(|e| chain.neighbors(e).collect::<Vec<_>>()).collect::<Vec<_>>();
    assert_eq!((neighbors(&named), named.links()), (neighbors(&asked), 10));
}

#[test]
fn presets_begin_at_air_and_end_in_bone() {
    for name in MaterialTable::PRESETS {
        let table = MaterialTable::preset(name).unwrap();
        assert!(table.lowest_hu() <= -1000.0 && table.at(-449.0).is_some());
    }
    let tissue = MaterialTable::preset("tissue").unwrap();
    let at = |hu: f32| tissue.materials()[usize::from(tissue.at(hu).unwrap())];
    assert_eq!(at(1000.0), Material::RIGID);
    assert!(at(-100.0).longest[0] > at(40.0).longest[0] && at(40.0).longest[0] > 1.0);
    let error = MaterialTable::preset("jelly").unwrap_err();
    assert!(
        matches!(error, ChainError::NoSuchPreset { .. }) && error.to_string().contains("tissue or uniform")
    );
}
