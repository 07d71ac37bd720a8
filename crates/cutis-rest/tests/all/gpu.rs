//! Searches whose equations are solved on a GPU end where those on the CPU end.

use cutis_gpu::{Gpu, GpuError, GpuOptions, Select};
use cutis_newton::{Problem, relative_rms};
use cutis_rest::{Body, Options, Rest, RestError, RestGpu, Search};
use cutis_test_kit::gpu::on_each_adapter;

use crate::blocks::{GRAVITY_M_S2, Make};

/// Options for comparisons.
const EXACT: Options = Options { error: 1e-9, force: 1e-12, most_steps: 100, most_cycles: 300 };

fn body(make: Make) -> Body {
    Body::of(&make.system(), GRAVITY_M_S2).unwrap()
}

fn settled(body: &Body, options: &Options) -> Rest {
    body.settle(options, &mut |_| ()).unwrap()
}

/// Bodies that are solved directly and on several levels, soft and stiff, whole and cut, rest where
/// the direct solver and the CPU find them. Control: those of another stiffness do not.
#[test]
fn blocks_rest_where_the_cpu_and_a_direct_solver_find_them() {
    let usual = Make::default();
    let makes = [
        Make { size: 5, ..usual },
        Make { size: 11, cut: true, ..usual },
        Make { size: 11, contrast: 1000.0, ..usual },
        Make { size: 11, incompressibility: 100.0, ..usual },
    ];
    on_each_adapter(|gpu| {
        let device = RestGpu::new(gpu).unwrap();
        for (n, make) in makes.into_iter().enumerate() {
            let system = make.system();
            let start = system.positions();
            let problem = Problem::of(&system, GRAVITY_M_S2).unwrap();
            let expected = problem.equilibrium(&start, &cutis_newton::Options::default()).unwrap();
            let on_cpu = settled(&body(make), &EXACT);
            let on_gpu = settled(&body(make).on_gpu(&device), &EXACT);
            let error = relative_rms(&on_gpu.positions, &expected.positions, &start);
            let apart = relative_rms(&on_gpu.positions, &on_cpu.positions, &start);
            eprintln!("block {n}: {error:e} from Newton, {apart:e} from the CPU");
            assert!(error < 1e-6 && apart < 1e-6, "block {n}: {error:e} and {apart:e}");
            let other = Make { youngs_modulus_pa: 1.01 * make.youngs_modulus_pa, ..make };
            let other = settled(&body(other).on_gpu(&device), &EXACT);
            let control = relative_rms(&other.positions, &expected.positions, &start);
            assert!(control > 1e-3, "block {n}: {control:e}");
        }
    });
}

/// The error that a search states holds, and it takes about as many cycles as on the CPU.
#[test]
fn stated_errors_hold() {
    let make = Make { size: 11, youngs_modulus_pa: 3e3, ..Make::default() };
    let start = make.system().positions();
    let exact = settled(&body(make), &EXACT);
    let cycles = |rest: &Rest| rest.steps.iter().map(|step| step.cycles).sum::<usize>();
    on_each_adapter(|gpu| {
        let device = RestGpu::new(gpu).unwrap();
        for error in [0.1, 1e-3, 1e-5] {
            let options = Options { error, force: 0.0, ..EXACT };
            let on_cpu = settled(&body(make), &options);
            let on_gpu = settled(&body(make).on_gpu(&device), &options);
            let real = relative_rms(&on_gpu.positions, &exact.positions, &start);
            assert!(real <= on_gpu.error && on_gpu.error <= error, "{error}: {} and {real}", on_gpu.error);
            let apart = relative_rms(&on_gpu.positions, &on_cpu.positions, &start);
            assert!(apart <= on_gpu.error + on_cpu.error, "{error}: {apart:e}");
            assert!(cycles(&on_gpu).abs_diff(cycles(&on_cpu)) <= 1 + cycles(&on_cpu) / 10);
        }
    });
}

/// A device gives the same bits twice, and in chunks of any size.
#[test]
fn chunks_do_not_change_a_bit() {
    let make = Make { size: 11, cut: true, ..Make::default() };
    let options = Options::default();
    on_each_adapter(|gpu| {
        let on = |gpu: &Gpu| settled(&body(make).on_gpu(&RestGpu::new(gpu).unwrap()), &options);
        let once = on(gpu);
        assert!(on(gpu) == once);
        for chunk_cap in [1, 300] {
            let select = Select::Index(gpu.adapter().index);
            let chunk_cap = Some(chunk_cap);
            let split = GpuOptions { select, chunk_cap, baseline_limits: true, ..GpuOptions::default() };
            assert!(on(&Gpu::open(&split).unwrap()) == once, "{chunk_cap:?}");
        }
        let other = Make { youngs_modulus_pa: 1.0001e4, ..make };
        let other = settled(&body(other).on_gpu(&RestGpu::new(gpu).unwrap()), &options);
        assert!(other != once, "control");
    });
}

/// A search takes the memory that the documentation states, and frees it at its end. Its steps
/// upload matrices and read sums, but allocate memory with new levels only.
#[test]
fn a_search_takes_the_stated_memory() {
    let make = Make { size: 24, ..Make::default() };
    on_each_adapter(|gpu| {
        let held = body(make).on_gpu(&RestGpu::new(gpu).unwrap());
        let before = gpu.counters().buffer_bytes;
        let mut search = Search::new(&held, &EXACT).unwrap();
        search.step().unwrap();
        let first = gpu.counters();
        let each = (first.buffer_bytes - before) as f64 / held.free_count() as f64;
        eprintln!("{each} bytes per vertex");
        let stated = RestGpu::BYTES_PER_VERTEX as f64;
        assert!((each / stated - 1.0).abs() < 0.06, "{each} bytes per vertex, {stated} are stated");
        search.step().unwrap();
        let second = gpu.counters();
        assert_eq!((second.buffers, second.kernels), (first.buffers, first.kernels));
        assert!(second.readbacks > first.readbacks);
        drop(search);
        gpu.wait().unwrap();
        assert_eq!(gpu.counters().buffer_bytes, before);
    });
}

/// A body that nothing holds falls there, too. Then a device is lost in the middle of a search.
#[test]
fn searches_that_fail_are_errors() {
    on_each_adapter(|gpu| {
        let device = RestGpu::new(gpu).unwrap();
        let falling = body(Make { held: false, ..Make::default() }).on_gpu(&device);
        let error = falling.settle(&Options::default(), &mut |_| ()).unwrap_err();
        assert!(matches!(error, RestError::NotAtRest { .. }), "{error}");

        let held = body(Make::default()).on_gpu(&device);
        let mut search = Search::new(&held, &EXACT).unwrap();
        search.step().unwrap();
        let before = search.positions();
        gpu.lose();
        let error = search.step().unwrap_err();
        assert!(matches!(error, RestError::Gpu(GpuError::Lost { .. })), "{error}");
        assert!(error.to_string().contains(&gpu.adapter().name), "{error}");
        assert!(search.positions() == before, "the state is that of the last step");
        let error = Search::new(&held, &EXACT).err().unwrap();
        assert!(matches!(error, RestError::Gpu(GpuError::Lost { .. })), "{error}");
    });
}
