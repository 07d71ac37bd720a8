//! Every joined source of the resampler is valid WGSL within WebGPU's baseline, and uniforms have the size of the host's.

use cutis_shaders::resample;

/// Name, source and entry points.
fn sources() -> [(&'static str, String, Vec<&'static str>); 6] {
    let walks = || vec![resample::WALK_ALL, resample::WALK_LARGE];
    [
        ("place", resample::place(), vec![resample::PLACE]),
        ("span", resample::span(), vec![resample::SPAN, resample::SPAN_REMOVED]),
        ("clear", resample::clear(), vec![resample::CLEAR]),
        ("claim", resample::claim(), walks()),
        ("vacate", resample::vacate(), walks()),
        ("gather", resample::gather(), vec![resample::GATHER]),
    ]
}

fn validate(source: &str) -> Result<(naga::Module, naga::valid::ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let baseline = naga::valid::Capabilities::empty();
    let info = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), baseline)
        .validate(&module)
        .map_err(|error| error.emit_to_string(source))?;
    Ok((module, info))
}

#[test]
fn every_pass_is_valid_and_has_its_entry_points() {
    for (name, source, entries) in sources() {
        let (module, info) = validate(&source).unwrap_or_else(|message| panic!("{name}: {message}"));
        let found: Vec<_> = module.entry_points.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(found, entries, "{name}");
        for (index, entry) in module.entry_points.iter().enumerate() {
            assert_eq!(entry.workgroup_size, [64, 1, 1], "{name}");
            let used = info.get_entry_point(index);
            let buffers = module.global_variables.iter().filter(|(handle, variable)| {
                !used[*handle].is_empty() && matches!(variable.space, naga::AddressSpace::Storage { .. })
            });
            assert!(
                buffers.count() <= 8,
                "{name}, {}: more storage buffers than the baseline has",
                entry.name
            );
        }
    }
}

#[test]
fn uniforms_are_whole_blocks_of_sixteen_bytes() {
    let (module, _) = validate(&resample::claim()).unwrap();
    for (name, bytes) in [("Grid", 128), ("Slab", 32), ("Chunk", 16)] {
        let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap().1;
        let naga::TypeInner::Struct { span, .. } = found.inner else { panic!("{name}: not a struct") };
        assert_eq!(span, bytes, "{name}");
    }
}

/// The control: a source that does not validate is seen.
#[test]
fn invalid_sources_are_seen() {
    let broken = |source: String, from: &str, to: &str| {
        assert!(source.contains(from), "{from}");
        validate(&source.replace(from, to)).is_err()
    };
    assert!(broken(resample::claim(), "tet.rounding", "tet.roundings"));
    assert!(broken(resample::gather(), "texture_3d<i32>", "texture_2d<i32>"));
    assert!(broken(resample::span(), "vec2u(0u, left)", "vec3u(0u, left)"));
}
