//! Integration tests of the CPU backend. The test of allocations has its own binary, because it
//! replaces the global allocator of the process.

mod parity;
