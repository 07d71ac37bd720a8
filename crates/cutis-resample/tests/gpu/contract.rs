//! What the CPU's tests hold, held by the GPU.
