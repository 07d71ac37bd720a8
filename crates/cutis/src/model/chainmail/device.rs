//! Relaxation of a chain on a GPU.

use cutis_chainmail::Chain;
#[cfg(feature = "gpu")]
use cutis_chainmail::ChainError;
#[cfg(feature = "gpu")]
pub(super) use cutis_chainmail::RelaxGpu as Relaxer;
#[cfg(not(feature = "gpu"))]
use cutis_chainmail::{ChainError, Relaxation};

use crate::Error;
use crate::backend::{Chosen, DeviceMeter, Gpu};
use crate::output::report::MemoryPart;

/// Opens the GPU, if the backend is one, and reserves memory for the chain.
///
/// # Errors
/// The errors of the GPU.
pub(super) fn start(backend: &Chosen, chain: &Chain) -> Result<Option<(Relaxer, DeviceMeter)>, Error> {
    let Some(device) = backend.open()? else { return Ok(None) };
    let relaxer = start_on(device.gpu(), chain)?;
    Ok(Some((relaxer, device)))
}

/// Memory that a chain takes on the GPU, by part; none on a CPU backend.
pub(super) fn memory(backend: &Chosen, chain: &Chain) -> Vec<MemoryPart> {
    if backend.on_gpu() { memory_on_gpu(chain) } else { Vec::new() }
}

#[cfg(feature = "gpu")]
fn start_on(gpu: &Gpu, chain: &Chain) -> Result<Relaxer, Error> {
    Relaxer::new(gpu, chain).map_err(|error| match error {
        ChainError::Gpu(error) => Error::Gpu(error),
        other => Error::Chain(other),
    })
}

#[cfg(feature = "gpu")]
fn memory_on_gpu(chain: &Chain) -> Vec<MemoryPart> {
    vec![MemoryPart { part: "relaxation".into(), bytes: Relaxer::BYTES_PER_PLACE * chain.places() }]
}

/// Relaxation on a GPU, in a build without GPU support. No value of this type exists.
#[cfg(not(feature = "gpu"))]
pub(super) enum Relaxer {}

#[cfg(not(feature = "gpu"))]
impl Relaxer {
    pub(super) fn relax(&mut self, _: &mut Chain, _: u32, _: &[u32]) -> Result<Relaxation, ChainError> {
        match *self {}
    }
}

#[cfg(not(feature = "gpu"))]
fn start_on(gpu: &Gpu, _: &Chain) -> Result<Relaxer, Error> {
    match *gpu {}
}

#[cfg(not(feature = "gpu"))]
fn memory_on_gpu(_: &Chain) -> Vec<MemoryPart> {
    Vec::new()
}
