//! Studies: measurements, with one module for each page of `docs/results`. `cargo xtask study NAME`
//! runs one.
//!
//! The figures are for readers. Requirements that must hold after every change are tested in
//! `tests/`, which uses the problems of this crate.

pub mod accuracy;
pub mod at_rest;
pub mod cantilever;
pub mod chainmail;
pub mod closing;
pub mod inputs;
pub mod instructions;
pub mod kit;
pub mod main_job;
pub mod mutations;
pub mod parity;
pub mod patch;
pub mod peers;
pub mod pictures;
pub mod region;
pub mod rest;
pub mod sheet;
pub mod speed;
pub mod stability;
pub mod tuning;
pub mod wound;

#[cfg(test)]
mod tests {
    use crate::kit::Page;

    /// A study that cannot write its page at the end has measured in vain.
    #[test]
    fn every_page_has_the_tables_of_its_study() {
        for (name, tables) in [
            ("accuracy", &crate::accuracy::TABLES[..]),
            ("at-rest", &crate::at_rest::TABLES),
            ("cantilever", &crate::cantilever::TABLES),
            ("chainmail", &crate::chainmail::TABLES),
            ("closing", &crate::closing::TABLES),
            ("inputs", &crate::inputs::TABLES),
            ("main-job", &crate::main_job::TABLES),
            ("parity", &crate::parity::TABLES),
            (crate::patch::PAGE, &crate::patch::TABLES),
            ("peers", &crate::peers::TABLES),
            ("region", &crate::region::TABLES),
            ("rest", &crate::rest::TABLES),
            ("rest-front", &crate::rest::FRONT_TABLES),
            ("speed", &crate::speed::TABLES),
            ("stability", &crate::stability::TABLES),
            ("tuning", &crate::tuning::TABLES),
            ("wound", &crate::wound::TABLES),
        ] {
            Page::open(name, tables).unwrap();
        }
        Page::open("mutations", &crate::mutations::tables()).unwrap();
    }
}
