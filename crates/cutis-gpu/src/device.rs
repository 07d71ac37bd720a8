//! An open device: options, limits, error handling and loss.

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

/// Options to open a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// The adapter to open.
    pub select: Select,
    /// Use exactly WebGPU's default limits, even if the adapter offers more.
    pub baseline_limits: bool,
    /// Upper bound of the items per chunk (see [`Gpu::chunk_len`]). With it, tests can split small
    /// data.
    pub chunk_cap: Option<usize>,
    /// Time each pass if the adapter supports it, see [`Gpu::last_pass_ns`].
    pub timestamps: bool,
}

/// A handle to an open device. Clones share the device, and dropping the last clone closes it.
#[derive(Clone)]
pub struct Gpu {
    pub(crate) shared: Arc<Shared>,
}

/// Data that all handles of one device share.
pub(crate) struct Shared {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) adapter: Adapter,
    pub(crate) limits: Limits,
    pub(crate) max_uniform_bytes: u64,
    chunk_cap: Option<usize>,
    /// The reason of a loss.
    lost: Arc<OnceLock<String>>,
    /// The first error that wgpu reported outside of a call.
    uncaptured: Arc<Mutex<Option<String>>>,
    pub(crate) tally: Arc<Tally>,
    pub(crate) staging: Mutex<Staging>,
    pub(crate) timing: Option<Timing>,
}

/// An error that wgpu reported.
pub(crate) enum Fault {
    /// A call violated a rule, which the message describes.
    Invalid(String),
    /// The device has no memory left.
    Memory,
}

impl Gpu {
    /// Opens a device.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::NoAdapter`] if the machine has no adapter (the message says what to
    /// install), [`GpuError::NoSuchAdapter`] if the selected one does not exist (the message lists
    /// the others), [`GpuError::Limit`] if the adapter does not reach WebGPU's baseline, and
    /// [`GpuError::Device`] if the driver cannot open a device.
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
        let reason_of_loss = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, message| {
            let _ = reason_of_loss.set(if message.is_empty() { format!("{reason:?}") } else { message });
        });
        let uncaptured = Arc::new(Mutex::new(None));
        let first = Arc::clone(&uncaptured);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            lock(&first).get_or_insert_with(|| message_of(&error));
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
                uncaptured,
                tally: Arc::default(),
                staging: Mutex::default(),
                timing,
            }),
        };
        gpu.alive()?;
        Ok(gpu)
    }

    /// Returns the adapter of the device.
    pub fn adapter(&self) -> &Adapter {
        &self.shared.adapter
    }

    /// Returns the limits of the device.
    pub fn limits(&self) -> &Limits {
        &self.shared.limits
    }

    /// Returns the largest number of items of `bytes` bytes each that fit one buffer, one binding
    /// and one dispatch with a thread per item. [`GpuOptions::chunk_cap`] limits the result. The
    /// result is at least 1. For an item that is too large for the device, the creation of its
    /// buffer returns [`GpuError::Limit`].
    pub fn chunk_len(&self, bytes: usize) -> usize {
        let threads = u64::from(self.limits().max_workgroups) * WORKGROUP as u64;
        self.binding_len(bytes).min(usize::try_from(threads).unwrap_or(usize::MAX))
    }

    /// Returns the largest number of items of `bytes` bytes each that fit one buffer and one
    /// binding, without a limit on the threads that read them. [`GpuOptions::chunk_cap`] limits the
    /// result. The result is at least 1.
    pub fn binding_len(&self, bytes: usize) -> usize {
        let Shared { limits, chunk_cap, .. } = &*self.shared;
        let most_bytes = limits.max_binding_bytes.min(limits.max_buffer_bytes);
        let fits = most_bytes.checked_div(bytes as u64).unwrap_or(u64::MAX);
        usize::try_from(fits).unwrap_or(usize::MAX).min(chunk_cap.unwrap_or(usize::MAX)).max(1)
    }

    /// Returns the counters of the work since the device was opened.
    pub fn counters(&self) -> Counters {
        self.shared.tally.snapshot()
    }

    /// Waits until all submitted work is done, without a readback. Use it, for example, to time
    /// work from the host.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::Lost`], or [`GpuError::Wait`] if the driver cannot wait.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.flush(&|| "waiting for the device".to_owned())
    }

    /// Destroys the device, with the same effect as a reset of the driver. Every later call returns
    /// [`GpuError::Lost`]. Use it to test how a program handles a lost GPU.
    pub fn lose(&self) {
        // The lock ensures that no other thread has memory of the device mapped.
        let _staging = lock(&self.shared.staging);
        let _ = self.shared.lost.set("it was destroyed on request".to_owned());
        self.shared.device.destroy();
        let _ = self.poll(wgpu::PollType::Poll);
    }

    /// Returns [`GpuError::Lost`] if the device was lost.
    pub(crate) fn alive(&self) -> Result<(), GpuError> {
        match self.shared.lost.get() {
            None => Ok(()),
            Some(reason) => {
                Err(GpuError::Lost { adapter: self.shared.adapter.name.clone(), reason: reason.clone() })
            }
        }
    }

    /// Runs `work` and returns the errors that wgpu reports meanwhile. The loss of the device has
    /// priority. An uncaptured error of an earlier call comes last.
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
            return Err(explain(Fault::Invalid(message_of(&error))));
        }
        match lock(&self.shared.uncaptured).take() {
            Some(message) => Err(GpuError::Validation { what: "an earlier call".to_owned(), message }),
            None => Ok(result),
        }
    }

    /// Waits for the device. wgpu panics if the device is lost during the wait. This function
    /// returns an error.
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

    /// Returns the error for a size beyond a limit of the device.
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
    /// Returns the error for `what`, which needed `bytes` bytes of memory.
    pub(crate) fn of(self, what: String, bytes: u64) -> GpuError {
        match self {
            Fault::Invalid(message) => GpuError::Validation { what, message },
            Fault::Memory => GpuError::OutOfMemory { what, bytes },
        }
    }
}

/// Locks the mutex, even if a thread panicked while it held the lock. The data stay valid in that
/// case.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns wgpu's message without its heading.
fn message_of(error: &wgpu::Error) -> String {
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
                assert!(!cutis_test_kit::gpu::required(), "this test needs a GPU: {error}");
                eprintln!("skipped: {error}");
                None
            }
        }
    }

    #[test]
    fn a_failed_wait_is_a_wait_error() {
        let (Some(gpu), Some(other)) = (first_gpu(), first_gpu()) else { return };
        for _ in 0..8 {
            other.shared.queue.submit([]);
        }
        let foreign = other.shared.queue.submit([]);
        let until = |index| wgpu::PollType::Wait { submission_index: Some(index), timeout: None };
        assert_eq!(other.poll(until(foreign.clone())), Ok(()), "control: a wait on its own device");
        let error = gpu.poll(until(foreign)).unwrap_err();
        assert!(matches!(error, GpuError::Wait { .. }), "{error}");
        assert!(error.to_string().starts_with("waiting for the GPU '"), "{error}");
    }

    #[test]
    fn the_next_call_reports_an_uncaptured_error_once() {
        let Some(gpu) = first_gpu() else { return };
        let _ = gpu.shared.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("without usage"),
            size: 4,
            usage: wgpu::BufferUsages::empty(),
            mapped_at_creation: false,
        });
        match gpu.zeroed::<u32>("next", 1) {
            Err(GpuError::Validation { what, message }) => {
                assert_eq!(what, "an earlier call");
                assert!(message.contains("without usage"), "{message}");
            }
            other => panic!("{other:?}"),
        }
        assert!(gpu.zeroed::<u32>("after that", 1).is_ok());
    }
}
