//! An opened device: options, limits, error capture and loss.

use std::{
    fmt,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
};

use crate::{
    Adapter, Counters, GpuError, Limits, Select, WORKGROUP,
    adapter::choose,
    counters::Tally,
    limits::{Shortfall, requested},
    readback::Staging,
    timing::Timing,
};

/// How to open a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// Which adapter.
    pub select: Select,
    /// Ask for exactly WebGPU's default limits, however much more the adapter offers.
    pub baseline_limits: bool,
    /// At most so many items per chunk (see [`Gpu::chunk_len`]), so that tests can force the splitting of small data.
    pub chunk_cap: Option<usize>,
    /// Time each pass, where the adapter can.
    pub timestamps: bool,
}

/// A handle to an opened device. Clones share the device; the last one to go closes it.
#[derive(Clone)]
pub struct Gpu {
    pub(crate) shared: Arc<Shared>,
}

/// What the handles of one device share.
pub(crate) struct Shared {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) adapter: Adapter,
    pub(crate) limits: Limits,
    pub(crate) max_uniform_bytes: u64,
    chunk_cap: Option<usize>,
    lost: Arc<OnceLock<String>>,
    stray: Arc<Mutex<Option<String>>>,
    pub(crate) tally: Arc<Tally>,
    pub(crate) staging: Mutex<Staging>,
    pub(crate) timing: Option<Timing>,
}

/// What wgpu complained of.
pub(crate) enum Fault {
    /// A rule was broken; the message says which.
    Invalid(String),
    /// No memory left.
    Memory,
}

impl Gpu {
    /// Opens a device.
    ///
    /// # Errors
    ///
    /// [`GpuError::NoAdapter`] when the machine has none (the message says what to install),
    /// [`GpuError::NoSuchAdapter`] when the one asked for is not there (it lists what is), [`GpuError::Limit`] when the
    /// adapter does not reach WebGPU's baseline, [`GpuError::Device`] when the driver refuses.
    pub fn open(options: &GpuOptions) -> Result<Gpu, GpuError> {
        let (adapter, handle) = choose(&options.select)?;
        let limits = requested(&handle.limits(), options.baseline_limits).map_err(
            |Shortfall { name, needed, available }| GpuError::Limit {
                what: format!("WebGPU's baseline limit {name}"),
                needed,
                available,
                adapter: adapter.name.clone(),
            },
        )?;
        let timed = options.timestamps && adapter.timestamps;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("cutis"),
            required_features: if timed { wgpu::Features::TIMESTAMP_QUERY } else { wgpu::Features::empty() },
            required_limits: limits.clone(),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(handle.request_device(&descriptor))
            .map_err(|error| GpuError::Device { adapter: adapter.name.clone(), reason: error.to_string() })?;

        let lost = Arc::new(OnceLock::new());
        let told = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, message| {
            let _ = told.set(if message.is_empty() { format!("{reason:?}") } else { message });
        });
        let stray = Arc::new(Mutex::new(None));
        let kept = Arc::clone(&stray);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            lock(&kept).get_or_insert_with(|| readable(&error));
        }));

        let timing = timed.then(|| Timing::new(&device, &queue));
        let gpu = Gpu {
            shared: Arc::new(Shared {
                device,
                queue,
                adapter,
                limits: Limits::of(&limits),
                max_uniform_bytes: limits.max_uniform_buffer_binding_size,
                chunk_cap: options.chunk_cap,
                lost,
                stray,
                tally: Arc::default(),
                staging: Mutex::default(),
                timing,
            }),
        };
        gpu.alive()?;
        Ok(gpu)
    }

    /// The adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.shared.adapter
    }

    /// The limits of the opened device.
    pub fn limits(&self) -> &Limits {
        &self.shared.limits
    }

    /// The largest number of items of `bytes` bytes each that one buffer, one binding and one dispatch of a thread per
    /// item can take; no more than the cap of the options. At least 1: an item too large for the device is refused
    /// with [`GpuError::Limit`] where its buffer is made.
    pub fn chunk_len(&self, bytes: usize) -> usize {
        let Shared { limits, chunk_cap, .. } = &*self.shared;
        let threads = u64::from(limits.max_workgroups) * WORKGROUP as u64;
        let room = limits.max_binding_bytes.min(limits.max_buffer_bytes);
        let fits = threads.min(room.checked_div(bytes as u64).unwrap_or(u64::MAX));
        usize::try_from(fits).unwrap_or(usize::MAX).min(chunk_cap.unwrap_or(usize::MAX)).max(1)
    }

    /// The largest number of items of `bytes` bytes each that one buffer and one binding can take, whatever the number of threads
    /// that read them; no more than the cap of the options, and at least 1.
    pub fn binding_len(&self, bytes: usize) -> usize {
        let Shared { limits, chunk_cap, .. } = &*self.shared;
        let room = limits.max_binding_bytes.min(limits.max_buffer_bytes);
        let fits = room.checked_div(bytes as u64).unwrap_or(u64::MAX);
        usize::try_from(fits).unwrap_or(usize::MAX).min(chunk_cap.unwrap_or(usize::MAX)).max(1)
    }

    /// What was done with this device since it was opened.
    pub fn counters(&self) -> Counters {
        self.shared.tally.snapshot()
    }

    /// Waits until all that was submitted is done, without reading anything: for timing work from the host.
    ///
    /// # Errors
    ///
    /// [`GpuError::Lost`]; [`GpuError::Wait`] when the driver cannot wait.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.flush(&|| "waiting for the device".to_owned())
    }

    /// Destroys the device, as a reset of the driver would: every later call returns [`GpuError::Lost`]. For tests of
    /// what becomes of a program whose GPU goes away.
    pub fn lose(&self) {
        // Held so that no other thread has memory of the device mapped while it goes.
        let _staging = lock(&self.shared.staging);
        let _ = self.shared.lost.set("it was destroyed on request".to_owned());
        self.shared.device.destroy();
        let _ = self.poll(wgpu::PollType::Poll);
    }

    /// [`GpuError::Lost`] once the device is gone.
    pub(crate) fn alive(&self) -> Result<(), GpuError> {
        match self.shared.lost.get() {
            None => Ok(()),
            Some(reason) => {
                Err(GpuError::Lost { adapter: self.shared.adapter.name.clone(), reason: reason.clone() })
            }
        }
    }

    /// Runs `work` and turns what wgpu complains of meanwhile into an error. A device that was lost before or
    /// meanwhile comes first; a complaint of an earlier call that nobody heard comes last.
    pub(crate) fn checked<R>(
        &self,
        explain: impl FnOnce(Fault) -> GpuError,
        work: impl FnOnce() -> R,
    ) -> Result<R, GpuError> {
        self.alive()?;
        let device = &self.shared.device;
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
        let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let result = work();
        let invalid = pollster::block_on(validation.pop());
        let failed = pollster::block_on(internal.pop());
        let starved = pollster::block_on(memory.pop());
        self.alive()?;
        if starved.is_some() {
            return Err(explain(Fault::Memory));
        }
        if let Some(error) = invalid.or(failed) {
            return Err(explain(Fault::Invalid(readable(&error))));
        }
        match lock(&self.shared.stray).take() {
            Some(message) => Err(GpuError::Validation { what: "an earlier call".to_owned(), message }),
            None => Ok(result),
        }
    }

    /// Lets wgpu wait for the device. wgpu panics when the device is lost while it waits; here that is an error.
    pub(crate) fn poll(&self, until: wgpu::PollType) -> Result<(), GpuError> {
        let polled = catch_unwind(AssertUnwindSafe(|| self.shared.device.poll(until)));
        self.alive()?;
        let reason = match polled {
            Ok(Ok(_)) => return Ok(()),
            Ok(Err(error)) => error.to_string(),
            Err(_) => "the wait failed".to_owned(),
        };
        Err(GpuError::Wait { adapter: self.shared.adapter.name.clone(), reason })
    }

    /// An error for a need that the device cannot meet.
    pub(crate) fn over_limit(&self, what: String, needed: u64, available: u64) -> GpuError {
        GpuError::Limit { what, needed, available, adapter: self.shared.adapter.name.clone() }
    }
}

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Gpu")
            .field("adapter", &self.shared.adapter)
            .field("limits", &self.shared.limits)
            .finish_non_exhaustive()
    }
}

impl Fault {
    /// The error for `what`, which asked for `bytes` bytes of memory.
    pub(crate) fn of(self, what: String, bytes: u64) -> GpuError {
        match self {
            Fault::Invalid(message) => GpuError::Validation { what, message },
            Fault::Memory => GpuError::OutOfMemory { what, bytes },
        }
    }
}

/// Locks; a thread that panicked while it held the lock left nothing half done that matters here.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// wgpu's message without its heading.
fn readable(error: &wgpu::Error) -> String {
    let text = error.to_string();
    text.strip_prefix("Validation Error\n\nCaused by:\n").unwrap_or(&text).trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first_gpu() -> Option<Gpu> {
        match Gpu::open(&GpuOptions::default()) {
            Ok(gpu) => Some(gpu),
            Err(error) => {
                let required =
                    ["CI", "CUTIS_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
                assert!(!required, "a GPU is required: {error}");
                eprintln!("skipped: {error}");
                None
            }
        }
    }

    #[test]
    fn a_wait_that_fails_is_not_a_device_that_cannot_be_opened() {
        let (Some(gpu), Some(other)) = (first_gpu(), first_gpu()) else { return };
        for _ in 0..8 {
            other.shared.queue.submit([]);
        }
        let foreign = other.shared.queue.submit([]);
        let until = |index| wgpu::PollType::Wait { submission_index: Some(index), timeout: None };
        assert_eq!(other.poll(until(foreign.clone())), Ok(()), "the control: on its own device");
        let error = gpu.poll(until(foreign)).unwrap_err();
        assert!(matches!(error, GpuError::Wait { .. }), "{error}");
        assert!(error.to_string().starts_with("waiting for the GPU '"), "{error}");
    }

    #[test]
    fn an_error_that_nobody_heard_is_told_by_the_next_call_and_once() {
        let Some(gpu) = first_gpu() else { return };
        let _ = gpu.shared.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("of no use"),
            size: 4,
            usage: wgpu::BufferUsages::empty(),
            mapped_at_creation: false,
        });
        match gpu.zeroed::<u32>("next", 1) {
            Err(GpuError::Validation { what, message }) => {
                assert_eq!(what, "an earlier call");
                assert!(message.contains("of no use"), "{message}");
            }
            other => panic!("{other:?}"),
        }
        assert!(gpu.zeroed::<u32>("after that", 1).is_ok());
    }
}
