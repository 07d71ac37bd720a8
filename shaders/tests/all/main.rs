//! Every joined source is valid WGSL within WebGPU's baseline.

mod chainmail;
mod coloring;
mod render;
mod resample;
mod rest;
mod solver;

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Module, TypeInner};

/// Number of storage buffers that every device supports in a kernel.
const MAX_STORAGE_BUFFERS: usize = 8;

/// Parses and validates a source, and returns the module or the error message.
fn validated(source: &str) -> Result<(Module, ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let info = validator.validate(&module).map_err(|error| error.emit_to_string(source))?;
    Ok((module, info))
}

/// Checks that a source is valid and has exactly these entry points, each with 64 threads and
/// within the baseline's number of buffers.
fn assert_baseline(what: &str, source: &str, entries: &[&str]) {
    let (module, info) = validated(source).unwrap_or_else(|message| panic!("{what}: {message}"));
    let found: Vec<&str> = module.entry_points.iter().map(|entry| entry.name.as_str()).collect();
    assert_eq!(found, entries, "{what}");
    for (index, entry) in module.entry_points.iter().enumerate() {
        assert_eq!(entry.workgroup_size, [64, 1, 1], "{what}");
        let used = info.get_entry_point(index);
        let buffers = module.global_variables.iter().filter(|(handle, variable)| {
            !used[*handle].is_empty() && matches!(variable.space, AddressSpace::Storage { .. })
        });
        let count = buffers.count();
        assert!(count <= MAX_STORAGE_BUFFERS, "{what}, {}: {count} storage buffers", entry.name);
    }
}

/// Returns the size of the struct `name` in bytes.
fn size_of_struct(source: &str, name: &str) -> u32 {
    let (module, _) = validated(source).unwrap_or_else(|message| panic!("{name}: {message}"));
    let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name));
    match found.map(|(_, t)| &t.inner) {
        Some(TypeInner::Struct { span, .. }) => *span,
        _ => panic!("there is no struct {name}"),
    }
}

/// Control: an undefined name and a ninth buffer are errors.
#[test]
fn invalid_sources_are_rejected() {
    assert!(validated("fn f() -> f32 { return x; }").is_err());
    let buffers: String =
        (0..9).map(|n| format!("@group(0) @binding({n}) var<storage, read_write> b{n}: f32;")).collect();
    let uses: String = (0..9).map(|n| format!("b{n} = 0.0;")).collect();
    let source = format!("{buffers} @compute @workgroup_size(64) fn f() {{ {uses} }}");
    let outcome = std::panic::catch_unwind(|| assert_baseline("nine buffers", &source, &["f"]));
    assert!(outcome.is_err());
}
