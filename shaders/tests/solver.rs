//! Every joined source of the solver is valid WGSL within WebGPU's baseline, and parameters have the stride of the host.

use cutis_shaders::constraints::{DISTANCE, SKIN_TENSION, SKIN_TENSION_PAPER, VOLUME};
use cutis_shaders::solver::{self, Multiplier, Rule, Stiffness};

/// Name, arity, number of parameters, source.
const KINDS: [(&str, usize, u32, &str); 4] = [
    ("distance", 2, 1, DISTANCE),
    ("volume", 4, 1, VOLUME),
    ("stc", 3, 2, SKIN_TENSION),
    ("stc_paper", 3, 3, SKIN_TENSION_PAPER),
];

fn module(source: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let baseline = naga::valid::Capabilities::empty();
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), baseline)
        .validate(&module)
        .map_err(|error| error.emit_to_string(source))?;
    Ok(module)
}

fn assert_valid(what: &str, source: &str) {
    if let Err(message) = module(source) {
        panic!("{what}: {message}");
    }
}

#[test]
fn every_variant_of_every_kind_is_valid() {
    for (name, arity, _, source) in KINDS {
        for rule in [Rule::Pbd, Rule::Xpbd] {
            for stiffness in [Stiffness::Uniform, Stiffness::Each] {
                for multiplier in [Multiplier::None, Multiplier::First, Multiplier::Next] {
                    let joined = solver::project(arity, source, rule, stiffness, multiplier);
                    assert_valid(&format!("{name} {rule:?} {stiffness:?} {multiplier:?}"), &joined);
                }
            }
        }
        assert_valid(name, &solver::residual(arity, source));
        assert_valid(name, &solver::evaluate(arity, source));
    }
    assert_valid("vertices", &solver::vertices());
    assert_valid("carry", &solver::carry());
    assert_valid("gather", &solver::gather());
}

#[test]
fn parameters_have_no_padding() {
    for (name, arity, count, source) in KINDS {
        let module = module(&solver::evaluate(arity, source)).unwrap();
        let params = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Params")).unwrap().1;
        let naga::TypeInner::Struct { span, .. } = params.inner else { panic!("{name}: not a struct") };
        assert_eq!(span, 4 * count, "{name}");
    }
}

/// The control: a source that does not validate is seen.
#[test]
fn invalid_sources_are_seen() {
    let broken = DISTANCE.replace("p.rest_length", "p.length");
    assert!(module(&solver::evaluate(2, &broken)).is_err());
    assert!(module(&solver::evaluate(3, VOLUME)).is_err(), "three vertices where four are read");
}
