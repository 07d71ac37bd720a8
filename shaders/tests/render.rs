//! Every joined source of the ray marcher is valid WGSL within WebGPU's baseline, and its uniform has the size of the host's.

use cutis_shaders::render::{self, Albedo};

fn module(source: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let baseline = naga::valid::Capabilities::empty();
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), baseline)
        .validate(&module)
        .map_err(|error| error.emit_to_string(source))?;
    Ok(module)
}

fn entry_points(source: &str) -> Vec<(String, [u32; 3])> {
    let module = module(source).unwrap_or_else(|message| panic!("{message}"));
    module.entry_points.iter().map(|entry| (entry.name.clone(), entry.workgroup_size)).collect()
}

#[test]
fn every_source_is_valid_and_has_its_entry_point() {
    let expected = |name: &str| vec![(name.to_owned(), [64, 1, 1])];
    assert_eq!(entry_points(&render::largest_per_block()), expected(render::LARGEST_PER_BLOCK));
    for albedo in [Albedo::Skin, Albedo::Wound] {
        assert_eq!(entry_points(&render::raymarch(albedo)), expected(render::RAYMARCH), "{albedo:?}");
    }
}

#[test]
fn the_view_has_the_stated_size() {
    let module = module(&render::raymarch(Albedo::Skin)).unwrap();
    let view = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("View")).unwrap().1;
    let naga::TypeInner::Struct { span, .. } = view.inner else { panic!("not a struct") };
    assert_eq!(span as usize, render::VIEW_BYTES);
}

/// The control: a source that does not validate is seen.
#[test]
fn invalid_sources_are_seen() {
    let broken = render::raymarch(Albedo::Wound).replace("view.skin +", "view.skins +");
    assert!(module(&broken).is_err());
}
