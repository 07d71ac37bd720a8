//! Resampling on a GPU, compared with its twin bit for bit, with closed forms, and with the CPU.

mod contract;
mod device;
mod oracle;
mod parity;
mod real;
mod scenes;
