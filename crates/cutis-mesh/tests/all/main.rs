//! Tests of lattices, meshes, skins, incisions and mesh files, against brute force and known
//! results.

mod files;
mod flaps;
mod graded;
mod growth;
mod incision;
mod lattice;
mod lip_pairs;
mod lips;
mod moved;
mod oracle;
mod real_data;
mod region;
mod sever;
mod shell;
mod skin;
mod stitches;
mod surface_files;
