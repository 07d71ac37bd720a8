//! Check: the shader is valid, and its parameters have the layout of the host.

use cutis_constraints::{Constraint, Params};
use cutis_shaders::solver::{self, Multiplier, Rule, Stiffness};
use naga::{Expression, MathFunction, Module, ScalarKind, TypeInner};

use crate::alteration::wrapped;
use crate::{Report, Subject};

/// Functions that give the bits of the CPU on a software device. All others round differently.
const EXACT: [MathFunction; 11] = [
    MathFunction::Abs,
    MathFunction::Min,
    MathFunction::Max,
    MathFunction::Clamp,
    MathFunction::Floor,
    MathFunction::Round,
    MathFunction::Sqrt,
    MathFunction::InverseSqrt,
    MathFunction::Dot,
    MathFunction::Cross,
    MathFunction::Length,
];

/// [`Constraint::WGSL`], joined with each pass of the solver, is valid within WebGPU's baseline.
/// `Params` has one `f32` member for each scalar of the host. No function is called that rounds
/// differently from the CPU. This check needs no device. Controls: a statement with an unknown
/// name, an extra parameter and a call of `normalize` must be noticed.
pub fn wgsl<C: Constraint<N>, const N: usize>(_: &Subject<C, N>) -> Report {
    let mut report = Report::new(C::NAME, "wgsl");
    let scalars = <C::Params<f32> as Params<f32>>::LEN;
    let faults = |wgsl: &str| Faults::of(N, wgsl, scalars);

    let found = faults(C::WGSL);
    report.at_most("invalid passes", found.invalid as f64, 0.0);
    report.at_most("faults of the parameters", found.parameters as f64, 0.0);
    report.at_most("functions that round differently from the CPU", found.inexact as f64, 0.0);
    report.notes = found.notes;

    let control = faults(&wrapped(C::WGSL, "found.c = nothing_of_this_name;"));
    report.control("an unknown name", control.invalid as f64, 0.0);
    let control = faults(&with_extra_parameter(C::WGSL));
    report.control("an extra parameter", (control.parameters + control.invalid) as f64, 0.0);
    let control = faults(&wrapped(C::WGSL, "found.grad[0] = normalize(found.grad[0]);"));
    report.control("normalize", control.inexact as f64, 0.0);
    report
}

/// Numbers of faults in the source of a constraint.
#[derive(Default)]
struct Faults {
    invalid: usize,
    parameters: usize,
    inexact: usize,
    notes: Vec<String>,
}

impl Faults {
    fn of(arity: usize, wgsl: &str, scalars: usize) -> Self {
        let mut faults = Self::default();
        for source in passes(arity, wgsl) {
            match valid_module(&source) {
                Ok(_) => {}
                Err(message) => {
                    faults.invalid += 1;
                    if !faults.notes.contains(&message) {
                        faults.notes.push(message);
                    }
                }
            }
        }
        if let Ok(module) = naga::front::wgsl::parse_str(&solver::evaluate(arity, wgsl)) {
            let found = fault_of_params(&module, scalars);
            faults.parameters = usize::from(found.is_some());
            faults.notes.extend(found);
            let inexact = inexact_functions(&module);
            faults.inexact = inexact.len();
            faults.notes.extend(inexact);
        }
        faults
    }
}

/// Every source that the solver may join with a constraint.
fn passes(arity: usize, wgsl: &str) -> Vec<String> {
    let mut sources = vec![solver::evaluate(arity, wgsl), solver::residual(arity, wgsl)];
    for rule in [Rule::Pbd, Rule::Xpbd] {
        for stiffness in [Stiffness::Uniform, Stiffness::Each] {
            for multiplier in [Multiplier::None, Multiplier::First, Multiplier::Next] {
                sources.push(solver::project(arity, wgsl, rule, stiffness, multiplier));
            }
        }
    }
    sources
}

fn valid_module(source: &str) -> Result<Module, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let baseline = naga::valid::Capabilities::empty();
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), baseline)
        .validate(&module)
        .map_err(|error| error.emit_to_string(source))?;
    Ok(module)
}

fn with_extra_parameter(wgsl: &str) -> String {
    let mut source = wgsl.to_owned();
    let name = source.find("struct Params");
    if let Some(brace) = name.and_then(|name| source[name..].find('{').map(|brace| name + brace)) {
        source.insert_str(brace + 1, " extra: f32,");
    }
    source
}

/// Returns the difference between `struct Params` and `scalars` numbers of type `f32`, if there is
/// one.
fn fault_of_params(module: &Module, scalars: usize) -> Option<String> {
    let params = module.types.iter().find(|(_, one)| one.name.as_deref() == Some("Params"));
    let Some((_, params)) = params else { return Some("there is no `struct Params`".to_owned()) };
    let TypeInner::Struct { members, span } = &params.inner else {
        return Some("`Params` is not a struct".to_owned());
    };
    for member in members {
        let is_f32 = matches!(
            module.types[member.ty].inner,
            TypeInner::Scalar(naga::Scalar { kind: ScalarKind::Float, width: 4 })
        );
        if !is_f32 {
            let name = member.name.as_deref().unwrap_or_default();
            return Some(format!("`{name}` of `struct Params` is not an f32"));
        }
    }
    if members.len() != scalars || *span as usize != 4 * scalars {
        let found = members.len();
        return Some(format!(
            "`struct Params` has {found} members and {span} bytes; the host stores {scalars} scalars"
        ));
    }
    None
}

/// Messages about called functions that round differently from the CPU.
fn inexact_functions(module: &Module) -> Vec<String> {
    let functions = module.functions.iter().map(|(_, function)| function);
    let mut found = Vec::new();
    for (_, expression) in functions.flat_map(|function| function.expressions.iter()) {
        if let Expression::Math { fun, .. } = expression
            && !EXACT.contains(fun)
        {
            found.push(format!("`{fun:?}` rounds differently on a device; replace it by exact operations"));
        }
    }
    found
}
