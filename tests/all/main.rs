//! All integration tests in one binary: the whole pipeline end to end, and problems with known
//! answers.

mod accuracy;
mod at_rest;
mod bad_scenes;
mod bad_values;
mod chainmail;
mod determinism;
mod gpu;
mod identity;
mod left_out;
mod materials;
mod outputs;
mod paper_form;
mod patch;
mod problems;
mod random_scenes;
mod region;
mod resume;
mod scene_files;
mod scenes;
mod sheet_tension;
mod skin_counts;
mod stability;
mod tune;
mod warnings;
mod wound;
