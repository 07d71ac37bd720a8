//! Data transfers, memory and errors of the relaxation on a GPU.

use cutis_chainmail::{Chain, ChainError, Drag, Material, Order, RelaxGpu};
use cutis_gpu::{Counters, Gpu, GpuError, GpuOptions};

use cutis_test_kit::gpu::{on_each_adapter, on_each_adapter_with};

use super::bodies::{at_rest, drag_some, materials};
use super::result;

/// The work of the device during a call.
fn during(gpu: &Gpu, work: impl FnOnce()) -> Counters {
    let before = gpu.counters();
    work();
    let after = gpu.counters();
    Counters {
        kernels: after.kernels - before.kernels,
        buffers: after.buffers - before.buffers,
        submits: after.submits - before.submits,
        dispatches: after.dispatches - before.dispatches,
        writes: after.writes - before.writes,
        readbacks: after.readbacks - before.readbacks,
        readback_bytes: after.readback_bytes - before.readback_bytes,
        ..after
    }
}

/// A bar that relaxes slowly.
fn bar() -> Chain {
    let soft = Material::isotropic(0.5, 2.0, 1.0, 0.0);
    let mut bar = Chain::new([60, 3, 5], [1.0; 3], &[soft], vec![0; 900]).unwrap();
    let to = bar.position(59).map(|at| at + 9.0);
    bar.drag(&[Drag { element: 59, to }], Order::Fifo).unwrap();
    bar
}

#[test]
fn many_sweeps_are_one_submit_and_one_readback() {
    on_each_adapter(|gpu| {
        let mut bar = bar();
        let mut device = RelaxGpu::new(gpu, &bar).unwrap();
        let first = during(gpu, || assert_eq!(device.relax(&mut bar, 64, &[]).unwrap().sweeps, 64));
        assert_eq!((first.submits, first.readbacks), (1, 1 + 3), "counts, then three coordinates");
        assert_eq!(first.readback_bytes, 4 * (64 * 64 + 3 * 900));
        assert_eq!((first.kernels, first.buffers, first.dispatches), (0, 0, 6 * 64));

        let same = during(gpu, || assert_eq!(device.relax(&mut bar, 3, &[]).unwrap().sweeps, 3));
        assert_eq!((same.writes, same.dispatches), (3 + 1, 6 * 3), "only positions and counts are written");
        let held = during(gpu, || assert!(device.relax(&mut bar, 3, &[0]).unwrap().moves > 0));
        assert_eq!(held.writes, 3 + 1 + 1, "and a plane with a held element");
        bar.cut(|_, a, b| (a, b) == (180, 360));
        let cut = during(gpu, || assert!(device.relax(&mut bar, 3, &[0]).unwrap().moves > 0));
        assert_eq!(cut.writes, 3 + 1 + 2, "and two planes between which a link was cut");

        let none = during(gpu, || assert_eq!(device.relax(&mut bar, 0, &[]).unwrap().sweeps, 0));
        assert_eq!((none.writes, none.submits, none.readbacks), (0, 0, 0));
        let settled = device.relax(&mut bar, 20_000, &[]).unwrap();
        assert!(settled.settled && settled.sweeps > 64, "{settled:?}");
        let still = during(gpu, || assert_eq!(device.relax(&mut bar, 9, &[]).unwrap().sweeps, 1));
        assert_eq!(still.readbacks, 1, "positions are not read if nothing moved");
    });
}

#[test]
fn bytes_are_nearly_the_allocated_memory() {
    on_each_adapter_with(&GpuOptions { chunk_cap: Some(5000), ..GpuOptions::default() }, |gpu| {
        let chain = at_rest([50, 40, 9], 1);
        let before = gpu.counters().buffer_bytes;
        let device = RelaxGpu::new(gpu, &chain).unwrap();
        assert_eq!(device.slabs(), 5);
        let more = gpu.counters().buffer_bytes - before;
        assert!((device.bytes()..device.bytes() + 1000).contains(&more), "{} {more}", device.bytes());
        assert!(device.bytes() > 14 * chain.places() as u64);
    });
}

#[test]
fn another_shape_or_number_of_materials_is_refused() {
    on_each_adapter(|gpu| {
        let chain = at_rest([4, 3, 2], 5);
        let mut device = RelaxGpu::new(gpu, &chain).unwrap();
        let mut turned = at_rest([3, 4, 2], 5);
        let found = device.relax(&mut turned, 1, &[]).unwrap_err();
        let message = found.to_string();
        assert!(message.contains("[4, 3, 2]") && message.contains("[3, 4, 2]"), "{message}");
        let mut fewer = Chain::new([4, 3, 2], [1.0; 3], &materials()[..2], vec![0; 24]).unwrap();
        let found = device.relax(&mut fewer, 0, &[]).unwrap_err();
        assert!(matches!(found, ChainError::OtherChain { materials: 2, of_materials: 4, .. }), "{found}");
    });
}

#[test]
fn a_lost_device_is_an_error_and_leaves_the_chain_unchanged() {
    on_each_adapter(|gpu| {
        let mut chain = at_rest([9, 8, 7], 6);
        let held = drag_some(&mut chain, 7);
        let (before, mut expected) = (result(&chain, Default::default()), chain.clone());
        let mut device = RelaxGpu::new(gpu, &chain).unwrap();
        gpu.lose();
        let found = device.relax(&mut chain, 10, &held).unwrap_err();
        assert!(matches!(found, ChainError::Gpu(GpuError::Lost { .. })), "{found}");
        assert_eq!(result(&chain, Default::default()), before);
        // The elements that were held are free again.
        let (found, wanted) = (chain.relax(50, &[]), expected.relax(50, &[]));
        assert_eq!(result(&chain, found), result(&expected, wanted));
        let found = RelaxGpu::new(gpu, &chain).err().unwrap();
        assert!(matches!(found, ChainError::Gpu(GpuError::Lost { .. })), "{found}");
    });
}
