//! The GPU backend against the reference solver, on every adapter of the machine.

mod body;
mod coloring;
mod device;
mod parity;
mod readbacks;
mod state;
