//! Failures are typed errors, and the device continues to work.

use cutis_gpu::{Gpu, GpuError, GpuOptions, Select, adapters};
use cutis_test_kit::gpu::{on_each_adapter, on_each_adapter_with};

use crate::{DOUBLE, doubled};

/// Returns the message of an invalid kernel.
fn shader_error(gpu: &Gpu, wgsl: &str) -> String {
    match gpu.kernel("label", wgsl, "main") {
        Err(GpuError::Shader { label, message }) => {
            assert_eq!(label, "label");
            message
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn invalid_wgsl_returns_the_compilers_message() {
    on_each_adapter(|gpu| {
        let syntax = shader_error(gpu, "@compute @workgroup_size(64)\nfn main() { let x = ; }");
        assert!(syntax.contains("expected expression") && syntax.contains("wgsl:2:"), "{syntax}");
        let types = shader_error(gpu, "@compute @workgroup_size(64)\nfn main() { let x: u32 = 1.5; }");
        assert!(types.contains("u32"), "{types}");
        let entry = shader_error(gpu, DOUBLE);
        assert_eq!(entry, "no entry point 'main'; expected one of: double");
        let width = shader_error(gpu, "@compute @workgroup_size(32)\nfn main() {}");
        assert!(width.contains("32 x 1 x 1") && width.contains("@workgroup_size(64)"), "{width}");
        let stage = shader_error(gpu, "@fragment\nfn main() {}");
        assert!(stage.contains("must be @compute"), "{stage}");
        let clash = shader_error(
            gpu,
            "@group(0) @binding(0) var<storage, read_write> a: array<f32>;
             @group(0) @binding(0) var<storage, read_write> b: array<f32>;
             @compute @workgroup_size(64) fn main() { a[0] = b[0]; }",
        );
        assert!(clash.contains("binding") || clash.contains("Binding"), "{clash}");
        assert_eq!(gpu.counters().kernels, 0);
        assert_eq!(doubled(gpu, &[4.0]), [8.0], "the device still works");
    });
}

#[test]
fn the_baseline_rejects_a_kernel_with_nine_storage_buffers() {
    let source = |count: usize| {
        let declare = |i| format!("@group(0) @binding({i}) var<storage, read_write> b{i}: array<f32>;");
        let declared: String = (0..count).map(declare).collect();
        let used: String = (0..count).map(|i| format!("b{i}[0] = 1.0;")).collect();
        format!("{declared} @compute @workgroup_size(64) fn main() {{ {used} }}")
    };
    on_each_adapter_with(&GpuOptions { baseline_limits: true, ..GpuOptions::default() }, |gpu| {
        assert!(gpu.kernel("eight", &source(8), "main").is_ok());
        let message = shader_error(gpu, &source(9));
        assert!(message.contains("StorageBuffers") || message.contains("storage"), "{message}");
    });
}

#[test]
fn bindings_of_another_kernel_are_rejected() {
    on_each_adapter(|gpu| {
        let values = gpu.buffer("values", &[1.0_f32; 256]).unwrap();
        let params = gpu.uniform("params", &1_u32).unwrap();
        let volume = gpu.texture_3d("volume", [1, 1, 1], &[0]).unwrap();
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let assert_rejected = |group, bindings: &[_]| match gpu.bind(&kernel, group, bindings) {
            Err(GpuError::Validation { what, message }) => {
                assert!(what.contains("kernel 'double'"), "{what}");
                assert!(!message.is_empty() && !message.starts_with("Validation Error"), "{message}");
            }
            other => panic!("{other:?}"),
        };
        assert_rejected(0, &[(1, values.whole())]);
        assert_rejected(0, &[]);
        assert_rejected(0, &[(0, values.whole()), (1, values.whole())]);
        assert_rejected(0, &[(0, params.whole())]);
        assert_rejected(0, &[(0, volume.whole())]);
        assert_rejected(1, &[(0, values.whole())]);
        assert_rejected(u32::MAX, &[]);
        let misplaced = gpu.bind(&kernel, 0, &[(0, values.range(1..2))]);
        assert!(matches!(misplaced, Err(GpuError::Alignment { offset: 4, multiple: 256, .. })));
        assert!(gpu.bind(&kernel, 0, &[(0, values.whole())]).is_ok());
    });
}

#[test]
fn a_binding_beyond_the_limit_is_rejected() {
    on_each_adapter_with(&GpuOptions { baseline_limits: true, ..GpuOptions::default() }, |gpu| {
        let large = gpu.zeroed::<u32>("large", (128 << 20) / 4 + 1).unwrap();
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let bound = gpu.bind(&kernel, 0, &[(0, large.whole())]);
        assert!(matches!(bound, Err(GpuError::Limit { available: 0x800_0000, .. })), "{bound:?}");
        assert!(gpu.bind(&kernel, 0, &[(0, large.range(0..(128 << 20) / 4))]).is_ok());
    });
}

#[test]
fn an_invalid_pass_is_rejected_and_nothing_runs() {
    on_each_adapter(|gpu| {
        let values = gpu.buffer("values", &[1.0_f32; 4]).unwrap();
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let group = gpu.bind(&kernel, 0, &[(0, values.whole())]).unwrap();
        let assert_rejected = |pass: cutis_gpu::Pass<'_>| match pass.submit() {
            Err(GpuError::Validation { what, .. }) => assert!(what.contains("pass 'wrong'"), "{what}"),
            other => panic!("{other:?}"),
        };
        let mut pass = gpu.pass("wrong");
        pass.dispatch(&kernel, &[&group], 4);
        pass.dispatch(&kernel, &[], 4);
        pass.copy(&values, 0..1, &values, 2);
        assert_rejected(pass);

        let twin = gpu.kernel("twin", DOUBLE, "double").unwrap();
        let mut pass = gpu.pass("wrong");
        pass.dispatch(&twin, &[&group], 4); // a bind group of another kernel
        assert_rejected(pass);

        let mut pass = gpu.pass("wrong");
        pass.copy(&values, 0..1, &values, 2); // within one buffer
        assert_rejected(pass);

        assert_eq!(gpu.counters().submits, 0);
        assert_eq!(gpu.read(&values, 0..4).unwrap(), [1.0; 4]);
        assert_eq!(doubled(gpu, &[4.0]), [8.0], "the device still works");
    });
}

#[test]
fn resources_of_another_device_are_rejected() {
    on_each_adapter(|gpu| {
        let options = GpuOptions { select: Select::Index(gpu.adapter().index), ..GpuOptions::default() };
        let other = Gpu::open(&options).unwrap();
        let foreign = other.buffer("foreign", &[1.0_f32; 4]).unwrap();
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let foreign_kernel = other.kernel("double", DOUBLE, "double").unwrap();
        let foreign_group = other.bind(&foreign_kernel, 0, &[(0, foreign.whole())]).unwrap();
        assert!(matches!(gpu.read(&foreign, 0..4), Err(GpuError::Validation { .. })));
        assert!(matches!(gpu.write(&foreign, 0, &[0.0]), Err(GpuError::Validation { .. })));
        assert!(matches!(gpu.bind(&kernel, 0, &[(0, foreign.whole())]), Err(GpuError::Validation { .. })));
        let mut pass = gpu.pass("foreign");
        pass.dispatch(&foreign_kernel, &[&foreign_group], 4);
        assert!(matches!(pass.submit(), Err(GpuError::Validation { .. })));
        assert_eq!(other.read(&foreign, 0..4).unwrap(), [1.0; 4]);
        assert_eq!(doubled(gpu, &[4.0]), [8.0]);
    });
}

#[test]
fn a_uniform_is_not_read_and_not_larger_than_it_may_be() {
    on_each_adapter(|gpu| {
        let params = gpu.uniform("params", &[1_u32, 2]).unwrap();
        gpu.write(&params, 0, &[[3, 4]]).unwrap();
        assert!(matches!(gpu.read(&params, 0..1), Err(GpuError::Validation { .. })));
        assert_eq!(doubled(gpu, &[4.0]), [8.0], "the next read works");
    });
    on_each_adapter_with(&GpuOptions { baseline_limits: true, ..GpuOptions::default() }, |gpu| {
        assert!(gpu.uniform("fits", &[0_u8; 65_536]).is_ok());
        assert!(matches!(
            gpu.uniform("large", &[[0_u8; 65_536]; 2]),
            Err(GpuError::Limit { available: 65_536, .. })
        ));
    });
}

#[test]
fn every_call_reports_a_lost_device() {
    let timed = GpuOptions { timestamps: true, ..GpuOptions::default() };
    on_each_adapter_with(&timed, |gpu| {
        let lost = |error: GpuError| match error {
            GpuError::Lost { adapter, reason } => {
                assert_eq!(adapter, gpu.adapter().name);
                assert!(!reason.is_empty());
            }
            other => panic!("{other:?}"),
        };
        let values = gpu.buffer("values", &[1.0_f32; 4]).unwrap();
        let volume = gpu.texture_3d("volume", [1, 1, 1], &[0]).unwrap();
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let group = gpu.bind(&kernel, 0, &[(0, values.whole())]).unwrap();
        let mut begun = gpu.pass("begun before");
        begun.dispatch(&kernel, &[&group], 4);
        let in_flight = doubled(gpu, &[1.0]);
        assert_eq!(in_flight, [2.0]);

        gpu.lose();
        gpu.lose(); // a second call has no effect
        begun.dispatch(&kernel, &[&group], 4);
        begun.copy(&values, 0..1, &values, 1);
        lost(begun.submit().unwrap_err());
        let mut pass = gpu.pass("begun after");
        pass.dispatch(&kernel, &[&group], 4);
        lost(pass.submit().unwrap_err());
        lost(gpu.pass("empty").submit().unwrap_err());
        lost(gpu.buffer("b", &[1]).unwrap_err());
        lost(gpu.buffer::<u32>("b", &[]).unwrap_err());
        lost(gpu.zeroed::<u32>("b", usize::MAX).unwrap_err());
        lost(gpu.uniform("u", &1).unwrap_err());
        lost(gpu.texture_3d("t", [1, 1, 1], &[0]).unwrap_err());
        lost(gpu.write(&values, 0, &[1.0]).unwrap_err());
        lost(gpu.write(&values, 0, &[]).unwrap_err());
        lost(gpu.read(&values, 0..4).unwrap_err());
        lost(gpu.read(&values, 0..0).unwrap_err());
        lost(gpu.kernel("k", DOUBLE, "double").unwrap_err());
        lost(gpu.kernel("k", "nonsense", "double").unwrap_err());
        lost(gpu.bind(&kernel, 0, &[(0, values.whole())]).unwrap_err());
        lost(gpu.bind(&kernel, 0, &[(0, volume.whole())]).unwrap_err());
        lost(gpu.last_pass_ns().unwrap_err());
        lost(gpu.wait().unwrap_err());
        assert_eq!(values.len(), 4);
        drop((values, volume, kernel, group));
        assert_eq!(gpu.counters().buffer_bytes, 0);
    });
}

#[test]
fn a_device_may_be_lost_while_other_threads_use_it() {
    on_each_adapter(|gpu| {
        let values = gpu.buffer("values", &vec![1.0_f32; 1 << 20]).unwrap();
        let (sender, receiver) = std::sync::mpsc::channel();
        std::thread::scope(|scope| {
            for _ in 0..3 {
                let (gpu, values, sender) = (gpu.clone(), &values, sender.clone());
                scope.spawn(move || {
                    let error = loop {
                        match gpu.read(values, 0..values.len()) {
                            Ok(read) => assert!(read.iter().all(|&value| value == 1.0)),
                            Err(error) => break error,
                        }
                        let _ = sender.send(());
                        if let Err(error) = gpu.write(values, 0, &[1.0]) {
                            break error;
                        }
                    };
                    assert!(matches!(error, GpuError::Lost { .. }), "{error}");
                });
            }
            receiver.iter().take(10).for_each(drop); // all threads have started
            gpu.lose();
        });
    });
}

#[test]
fn a_new_device_works_after_the_loss_of_another() {
    on_each_adapter(|gpu| {
        gpu.lose();
        let options = GpuOptions { select: Select::Index(gpu.adapter().index), ..GpuOptions::default() };
        assert_eq!(doubled(&Gpu::open(&options).unwrap(), &[4.0]), [8.0]);
    });
}

#[test]
fn adapters_are_listed_once_in_order_and_open_by_name() {
    let all = adapters();
    assert_eq!(all, adapters(), "the order is stable");
    for (index, adapter) in all.iter().enumerate() {
        assert_eq!(adapter.index, index);
        let part = adapter.name.to_uppercase();
        let gpu = Gpu::open(&GpuOptions { select: Select::Name(part), ..GpuOptions::default() }).unwrap();
        assert_eq!(gpu.adapter().name, adapter.name);
        assert_eq!(gpu.limits(), &gpu.adapter().limits);
        assert!(!adapter.driver.is_empty() && !adapter.api.is_empty());
    }
    assert!(all.windows(2).all(|pair| pair[0].kind <= pair[1].kind), "{all:?}");
    if !all.is_empty() {
        let absent =
            Gpu::open(&GpuOptions { select: "no such card".parse().unwrap(), ..GpuOptions::default() });
        match absent {
            Err(GpuError::NoSuchAdapter { asked, found }) => {
                assert_eq!((asked.as_str(), found.len()), ("no such card", all.len()));
            }
            other => panic!("{other:?}"),
        }
    }
}

/// Runs this test again in a child process without a driver.
#[cfg(target_os = "linux")]
#[test]
fn without_a_driver_the_message_says_what_to_install() {
    const CHILD: &str = "CUTIS_GPU_TEST_WITHOUT_DRIVER";
    if std::env::var_os(CHILD).is_some() {
        assert_eq!(adapters(), []);
        let error = Gpu::open(&GpuOptions::default()).unwrap_err();
        assert_eq!(error, GpuError::NoAdapter);
        assert!(error.to_string().contains("apt-get install mesa-vulkan-drivers libvulkan1"), "{error}");
        return;
    }
    let child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "errors::without_a_driver_the_message_says_what_to_install"])
        .env(CHILD, "1")
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .output()
        .unwrap();
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stdout));
}
