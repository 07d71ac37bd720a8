//! Materials by HU and by depth below the skin: the row of each vertex, the moduli of elements, and
//! a bar of two layers with a known answer.

mod assignment;
mod bar;
mod refused;
mod region;
mod table;
